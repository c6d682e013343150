//! Rounds that raise or lower both accelerations of the profile until they use the torque limits fully.

use protocol::messages::Refusal;

use super::{BALANCE_POINTS, Planner, STEP, Stage, fill};
use crate::mechanics::arm::ArmModel;
use crate::trajectory::path::Path;
use crate::trajectory::torque_budget::TorqueBudget;

impl Planner {
    /// One sample of one half; at the end of a round, new accelerations.
    #[inline(never)]
    pub(super) fn balance(
        &mut self,
        budget: &TorqueBudget<'_>,
        round: u8,
        point: u8,
        gain: [f32; 2],
    ) -> Result<(), Refusal> {
        let profile = &self.draft.profile;
        let braking = point >= BALANCE_POINTS;
        let share = (f32::from(point % BALANCE_POINTS) + 0.5) / f32::from(BALANCE_POINTS);
        let (from, to) = if braking {
            (profile.brake_start(), profile.duration())
        } else {
            (0.0, profile.accelerate_end())
        };
        let along = profile.at(from + share * (to - from));
        let here = self.point(budget.arm, along.s)?;
        let [mut speeding_gain, mut braking_gain] = gain;
        let room = budget.acceleration_room(&here, &along);
        if braking {
            braking_gain = braking_gain.min(room);
        } else {
            speeding_gain = speeding_gain.min(room);
        }
        if point + 1 < 2 * BALANCE_POINTS {
            self.stage = Stage::Balance {
                round,
                point: point + 1,
                gain: [speeding_gain, braking_gain],
            };
            return Ok(());
        }
        let (up, down) = profile.peaks();
        let ceiling = self.acceleration_ceiling(budget.arm);
        let correct = |peak: f32, gain: f32| (peak * gain.max(1.0 / STEP)).min(ceiling);
        self.bounds.accelerate = correct(up, speeding_gain);
        self.bounds.brake = correct(down, braking_gain);
        self.stage = Stage::Compose { round: round + 1 };
        Ok(())
    }

    /// The joint acceleration limits as a limit along the path.
    fn acceleration_ceiling(&self, arm: &ArmModel) -> f32 {
        match &self.draft.path {
            Path::Joint { delta, .. } => fill(&arm.limits.acceleration, delta),
            // Varies along a line: left to the last pass.
            Path::Line { .. } => f32::MAX,
        }
    }
}
