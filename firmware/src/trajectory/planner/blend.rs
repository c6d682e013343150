//! The passage from one move to the next without a stop.
//!
//! ```text
//! move      ____________________________
//!                               \________   begin = duration - overlap
//! next                  ________________________
//!                              /
//! ```
//!
//! The next move begins before this one has ended, and their ways from the corner add up, joint by joint:
//! q = q1(t) + q2(t - begin) - corner. Where one of them stands, the arm is on the path of the other, so that it leaves the paths only while both
//! move, and that only within the zone around the corner. Acceleration is as continuous as that of the moves.
//!
//! What is wanted is the longest overlap at which the tool stays in the zone, and the sum of both within every limit of the planner, at a number of
//! instants. The zone is found by bisection. The limits are no matter of longer and shorter: where the torques of the two take up and let go
//! at the same time they may need too high a rate, and none where one does before the other. So shorter ones follow until one keeps
//! them; none is as good as a stop at the corner.

use nalgebra::{Vector3, Vector4};

use super::verify::Before;
use super::{Planner, Stage};
use crate::mechanics::arm::Geometry;
use crate::mechanics::jacobian::Jacobian;
use crate::mechanics::kinematics::{self, Pose, Trig};
use crate::mechanics::math::{least, sqrt};
use crate::trajectory::path::{Path, check_limits};
use crate::trajectory::tool_speed::{self, PLANNED};
use crate::trajectory::torque_budget::TorqueBudget;
use crate::trajectory::{Reference, Setpoint, Trajectory};

/// Halvings of the overlap for the zone.
const HALVINGS: u8 = 5;
/// Overlaps that are tried for the limits, each so many times as long as the one before.
const TRIES: u8 = 8;
const SHORTER: f32 = 0.8;
/// Parts of an overlap, between the instants that are looked at.
const PARTS: u8 = 6;
/// Time within which two instants are one, s: of a torque over less, the rate is rounding.
const NEAR: f32 = 1e-5;
/// Time scale that counts as 1: either move alone may use the limits fully, and is not to stop the other one.
const FULL: f32 = 0.997;
/// Share of the limits of speed. The rest is for what lies between two instants.
const SPEED_SHARE: f32 = 0.998;
/// By what factor a speed of the tool may be passed: where one move slows down as the next one gets faster, they are no exact mirror images.
const EVEN: f32 = 1.002;
/// Share of the limits of acceleration and jerk, of a robot that has them: what the last pass leaves a move.
const CAP_SHARE: f32 = 0.95;

/// Search for the overlap of two moves, one instant of it at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Blend {
    /// Longest overlap that is known to keep the zone, s.
    kept: f32,
    /// The one that is looked at, s.
    tried: f32,
    /// By how much the next one of a bisection differs from it, s.
    step: f32,
    round: u8,
    /// Time in the overlap of the instant that is next, s.
    instant: f32,
    /// What is known of it.
    motion: Motion,
    /// The instant before, in the time of the overlap.
    before: Option<Before>,
}

/// Motion at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    Unknown,
    /// Of the first move.
    First(Reference),
    /// Of both together.
    Both(Reference),
}

impl Planner {
    /// Begins to look for the overlap of a move with the one after it, unless the arm is to stop between them. The next one does not get to its
    /// speed before this one has begun to brake, and no move overlaps with two at a time: each side gets half of it.
    pub fn begin_blend(&mut self, first: &Trajectory, next: &Trajectory) {
        let half = 0.5 * least(first.duration(), next.duration());
        let most = least(half, first.braking() + next.speeding_up());
        if first.zone > 0.0 && most > 0.0 {
            self.stage = Stage::Blend(Blend {
                kept: 0.0,
                tried: 0.5 * most,
                step: 0.25 * most,
                round: 0,
                instant: 0.5 * most,
                motion: Motion::Unknown,
                before: None,
            });
        }
    }

    /// Whether it is being looked for.
    pub fn is_blending(&self) -> bool {
        matches!(self.stage, Stage::Blend(_))
    }

    /// One step towards it. The overlap, s, once it is known.
    #[inline(never)]
    pub fn overlap(
        &mut self,
        budget: &TorqueBudget<'_>,
        first: &Trajectory,
        next: &Trajectory,
    ) -> Option<f32> {
        let Stage::Blend(blend) = &mut self.stage else {
            return None;
        };
        let found = blend.work(budget, first, next, self.slow_tool)?;
        self.stage = Stage::Idle;
        Some(found)
    }
}

impl Blend {
    fn work(
        &mut self,
        budget: &TorqueBudget<'_>,
        first: &Trajectory,
        next: &Trajectory,
        slow_tool: bool,
    ) -> Option<f32> {
        let keeps = self.look(budget, first, next, slow_tool)?;
        self.motion = Motion::Unknown;
        if self.round < HALVINGS {
            // The end of the overlap, then its beginning: elsewhere the tool is nearer to the corner.
            if keeps && self.instant > 0.0 {
                self.instant = 0.0;
                return None;
            }
            if keeps {
                self.kept = self.tried;
                self.tried += self.step;
            } else {
                self.tried -= self.step;
            }
            self.step *= 0.5;
            self.round += 1;
            self.instant = self.tried;
            if self.round == HALVINGS {
                (self.tried, self.instant) = (self.kept, 0.0);
            }
            return (self.round == HALVINGS && self.kept == 0.0).then_some(0.0);
        }
        if keeps {
            if self.instant >= self.tried {
                return Some(self.tried);
            }
            self.instant = self.instant_after(first, next);
            return None;
        }
        self.tried *= SHORTER;
        self.instant = 0.0;
        self.before = None;
        self.round += 1;
        (self.round == HALVINGS + TRIES).then_some(0.0)
    }

    /// The instant after this one: an even part later, or where the jerk of one of the moves changes, whichever comes first.
    #[inline(never)]
    fn instant_after(&self, first: &Trajectory, next: &Trajectory) -> f32 {
        let part = self.tried / f32::from(PARTS);
        let soon = self.instant + NEAR;
        let begins = first.duration() - self.tried;
        let mut after = least(self.instant + part, next.border_after(soon));
        after = least(after, first.border_after(begins + soon) - begins);
        if after > self.tried - NEAR {
            self.tried
        } else {
            after
        }
    }

    /// One step of the work at this instant: the motion of a curve of the tool, that of both moves, or their torques. Whether zone and limits
    /// are kept, once it is known.
    fn look(
        &mut self,
        budget: &TorqueBudget<'_>,
        first: &Trajectory,
        next: &Trajectory,
        slow_tool: bool,
    ) -> Option<bool> {
        let arm = budget.arm;
        let t = self.instant;
        if self.motion == Motion::Unknown {
            let Ok(reference) = first.at(arm, first.duration() - self.tried + t) else {
                return Some(false);
            };
            self.motion = Motion::First(reference);
            if matches!(first.path, Path::Tool { .. }) {
                return None;
            }
        }
        match self.motion {
            Motion::Both(reference) => Some(
                self.keeps(budget, first, next, slow_tool, &reference)
                    .is_some(),
            ),
            Motion::First(reference) => {
                let mut setpoint = Setpoint::rest(reference.q);
                setpoint.reference = reference;
                if first.add(next, arm, t, 0.0, &mut setpoint).is_err() {
                    return Some(false);
                }
                // Where the next move is a curve it begins there.
                let corner = match &next.path {
                    Path::Joint { .. } => flange(&arm.geometry, &first.end),
                    Path::Tool { curve, .. } => curve.start(),
                };
                let off = flange(&arm.geometry, &setpoint.reference.q) - corner;
                if sqrt(off.dot(&off)) > first.zone {
                    return Some(false);
                }
                self.motion = Motion::Both(setpoint.reference);
                (self.round < HALVINGS).then_some(true)
            }
            Motion::Unknown => None,
        }
    }

    /// Whether limits are kept at this instant.
    #[inline(never)]
    fn keeps(
        &mut self,
        budget: &TorqueBudget<'_>,
        first: &Trajectory,
        next: &Trajectory,
        slow_tool: bool,
        reference: &Reference,
    ) -> Option<()> {
        let arm = budget.arm;
        let Reference { q, qd, qdd } = reference;
        check_limits(arm, q, &first.end).ok()?;
        if budget.speed_scale(qd, SPEED_SHARE) < 1.0 {
            return None;
        }
        let most = most_tool_speed(first, next);
        if slow_tool || most < f32::INFINITY {
            let velocity = Jacobian::new(&arm.geometry, &Trig::new(q)).task_velocity(qd);
            let along = velocity.xyz();
            let too_fast = slow_tool && tool_speed::of(&velocity) > EVEN * PLANNED;
            if too_fast || sqrt(along.dot(&along)) > EVEN * most {
                return None;
            }
        }
        let (torque_scale, torque) = budget.torque_scale(reference);
        let mut scale = torque_scale;
        let now = Before {
            t: self.instant,
            torque,
            qdd: *qdd,
        };
        if let Some(before) = self.before.replace(now) {
            let time = self.instant - before.t;
            scale = least(scale, budget.rate_scale(&(torque - before.torque), time));
            if arm.limits.caps_acceleration() {
                scale = least(scale, budget.cap_scale(qdd, &before.qdd, time, CAP_SHARE));
            }
        }
        (scale >= FULL).then_some(())
    }
}

/// Of two moves with a speed of the tool, the greater one, m/s: between them the tool is no faster. Infinite where one has none.
fn most_tool_speed(first: &Trajectory, next: &Trajectory) -> f32 {
    if first.tool_speed > 0.0 && next.tool_speed > 0.0 {
        first.tool_speed.max(next.tool_speed)
    } else {
        f32::INFINITY
    }
}

/// Position of the flange, m.
#[inline(never)]
fn flange(geometry: &Geometry, q: &Vector4<f32>) -> Vector3<f32> {
    let Pose { x, y, z, .. } = kinematics::forward(geometry, q);
    Vector3::new(x, y, z)
}

impl Trajectory {
    /// Time from its beginning until it is at its speed along the path, s.
    fn speeding_up(&self) -> f32 {
        (self.start + self.profile.half_at(0.0)) / self.time_scale
    }

    /// Time from where it leaves that speed until its end, s.
    fn braking(&self) -> f32 {
        let brakes = self.start + self.profile.duration() - self.profile.half_at(f32::INFINITY);
        (self.span - brakes) / self.time_scale
    }

    /// First instant after `t`, s, at which the jerk changes.
    fn border_after(&self, t: f32) -> f32 {
        let t = t * self.time_scale;
        let mut border = self.start + self.profile.border_after(t - self.start);
        if let Path::Joint {
            lift: Some(lift), ..
        } = &self.path
        {
            border = least(border, lift.up.border_after(t));
            let down = lift.down.border_after(t - lift.down_start);
            border = least(border, lift.down_start + down);
        }
        border / self.time_scale
    }
}
