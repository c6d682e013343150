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

/// The last pass so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pass {
    /// The largest time scale at which its samples keep every limit.
    time_scale: f32,
    /// The last of them.
    before: Option<Before>,
}

impl Pass {
    /// Before its first sample.
    pub(super) fn begin() -> Self {
        Self {
            time_scale: 1.0,
            before: None,
        }
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
    /// Begins the last pass.
    pub(super) fn begin_pass(&mut self) {
        self.pass = Pass::begin();
        self.stage = Stage::Verify;
    }

    /// One sample of the whole move: its motion.
    #[inline(never)]
    pub(super) fn verify(&mut self, budget: &TorqueBudget<'_>) -> Result<(), Refusal> {
        let before = self.pass.before.as_ref();
        let t = before.map_or(0.0, |before| self.next_sample(before.t));
        // In place: what is returned would be copied on the way.
        let mut reference = Reference::rest(self.draft.end);
        let evaluated = self.draft.evaluate(budget.arm, t, &mut reference, None);
        evaluated.map_err(from_path)?;
        let scale = match self.draft.path {
            // The speed along the path keeps that of every joint, and a stroke that of the lift.
            Path::Joint { .. } => budget.shared_speed_scale(&reference.qd),
            Path::Tool { .. } => budget.speed_scale(&reference.qd, TOOL_SHARE),
        };
        self.pass.time_scale = least(self.pass.time_scale, scale);
        self.stage = Stage::Load { t, reference };
        Ok(())
    }

    /// Its torques.
    #[inline(never)]
    pub(super) fn load(&mut self, budget: &TorqueBudget<'_>, t: f32, reference: &Reference) {
        let Reference { qd, qdd, .. } = *reference;
        let (full, torque) = budget.torques_of(reference);
        let now = Before { t, torque, qdd };
        let before = self.pass.before.replace(now).unwrap_or(now);
        let (time, share) = (t - before.t, share(&self.draft));
        let change = torque - before.torque;
        if self.caps && time > 0.0 {
            let scale = budget.cap_scale(&qdd, &before.qdd, time, CAP_SHARE * share);
            self.pass.time_scale = least(self.pass.time_scale, scale);
        }
        let time = share * time;
        // Nearly every sample keeps its limits as it is: then there is nothing to solve.
        if budget.keeps_torque(&full) && budget.keeps_rate(&change, time) {
            self.go_on(t);
        } else {
            self.stage = Stage::Solve {
                full,
                qd,
                change,
                time,
            };
        }
    }

    /// Its time scale, where it needs too much torque or a change of it that is too fast.
    #[inline(never)]
    pub(super) fn solve(
        &mut self,
        budget: &TorqueBudget<'_>,
        (full, qd): (&Torques, &Vector4<f32>),
        (change, time): (&Torques, f32),
    ) {
        let scale = least(budget.scale_of(full, qd), budget.rate_scale(change, time));
        self.pass.time_scale = least(self.pass.time_scale, scale);
        self.go_on(self.pass.before.map_or(0.0, |before| before.t));
    }

    /// To the sample after the one at `t`.
    fn go_on(&mut self, t: f32) {
        self.stage = if t < self.draft.span {
            Stage::Verify
        } else {
            Stage::Finish
        };
    }

    /// Makes the draft the trajectory.
    #[inline(never)]
    pub(super) fn finish(&mut self, budget: &TorqueBudget<'_>) -> Result<(), Refusal> {
        // Past the end, so that rounding in the last sample cannot leave the arm short of it.
        let past = self.draft.span + 1.0;
        self.draft.end = self.draft.at(budget.arm, past).map_err(from_path)?.q;
        self.draft.time_scale = self.pass.time_scale * self.speed;
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
            // The descent begins no sooner than the rise has ended.
            let since = soon - down_start;
            let border = if since < 0.0 {
                least(up.border_after(soon), *down_start)
            } else {
                down_start + down.border_after(since)
            };
            next = least(next, border);
        }
        // Nor may the last one follow at once: a rate over no time is rounding.
        if span - next < 0.05 * step {
            next = *span;
        }
        next
    }
}
