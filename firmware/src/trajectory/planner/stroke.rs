//! The vertical strokes of a jump, and the time at which each passes the clearance.

use super::{NO_TRAVEL, Planner, Stage};
use crate::trajectory::Lift;
use crate::trajectory::path::Path;
use crate::trajectory::profile::{Bounds, SCurve};
use crate::trajectory::torque_budget::TorqueBudget;

impl Planner {
    /// The profile of one vertical stroke.
    pub(super) fn stroke(&mut self, budget: &TorqueBudget<'_>, down: bool) {
        let (Some(gate), Path::Joint { start, .. }) = (self.gate, &self.draft.path) else {
            self.stage = Stage::Compose { round: 0 };
            return;
        };
        let (up_bounds, down_bounds) = budget.lift(gate.rise.max(gate.fall));
        let lift = self.draft.lift.get_or_insert(Lift {
            from: start.z,
            up: SCurve::default(),
            down: SCurve::default(),
            down_start: 0.0,
        });
        if down {
            lift.down = stroke(gate.fall, &down_bounds);
        } else {
            lift.up = stroke(gate.rise, &up_bounds);
        }
        self.stage = Stage::Clear { down };
    }

    /// The time at which one stroke passes the clearance.
    pub(super) fn clear(&mut self, down: bool) {
        self.stage = Stage::Compose { round: 0 };
        let (Some(gate), Some(lift)) = (self.gate, &self.draft.lift) else {
            return;
        };
        if down {
            self.blended = lift.down.time_at(gate.fall - gate.clearance.min(gate.fall));
        } else {
            self.draft.start = lift.up.time_at(gate.clearance.min(gate.rise));
            self.stage = Stage::Stroke { down: true };
        }
    }
}

/// A profile over a length that may be zero.
fn stroke(length: f32, bounds: &Bounds) -> SCurve {
    if length > NO_TRAVEL {
        SCurve::new(length, bounds)
    } else {
        SCurve::default()
    }
}
