//! The last pass: the whole move against every limit.

use nalgebra::Vector4;
use protocol::messages::Refusal;

use super::{Planner, Stage};
use crate::mechanics::body::Torques;
use crate::mechanics::math::least;
use crate::trajectory::path::Path;
use crate::trajectory::request::from_path;
use crate::trajectory::torque_budget::TorqueBudget;
use crate::trajectory::{Lift, Reference, Trajectory};

/// Most steps of the last pass between the borders of the travel's segments; more along a curve of the tool, where the joints have extrema
/// of their own.
const JOINT_STEPS: u8 = 24;
/// Share of the limits of speed, acceleration, jerk and torque rate that the samples of such a curve may use: there is more between them, and
/// of rates they show the mean over a step.
const TOOL_SHARE: f32 = 0.9;
/// Further share of those of acceleration and jerk, of a robot that has them.
const CAP_SHARE: f32 = 0.95;

/// Share of the limits for the samples of this move.
pub(super) fn share(draft: &Trajectory) -> f32 {
    match draft.path {
        Path::Joint { .. } => 1.0,
        Path::Tool { .. } => TOOL_SHARE,
    }
}

/// A sample of the last pass or of an overlap, for the one after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Before {
    /// Its time, s.
    pub(super) t: f32,
    /// Torques without Coulomb friction.
    pub(super) torque: Torques,
    /// Joint accelerations.
    pub(super) qdd: Vector4<f32>,
}

impl Planner {
    /// One sample of the whole move.
    #[inline(never)]
    pub(super) fn verify(
        &mut self,
        budget: &TorqueBudget<'_>,
        time_scale: f32,
        before: Option<Before>,
    ) -> Result<(), Refusal> {
        let t = before.map_or(0.0, |before| self.next_sample(before.t));
        let reference = self.draft.at(budget.arm, t).map_err(from_path)?;
        let scale = budget.speed_scale(&reference.qd, share(&self.draft));
        self.stage = Stage::Load {
            t,
            time_scale: least(time_scale, scale),
            before,
            reference,
        };
        Ok(())
    }

    /// Its torques.
    #[inline(never)]
    pub(super) fn load(
        &mut self,
        budget: &TorqueBudget<'_>,
        (t, time_scale, before): (f32, f32, Option<Before>),
        reference: &Reference,
    ) {
        let (torque_scale, torque) = budget.torque_scale(reference);
        let mut time_scale = least(time_scale, torque_scale);
        if let Some(before) = before {
            let time = t - before.t;
            let change = torque - before.torque;
            let share = share(&self.draft);
            time_scale = least(time_scale, budget.rate_scale(&change, share * time));
            if budget.arm.limits.caps_acceleration() {
                let jerk = (reference.qdd - before.qdd) / time;
                let scale = budget.cap_scale(&reference.qdd, &jerk, CAP_SHARE * share);
                time_scale = least(time_scale, scale);
            }
        }
        self.stage = if t < self.draft.span {
            Stage::Verify {
                time_scale,
                before: Some(Before {
                    t,
                    torque,
                    qdd: reference.qdd,
                }),
            }
        } else {
            Stage::Finish { time_scale }
        };
    }

    /// Makes the draft the trajectory.
    #[inline(never)]
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
    #[inline(never)]
    pub(super) fn next_sample(&self, t: f32) -> f32 {
        let Trajectory {
            path,
            start,
            profile,
            span,
            ..
        } = &self.draft;
        let steps = match path {
            Path::Joint { .. } => JOINT_STEPS,
            Path::Tool { curve, .. } => curve.parts(),
        };
        let mut step = span / f32::from(steps);
        if matches!(path, Path::Tool { .. }) {
            // One that ends next to the stretched arm brakes within a small part of its time: at least half as many steps for that, and
            // for speeding up.
            step = least(step, profile.half_at(t) / f32::from(steps / 2));
        }
        // A border next to the last sample adds nothing, and rounding must not stall the pass.
        let soon = t + 0.05 * step;
        let mut next = least(t + step, *span);
        if path.is_arc() && self.apex > soon {
            next = least(next, self.apex);
        }
        next = least(next, start + profile.border_after(soon - start));
        // A stroke shorter than that changes the torques of the wrist's motor several times while the travel takes up its own.
        if let Path::Joint {
            lift: Some(lift), ..
        } = path
            && profile.is_next_to_rest(soon - start)
        {
            let Lift {
                up,
                down,
                down_start,
                ..
            } = lift;
            next = least(next, up.border_after(soon));
            next = least(next, down_start + down.border_after(soon - down_start));
        }
        // Nor may the last one follow at once: a rate over no time is rounding.
        if span - next < 0.05 * step {
            next = *span;
        }
        next
    }
}
