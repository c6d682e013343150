//! Survey of the path before any timing: reach, limits, and how far each joint travels.

use nalgebra::Vector4;
use protocol::messages::Refusal;

use super::{Planner, SURVEY_POINTS, Stage, fill};
use crate::mechanics::math::clamp;
use crate::trajectory::path::{Path, PathPoint, check_limits};
use crate::trajectory::profile::Sample;
use crate::trajectory::request::from_ik;
use crate::trajectory::torque_budget::TorqueBudget;

impl Planner {
    /// Reach, limits and the largest joint travel per unit of path; at the ends also the accelerations from
    /// rest that torque allows, as initial values of the rounds.
    pub(super) fn survey(
        &mut self,
        budget: &TorqueBudget<'_>,
        point: u8,
        fastest: Vector4<f32>,
    ) -> Result<(), Refusal> {
        // A straight path in joint space stays between its ends.
        let points = match self.draft.path {
            Path::Joint { .. } => 1,
            Path::Line { .. } => SURVEY_POINTS,
        };
        let count = f32::from(points);
        let mut s = f32::from(point) / count;
        // Where it comes nearest to the base the arm is bent most: the point between the ends next to it moves there.
        if let Some(nearest) = self.draft.path.nearest()
            && point == clamp(nearest * count + 0.5, 1.0, count - 1.0) as u8
        {
            s = nearest;
        }
        let here = self.point(budget.arm, s)?;
        // Until the plan is complete, this is where it starts.
        let from = &self.draft.end;
        check_limits(budget.arm, &here.q, from).map_err(from_ik)?;
        let limits = &budget.arm.limits;
        let fastest = fastest.sup(&here.dq.abs());
        if point == 0 {
            budget.check_creep()?;
            self.bounds.accelerate = self.acceleration_from_rest(budget, &here);
        }
        if point < points {
            self.stage = Stage::Survey {
                point: point + 1,
                fastest,
            };
            return Ok(());
        }
        self.bounds.brake = self.acceleration_from_rest(budget, &here);
        self.bounds.jerk = fill(&limits.jerk, &fastest);
        self.bounds.speed = fill(&budget.speed(), &fastest);
        if self.bounds.speed == f32::MAX {
            // Nothing moves along the path: at most the lift of a jump does.
            self.bounds.speed = 0.0;
        }
        self.stage = Stage::Compose { round: 0 };
        Ok(())
    }

    /// The path acceleration at which a joint at rest reaches its limit of torque or acceleration.
    pub(super) fn acceleration_from_rest(
        &self,
        budget: &TorqueBudget<'_>,
        here: &PathPoint,
    ) -> f32 {
        let a = fill(&budget.arm.limits.acceleration, &here.dq);
        let along = Sample {
            a,
            ..Sample::default()
        };
        a * budget.acceleration_room(here, &along).min(1.0)
    }
}
