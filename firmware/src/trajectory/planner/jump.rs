//! The vertical strokes of a jump: how high they go, and how they lie over the travel in time.
//!
//! ```text
//! Raise (both ends) --> Stroke, Stroke --> Lead (both ends) --> Overlay --> Verify
//!                         ^------------ another height -----------+
//! ```
//!
//! Its corners are free, but not below a chamfer: the tool stays higher above the nearer end than it is away from it, or as
//! high as was asked for. A stroke that only just reaches that height brakes on its last half; so the
//! top is raised to where the stroke passes the height as fast as it can, or, if the strokes then take longer than the travel with
//! its waits, to where both take the same time.

use super::{NO_TRAVEL, Planner, Stage};
use crate::mechanics::arm::ArmModel;
use crate::mechanics::math::{least, sin_cos, sqrt};
use crate::trajectory::path::Path;
use crate::trajectory::profile::{Bounds, SCurve};
use crate::trajectory::request::Gate;
use crate::trajectory::tool_speed::{OF_A_PART, PLANNED};
use crate::trajectory::torque_budget::TorqueBudget;

/// Heights that are tried at most: as asked for, as high as is useful, and three between them.
const HEIGHTS: u8 = 5;
/// Difference of two times that is none, s.
const EQUAL: f32 = 1e-4;
/// Instants at which stroke and travel are compared at each end, and how many in one step.
const KNOTS: u8 = 8;
const KNOTS_A_STEP: u8 = 4;
/// Share of the travel from which on the other end may be the nearer one. The tool follows an arc at a varying pace, so that
/// it need not be half way when the travel is.
const OTHER_END: f32 = 0.3;
/// Steps of planning at the most.
pub(super) const STEPS: u32 = {
    let round = 2 + 2 * (1 + KNOTS / KNOTS_A_STEP) as u32 + 1;
    2 + HEIGHTS as u32 * round
};

/// A height of the top that has been tried.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tried {
    /// Above the one asked for, m.
    raise: f32,
    /// Time that the strokes take longer than the travel with its waits, s.
    excess: f32,
}

/// A jump that is being planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    gate: Gate,
    /// How much higher than asked for the top is, m.
    raise: f32,
    /// The highest one whose strokes fit into the travel, and the lowest one whose do not.
    fits: Tried,
    too_high: Tried,
    /// Whether the last one tried fits.
    fitted: bool,
    /// Whether strokes are for manual operation.
    slow: bool,
    round: u8,
    /// From the end of the travel to that of the descent, s.
    tail: f32,
}

impl Jump {
    pub(super) fn new(gate: Gate, slow: bool) -> Self {
        Self {
            gate,
            slow,
            raise: 0.0,
            fits: Tried::default(),
            too_high: Tried::default(),
            fitted: false,
            round: 0,
            tail: 0.0,
        }
    }

    /// Height of the gate above one end.
    fn height(&self, down: bool) -> f32 {
        if down { self.gate.fall } else { self.gate.rise }
    }

    /// Height above that end from which on the way across is free.
    fn free_from(&self, down: bool) -> f32 {
        let height = self.height(down);
        if self.gate.clearance > 0.0 {
            self.gate.clearance.min(height)
        } else {
            height
        }
    }

    /// The height to try after one at which the strokes take `excess` s longer than the travel with its waits: the same one if there
    /// is none better. Both times are nearly straight over the height, so a chord finds where they are equal (regula falsi, with
    /// the Illinois correction where one end of it stays).
    #[inline(never)]
    fn next(&mut self, excess: f32) -> f32 {
        let here = Tried {
            raise: self.raise,
            excess,
        };
        let fits = excess <= 0.0;
        let (first, lowest) = (self.round == 0, here.raise <= 0.0);
        self.round += 1;
        if excess.abs() < EQUAL || fits && first || !fits && lowest {
            return here.raise;
        }
        let (replaced, kept) = if fits {
            (&mut self.fits, &mut self.too_high)
        } else {
            (&mut self.too_high, &mut self.fits)
        };
        *replaced = here;
        if fits == self.fitted {
            kept.excess *= 0.5;
        }
        self.fitted = fits;
        let (low, high) = (self.fits, self.too_high);
        if first {
            0.0
        } else {
            low.raise + (high.raise - low.raise) * low.excess / (low.excess - high.excess)
        }
    }

    /// Bounds of one stroke; of the descent with time running backwards, so that both ends are alike.
    #[inline(never)]
    fn bounds(&self, budget: &TorqueBudget<'_>, down: bool) -> Bounds {
        let highest = self.gate.rise.max(self.gate.fall) + self.raise;
        let bounds = budget.lift(highest, down);
        let speed = if self.slow {
            bounds.speed.min(OF_A_PART * PLANNED)
        } else {
            bounds.speed
        };
        if down {
            Bounds {
                accelerate: bounds.brake,
                brake: bounds.accelerate,
                speed,
                ..bounds
            }
        } else {
            Bounds { speed, ..bounds }
        }
    }
}

/// What the lead at one end is worked out from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chamfer {
    /// Way of the tool across per unit of path, at the most, m.
    pace: f32,
    /// Time between two knots, s.
    step: f32,
}

impl Planner {
    /// How much higher the top has to be for the stroke at one end to pass the height of the gate without braking.
    #[inline(never)]
    pub(super) fn raise(&mut self, budget: &TorqueBudget<'_>, down: bool) {
        self.stage = Stage::Stroke { down: false };
        let Some(jump) = &mut self.jump else { return };
        let free_from = jump.free_from(down);
        if free_from > NO_TRAVEL {
            let bounds = jump.bounds(budget, down);
            let wanted = SCurve::run_out(free_from, &bounds) - jump.height(down);
            jump.too_high.raise = jump.too_high.raise.max(wanted.min(jump.gate.room));
        }
        if down {
            jump.raise = jump.too_high.raise;
        } else {
            self.stage = Stage::Raise { down: true };
        }
    }

    /// The profile of one vertical stroke.
    #[inline(never)]
    pub(super) fn stroke(&mut self, budget: &TorqueBudget<'_>, down: bool) {
        let (Some(jump), Some(lift)) = (&self.jump, self.draft.path.lift()) else {
            return;
        };
        let profile = stroke(jump.height(down) + jump.raise, &jump.bounds(budget, down));
        self.stage = if down {
            lift.down = profile.reversed();
            Stage::Lead {
                down: false,
                knot: 0,
                chamfer: None,
                lead: 0.0,
            }
        } else {
            lift.up = profile;
            Stage::Stroke { down: true }
        };
    }

    /// How long the travel has to wait for the stroke at one end: for the rise after the start, or, seen backwards, for the
    /// descent before the end.
    #[inline(never)]
    pub(super) fn lead(
        &mut self,
        arm: &ArmModel,
        down: bool,
        knot: u8,
        chamfer: Option<Chamfer>,
        lead: f32,
    ) {
        let (Some(jump), Some(lift)) = (&mut self.jump, self.draft.path.lift()) else {
            return;
        };
        let (travel_back, stroke_back);
        let (travel, stroke) = if down {
            travel_back = self.draft.profile.reversed();
            stroke_back = lift.down.reversed();
            (&travel_back, &stroke_back)
        } else {
            (&self.draft.profile, &lift.up)
        };
        let (free_from, beyond) = (jump.free_from(down), jump.free_from(!down));
        let (mut knot, mut lead) = (knot, lead);
        if free_from <= NO_TRAVEL || travel.distance() <= 0.0 {
            // Nothing to wait for.
            knot = KNOTS;
        } else if jump.gate.clearance > 0.0 {
            lead = stroke.time_at(free_from);
            knot = KNOTS;
        } else {
            let Some(Chamfer { pace, step }) = chamfer else {
                let pace = pace(arm, &self.draft.path, free_from, down);
                let until = travel.time_at((free_from / pace).min(1.0));
                let step = until / f32::from(KNOTS);
                self.stage = Stage::Lead {
                    down,
                    knot,
                    chamfer: Some(Chamfer { pace, step }),
                    lead,
                };
                return;
            };
            // To an end that the compiler does not know: it would write the body four times.
            let end = (knot + KNOTS_A_STEP).min(KNOTS);
            while knot < end {
                knot += 1;
                let t = f32::from(knot) * step;
                let across = travel.at(t);
                let own = least(pace * across.s, free_from);
                // Beyond its middle the other end is nearer, and may be higher.
                let soon = across.s + step * (across.v + step * across.a.abs());
                let other = if soon > OTHER_END {
                    free_from - beyond + least(beyond, 0.5 * pace)
                } else {
                    0.0
                };
                let here = stroke.at(lead + t);
                // Between two knots the height above the chamfer is nearly a cubic, and a cubic does not leave the hull of its control
                // points, of which two are a third of a step away from the knots.
                let slope = if own < free_from {
                    (here.v - pace * across.v).abs()
                } else {
                    0.0
                };
                let needed = least(own.max(other) + slope * step / 3.0, free_from);
                if here.s < needed {
                    lead = stroke.time_at(needed) - t;
                }
            }
        }
        self.stage = if knot < KNOTS {
            Stage::Lead {
                down,
                knot,
                chamfer,
                lead,
            }
        } else if down {
            jump.tail = lead;
            Stage::Overlay
        } else {
            self.draft.start = lead;
            Stage::Lead {
                down: true,
                knot: 0,
                chamfer: None,
                lead: 0.0,
            }
        };
    }

    /// Strokes and travel in time; whether another height is to be tried.
    #[inline(never)]
    pub(super) fn overlay(&mut self) {
        let (Some(jump), Some(lift)) = (&mut self.jump, self.draft.path.lift()) else {
            return;
        };
        let wanted = self.draft.start + self.draft.profile.duration() + jump.tail;
        let needed = lift.up.duration() + lift.down.duration();
        self.draft.span = wanted.max(needed);
        lift.down_start = self.draft.span - lift.down.duration();
        let next = jump.next(needed - wanted);
        if next == jump.raise || jump.round >= HEIGHTS {
            self.begin_pass();
        } else {
            jump.raise = next;
            self.stage = Stage::Stroke { down: false };
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

/// The sum of two ways at the angle of the elbow.
#[inline(never)]
fn pace_at(arm1: f32, arm2: f32, elbow: f32) -> f32 {
    let (_, cos) = sin_cos(elbow);
    sqrt((arm1 * arm1 + arm2 * arm2 + 2.0 * arm1 * arm2 * cos).max(0.0))
}

/// The greatest way of the tool across per unit of path, m, within the first `height` metres from one end of the path. Along a
/// straight line in joint space it depends on the cosine of the elbow alone.
fn pace(arm: &ArmModel, path: &Path, height: f32, from_end: bool) -> f32 {
    let Path::Joint { start, delta, .. } = path else {
        return f32::MAX;
    };
    let arm1 = arm.geometry.a1 * delta.x;
    let arm2 = arm.geometry.a2 * (delta.x + delta.y);
    let at = |elbow: f32| pace_at(arm1, arm2, elbow);
    let (first, step) = if from_end {
        (start.y + delta.y, -delta.y)
    } else {
        (start.y, delta.y)
    };
    let here = at(first).max(NO_TRAVEL);
    let share = height / here;
    let last = first + step * if share < 0.5 { share } else { 1.0 };
    if first * last <= 0.0 {
        // Past the stretched arm, where it is greatest or least.
        return (arm1.abs() + arm2.abs()).max(NO_TRAVEL);
    }
    here.max(at(last))
}
