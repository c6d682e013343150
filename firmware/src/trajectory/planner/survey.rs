//! Survey of the path before any timing: reach, limits, and how far each joint travels.

use nalgebra::Vector4;
use protocol::messages::Refusal;

use super::verify::share;
use super::{NO_TRAVEL, Planner, ROUNDS, Stage};
use crate::mechanics::math::{clamp, least};
use crate::trajectory::path::{Path, PathPoint, check_limits};
use crate::trajectory::profile::{Bounds, HalfBounds};
use crate::trajectory::request::from_ik;
use crate::trajectory::tool_speed::{OF_A_PART, PLANNED, along};
use crate::trajectory::torque_budget::TorqueBudget;

/// How near to a turning point a point of the survey is the one next to it, in parts of the way between two: a little more than half.
const NEXT: f32 = 0.55;

/// Share of the jerk that is left to the ramps of a move at a speed of the tool: for any excess there, the last pass would lower that.
const EVEN_SHARE: f32 = 0.9;
/// How often the least time in which a move gets up to its speed, or its acceleration is built up, fits into the move: shorter ones would
/// be lost in the rounding of its time.
const RAMPS: f32 = 2000.0;

/// The place at which the arm is most nearly stretched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Apex {
    /// |theta2| there, rad.
    bend: f32,
    /// Path coordinate.
    s: f32,
}

impl Apex {
    /// Before the first place.
    pub(super) const NONE: Self = Self {
        bend: f32::INFINITY,
        s: 0.0,
    };
}

impl Planner {
    /// Reach, limits and the largest joint travel per unit of path; after the last point the bounds that follow from it, of an arc in a step of
    /// their own.
    #[inline(never)]
    pub(super) fn survey(
        &mut self,
        budget: &TorqueBudget<'_>,
        point: u8,
        fastest: Vector4<f32>,
        apex: Apex,
    ) -> Result<(), Refusal> {
        // A straight path in joint space stays between its ends.
        let (points, curve) = match &self.draft.path {
            Path::Joint { .. } => (1, None),
            Path::Tool { curve, .. } => (curve.parts(), Some(curve)),
        };
        if point > points {
            self.bound(budget, &fastest, apex);
            return Ok(());
        }
        let count = f32::from(points);
        let mut s = f32::from(point) / count;
        // Where it comes nearest to the base the arm is bent most, and where it goes farthest least: the point between the ends next to
        // such a place moves there.
        if let Some(place) = curve.map(|curve| curve.turning_point(s))
            && place > 0.0
            && place < 1.0
            && (clamp(place * count, 1.0, count - 1.0) - f32::from(point)).abs() < NEXT
        {
            s = place;
        }
        let here = self.point(budget.arm, s)?;
        // Until the plan is complete, this is where it starts.
        let from = &self.draft.end;
        let farthest = farthest(&here, s, NEXT / count);
        check_limits(budget.arm, &farthest, from).map_err(from_ik)?;
        let fastest = fastest.sup(&here.dq.abs());
        let bend = here.q.y.abs();
        let apex = if bend < apex.bend {
            Apex { bend, s }
        } else {
            apex
        };
        if point == 0 {
            budget.check_creep()?;
        }
        if point < points || self.draft.path.is_arc() {
            self.stage = Stage::Survey {
                point: point + 1,
                fastest,
                apex,
            };
            return Ok(());
        }
        self.bound(budget, &fastest, apex);
        Ok(())
    }

    /// Bounds of the motion along the path.
    fn bound(&mut self, budget: &TorqueBudget<'_>, fastest: &Vector4<f32>, apex: Apex) {
        let mut speed = fill(&budget.speed(), fastest);
        if speed == f32::MAX {
            // Nothing moves along the path: at most the lift of a jump does.
            self.bounds.speed = 0.0;
            self.stage = Stage::Compose { round: ROUNDS };
            return;
        }
        if self.slow_tool {
            let part = if self.jump.is_some() { OF_A_PART } else { 1.0 };
            let (path, geometry) = (&self.draft.path, &budget.arm.geometry);
            speed = speed.min(along(path, geometry, part * PLANNED));
        }
        if let Path::Tool { curve, .. } = &self.draft.path
            && self.draft.tool_speed > 0.0
        {
            // The share of full speed slows the whole plan down, and must not do so twice.
            speed = speed.min(self.draft.tool_speed / (self.speed * curve.length()));
        }
        // Of a robot that has such limits.
        let limits = &budget.arm.limits;
        let quickest = RAMPS * speed;
        let acceleration = fill(&limits.acceleration, fastest).min(speed * quickest);
        let jerk = fill(&limits.jerk, fastest).min(speed * quickest * quickest);
        let half = HalfBounds::even(acceleration, jerk);
        self.bounds = Bounds {
            speed,
            jerk,
            accelerate: half,
            brake: half,
        };
        self.stage = if self.draft.path.is_arc() {
            self.apex = apex.s;
            Stage::Cruise { place: 0 }
        } else {
            Stage::Rest { place: 0 }
        };
    }

    /// What the torques and their rates allow an arm at rest at the beginning, in the middle and at the end of the path: the jerk
    /// there, the least of which is that next to the peak speed, and the accelerations for the first round.
    #[inline(never)]
    pub(super) fn rest(&mut self, budget: &TorqueBudget<'_>, place: u8) -> Result<(), Refusal> {
        let here = self.point(budget.arm, 0.5 * f32::from(place))?;
        let (acceleration, jerk) = budget.from_rest(&here);
        // As much as the last pass leaves.
        let mut jerk = share(&self.draft) * jerk;
        if self.draft.tool_speed > 0.0 {
            jerk *= EVEN_SHARE;
        }
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

/// Joint positions at a place, or of a joint that turns back within `reach` of it and on the path, where that does: by the parabola
/// through its position there.
fn farthest(here: &PathPoint, s: f32, reach: f32) -> Vector4<f32> {
    let mut farthest = here.q;
    for (q, (dq, ddq)) in farthest
        .as_mut_slice()
        .iter_mut()
        .zip(here.dq.as_slice().iter().zip(here.ddq.as_slice()))
    {
        let ahead = -dq / ddq;
        if ahead.abs() < reach && ahead > -s && ahead < 1.0 - s {
            *q += 0.5 * dq * ahead;
        }
    }
    farthest
}

/// The speed along the path at which the first joint reaches its limit, given the joints' travel per unit of path; huge
/// where nothing moves.
// Out of line, for the size of its copies.
#[inline(never)]
pub(super) fn fill(limit: &Vector4<f32>, travel: &Vector4<f32>) -> f32 {
    limit
        .as_slice()
        .iter()
        .zip(travel.as_slice())
        .filter(|(_, travel)| travel.abs() > NO_TRAVEL)
        .map(|(limit, travel)| limit / travel.abs())
        .fold(f32::MAX, f32::min)
}
