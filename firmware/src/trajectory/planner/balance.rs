//! Rounds that raise or lower the accelerations of the profile until they use the torque limits fully.

use protocol::messages::Refusal;

use super::survey::fill;
use super::{ENDS, Planner, ROUNDS, STEP, Stage};
use crate::mechanics::arm::ArmModel;
use crate::mechanics::math::clamp;
use crate::trajectory::path::{Path, PathPoint};
use crate::trajectory::profile::{Bounds, SCurve, Sample};
use crate::trajectory::torque_budget::TorqueBudget;

impl Planner {
    /// Profile from the bounds.
    #[inline(never)]
    pub(super) fn compose(&mut self, arm: &ArmModel, round: u8) {
        let travels = self.bounds.speed > 0.0;
        if travels {
            // The joint acceleration limits as a limit along the path. They vary along a curve of the tool: left to the last pass.
            if let Path::Joint { delta, .. } = &self.draft.path {
                let ceiling = fill(&arm.limits.acceleration, delta);
                let Bounds {
                    accelerate, brake, ..
                } = &mut self.bounds;
                for acceleration in [
                    &mut accelerate.slow,
                    &mut accelerate.fast,
                    &mut brake.slow,
                    &mut brake.fast,
                ] {
                    *acceleration = acceleration.min(ceiling);
                }
            }
            self.draft.profile = SCurve::new(1.0, &self.bounds);
        }
        self.draft.span = self.draft.profile.duration();
        if travels && round < ROUNDS {
            self.stage = Stage::Balance {
                round,
                point: 0,
                wanted: [0.0; 2],
            };
        } else if self.jump.is_some() {
            self.stage = Stage::Raise { down: false };
        } else {
            if self.draft.path.is_arc() {
                self.apex = self.draft.profile.time_at(self.apex);
            }
            self.begin_pass();
        }
    }

    /// One sample of one half: the end of its hold next to rest, the one next to the peak speed, and in the last round its middle. Along an arc
    /// its torques take a step of their own.
    #[inline(never)]
    pub(super) fn balance(
        &mut self,
        budget: &TorqueBudget<'_>,
        round: u8,
        point: u8,
        wanted: [f32; 2],
    ) -> Result<(), Refusal> {
        let profile = &self.draft.profile;
        let points = points(round);
        let braking = point >= points;
        let share = match point % points {
            0 => 0.0,
            1 => 1.0,
            _ => 0.5,
        };
        let along = profile.between_ramps(braking, share);
        let here = self.point(budget.arm, along.s)?;
        if !self.draft.path.is_arc() {
            self.weigh(budget, (&here, &along), round, point, wanted);
        } else {
            self.stage = Stage::Weigh {
                here,
                along,
                round,
                point,
                wanted,
            };
        }
        Ok(())
    }

    /// What its torques leave; after the last sample of the half, its new accelerations.
    #[inline(never)]
    pub(super) fn weigh(
        &mut self,
        budget: &TorqueBudget<'_>,
        (here, along): (&PathPoint, &Sample),
        round: u8,
        point: u8,
        wanted: [f32; 2],
    ) {
        let points = points(round);
        let which = point % points;
        let room = budget.acceleration_room(here, along);
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
            let half = if point >= points {
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
    }
}

/// Samples of one half in this round.
fn points(round: u8) -> u8 {
    if round + 1 == ROUNDS { ENDS + 1 } else { ENDS }
}
