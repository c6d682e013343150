//! Rounds that raise or lower the accelerations of the profile until they use the torque limits fully.

use protocol::messages::Refusal;

use super::{ENDS, Planner, ROUNDS, STEP, Stage};
use crate::mechanics::math::clamp;
use crate::trajectory::torque_budget::TorqueBudget;

impl Planner {
    /// One sample of one half: the end of its hold next to rest, the one next to the peak speed, and in the last round its middle.
    /// After the last of them, its new accelerations.
    #[inline(never)]
    pub(super) fn balance(
        &mut self,
        budget: &TorqueBudget<'_>,
        round: u8,
        point: u8,
        wanted: [f32; 2],
    ) -> Result<(), Refusal> {
        let profile = &self.draft.profile;
        let is_last = round + 1 == ROUNDS;
        let points = if is_last { ENDS + 1 } else { ENDS };
        let braking = point >= points;
        let which = point % points;
        let share = match which {
            0 => 0.0,
            1 => 1.0,
            _ => 0.5,
        };
        let along = profile.between_ramps(braking, share);
        let here = self.point(budget.arm, along.s)?;
        let room = budget.acceleration_room(&here, &along);
        let next = along.a.abs() * clamp(room, 1.0 / STEP, STEP);
        let mut wanted = wanted;
        let [slow, fast] = &mut wanted;
        match which {
            0 => *slow = next,
            1 => *fast = next,
            _ => {
                // What the middle allows, the mean of the ends keeps.
                let share = clamp(2.0 * next / (*slow + *fast), 1.0 / STEP, 1.0);
                *slow *= share;
                *fast *= share;
            }
        }
        if which + 1 == points {
            let half = if braking {
                &mut self.bounds.brake
            } else {
                &mut self.bounds.accelerate
            };
            [half.slow, half.fast] = wanted;
        }
        self.stage = if point + 1 < 2 * points {
            Stage::Balance {
                round,
                point: point + 1,
                wanted,
            }
        } else {
            Stage::Compose { round: round + 1 }
        };
        Ok(())
    }
}
