//! Survey of the path before any timing: reach, limits, and how far each joint travels.

use nalgebra::Vector4;
use protocol::messages::Refusal;

use super::{Planner, ROUNDS, SURVEY_POINTS, Stage, fill};
use crate::mechanics::math::{clamp, least};
use crate::trajectory::path::{Path, check_limits};
use crate::trajectory::profile::{Bounds, HalfBounds};
use crate::trajectory::request::from_ik;
use crate::trajectory::tool_speed::{OF_A_PART, PLANNED, along};
use crate::trajectory::torque_budget::TorqueBudget;

impl Planner {
    /// Reach, limits and the largest joint travel per unit of path.
    #[inline(never)]
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
        let fastest = fastest.sup(&here.dq.abs());
        if point == 0 {
            budget.check_creep()?;
        }
        if point < points {
            self.stage = Stage::Survey {
                point: point + 1,
                fastest,
            };
            return Ok(());
        }
        // Of a robot that has such limits.
        let limits = &budget.arm.limits;
        let jerk = fill(&limits.jerk, &fastest);
        let half = HalfBounds::even(fill(&limits.acceleration, &fastest), jerk);
        self.bounds = Bounds {
            speed: fill(&budget.speed(), &fastest),
            jerk,
            accelerate: half,
            brake: half,
        };
        if self.bounds.speed == f32::MAX {
            // Nothing moves along the path: at most the lift of a jump does.
            self.bounds.speed = 0.0;
            self.stage = Stage::Compose { round: ROUNDS };
        } else {
            if self.slow_tool {
                let part = if self.jump.is_some() { OF_A_PART } else { 1.0 };
                let (path, geometry) = (&self.draft.path, &budget.arm.geometry);
                let speed = along(path, geometry, part * PLANNED);
                self.bounds.speed = self.bounds.speed.min(speed);
            }
            self.stage = Stage::Rest { place: 0 };
        }
        Ok(())
    }

    /// What the torques and their rates allow an arm at rest at the beginning, in the middle and at the end of the path: the jerk
    /// there, the least of which is that next to the peak speed, and the accelerations for the first round.
    #[inline(never)]
    pub(super) fn rest(&mut self, budget: &TorqueBudget<'_>, place: u8) -> Result<(), Refusal> {
        let here = self.point(budget.arm, 0.5 * f32::from(place))?;
        let (acceleration, jerk) = budget.from_rest(&here);
        let bounds = &mut self.bounds;
        let half = |half: &HalfBounds| {
            HalfBounds::even(least(half.slow, acceleration), least(half.jerk, jerk))
        };
        bounds.jerk = least(bounds.jerk, jerk);
        self.stage = Stage::Rest { place: place + 1 };
        match place {
            0 => bounds.accelerate = half(&bounds.accelerate),
            1 => {}
            _ => {
                bounds.brake = half(&bounds.brake);
                self.stage = Stage::Compose { round: 0 };
            }
        }
        Ok(())
    }
}
