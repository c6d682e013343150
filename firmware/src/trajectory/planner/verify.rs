//! The last pass: the whole move against every limit.

use nalgebra::Vector4;
use protocol::messages::Refusal;

use super::{Planner, Stage};
use crate::mechanics::math::least;
use crate::trajectory::Trajectory;
use crate::trajectory::path::Path;
use crate::trajectory::request::from_path;
use crate::trajectory::torque_budget::TorqueBudget;

/// Most steps of the last pass between segment borders; more along a line, where the joints have extrema of their own.
const JOINT_STEPS: u8 = 20;
pub(super) const LINE_STEPS: u8 = 40;
/// Share of the limits of speed, acceleration and jerk that the samples of a line may use.
const LINE_SHARE: f32 = 0.9;

impl Planner {
    /// One sample of the whole move.
    pub(super) fn verify(
        &mut self,
        budget: &TorqueBudget<'_>,
        t: f32,
        time_scale: f32,
        before: Option<(f32, Vector4<f32>)>,
    ) -> Result<(), Refusal> {
        let reference = self.draft.at(budget.arm, t).map_err(from_path)?;
        let mut time_scale = least(time_scale, budget.torque_scale(&reference));
        if matches!(self.draft.path, Path::Line { .. }) {
            let jerk = before.map_or_else(Vector4::zeros, |(earlier, qdd)| {
                (reference.qdd - qdd) / (t - earlier)
            });
            time_scale = least(
                time_scale,
                budget.derivative_scale(&reference, &jerk, LINE_SHARE),
            );
        } else {
            // The profile keeps each joint within its own limits; but lift and wrist share a motor.
            time_scale = least(time_scale, budget.lift_motor_scale(&reference.qd));
        }
        self.stage = if t < self.draft.span {
            Stage::Verify {
                t: self.next_sample(t),
                time_scale,
                before: Some((t, reference.qdd)),
            }
        } else {
            Stage::Finish { time_scale }
        };
        Ok(())
    }

    /// Makes the draft the trajectory.
    pub(super) fn finish(
        &mut self,
        budget: &TorqueBudget<'_>,
        time_scale: f32,
    ) -> Result<(), Refusal> {
        // Past the end, so that rounding in the last sample cannot leave the arm short of it.
        let past = self.draft.span + 1.0;
        self.draft.end = self.draft.at(budget.arm, past).map_err(from_path)?.q;
        self.draft.time_scale = time_scale * self.speed;
        self.stage = Stage::Idle;
        Ok(())
    }

    /// The sample of the last pass after `t`, s: inertia changes along the way, and torque often peaks at a segment
    /// border.
    pub(super) fn next_sample(&self, t: f32) -> f32 {
        let Trajectory {
            path,
            start,
            profile,
            lift,
            span,
            ..
        } = &self.draft;
        let steps = match path {
            Path::Joint { .. } => JOINT_STEPS,
            Path::Line { .. } => LINE_STEPS,
        };
        let step = span / f32::from(steps);
        // A border next to the last sample adds nothing, and rounding must not stall the pass.
        let soon = t + 0.05 * step;
        let mut next = least(t + step, *span);
        next = least(next, start + profile.border_after(soon - start));
        if let Some(lift) = lift {
            let border = if soon < lift.down_start {
                least(lift.up.border_after(soon), lift.down_start)
            } else {
                lift.down_start + lift.down.border_after(soon - lift.down_start)
            };
            next = least(next, border);
        }
        next
    }
}
