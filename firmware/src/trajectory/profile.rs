//! Jerk-limited time law: a rest-to-rest S-curve over a scalar path coordinate.
//!
//! Seven segments at most (Biagiotti & Melchiorri, *Trajectory Planning for Automatic Machines
//! and Robots*, 2008, section 3.4), with different accelerations for speeding up and for braking:
//! friction assists braking, gravity assists a descending lift, and inertia changes along the way. In place of a constant
//! acceleration it changes evenly from the one next to rest to the one next to the peak speed, since what a motor has left depends
//! on the speed.
//!
//! ```text
//!  accel   __                        one half: jerk of its end, an even change, jerk of the peak
//!         /  ---.__
//!                  \      __        the other half, mirrored in time
//!                   \.---`  \__
//! ```

mod half;

use crate::mechanics::math::{cbrt, fourth_root_or_more, sqrt};
use half::{Growth, Half, Peak};

/// Value and first two time derivatives of the path coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Path coordinate, in the unit of the distance the profile was made for.
    pub s: f32,
    /// First derivative, 1/s.
    pub v: f32,
    /// Second derivative, 1/s².
    pub a: f32,
}

/// Bounds of a profile; all finite and positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Speed limit.
    pub speed: f32,
    /// Jerk limit next to the peak speed.
    pub jerk: f32,
    /// While speeding up.
    pub accelerate: HalfBounds,
    /// While braking.
    pub brake: HalfBounds,
}

/// Bounds of one half of a profile; all finite and positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfBounds {
    /// Jerk limit next to rest.
    pub jerk: f32,
    /// Acceleration limit next to rest.
    pub slow: f32,
    /// Acceleration limit next to the peak speed.
    pub fast: f32,
}

impl HalfBounds {
    /// With the same acceleration at every speed.
    pub const fn even(acceleration: f32, jerk: f32) -> Self {
        Self {
            jerk,
            slow: acceleration,
            fast: acceleration,
        }
    }
}

/// A rest-to-rest S-curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SCurve {
    distance: f32,
    accelerate: Half,
    brake: Half,
    cruise: f32,
    peak: Peak,
}

/// Newton steps for the peak speed. The start lies above the root of a function that is convex, or nearly so, and increasing: the steps
/// fall monotonically and the error squares. Four leave less than one part in 10^6 for any ratio of the bounds
/// that a robot has (tested).
const NEWTON_STEPS: usize = 4;

impl SCurve {
    /// The fastest profile over `distance` (positive) within `bounds`.
    ///
    /// Worst case: a cube root, a square root, and four Newton steps.
    #[inline(never)]
    pub fn new(distance: f32, bounds: &Bounds) -> Self {
        let there = Growth::new(&bounds.accelerate, bounds.jerk);
        let back = Growth::new(&bounds.brake, bounds.jerk);
        let m = meet(distance, &there, &back, bounds);
        let (accelerate, brake) = (there.half(m), back.half(m));
        let speed = m * m / bounds.jerk;
        let cruise = ((distance - accelerate.distance - brake.distance) / speed).max(0.0);
        Self {
            distance,
            accelerate,
            brake,
            cruise,
            peak: Peak {
                speed,
                jerk: bounds.jerk,
            },
        }
    }

    /// From start to end.
    pub fn distance(&self) -> f32 {
        self.distance
    }

    /// Time from rest to rest, s.
    pub fn duration(&self) -> f32 {
        self.brake_start() + self.brake.duration()
    }

    /// Time at which braking begins, s.
    fn brake_start(&self) -> f32 {
        self.accelerate.duration() + self.cruise
    }

    /// Motion between the ramps while speeding up, or while `braking`: `share` of the way in time from the end next to rest to the
    /// one next to the peak speed.
    #[inline(never)]
    pub fn between_ramps(&self, braking: bool, share: f32) -> Sample {
        let half = if braking {
            &self.brake
        } else {
            &self.accelerate
        };
        let Sample { s, v, a } = half.held(share * half.hold);
        if braking {
            Sample {
                s: self.distance - s,
                v,
                a: -a,
            }
        } else {
            Sample { s, v, a }
        }
    }

    /// Duration of the half that is under way at `t`, s; infinite at the peak speed between them.
    pub fn half_at(&self, t: f32) -> f32 {
        if t < self.accelerate.duration() {
            self.accelerate.duration()
        } else if t < self.brake_start() {
            f32::INFINITY
        } else {
            self.brake.duration()
        }
    }

    /// Whether the acceleration is being taken up from rest at `t`, s, or lowered to it.
    pub fn is_next_to_rest(&self, t: f32) -> bool {
        t < self.accelerate.ramp || t > self.duration() - self.brake.ramp
    }

    /// First segment border after `t`, s; infinite from the end on. Jerk changes at a border, so the extrema of a move
    /// are often there. The ramps next to the peak speed count as three segments each: at that speed the inertia changes within them, and
    /// with it the torque's rate of change.
    #[inline(never)]
    pub fn border_after(&self, t: f32) -> f32 {
        let speeding = self.accelerate.duration();
        let braking = speeding + self.cruise;
        if t < 0.0 {
            0.0
        } else if t < speeding {
            self.accelerate.border_after(t)
        } else if t < braking {
            braking
        } else {
            let left = self.duration() - t;
            if left <= 0.0 {
                f32::INFINITY
            } else {
                self.duration() - self.brake.border_before(left)
            }
        }
    }

    /// Motion at `t`; at rest at the start before it, and at the end after it.
    // Out of line: asked for in many places.
    #[inline(never)]
    pub fn at(&self, t: f32) -> Sample {
        let speeding = self.accelerate.duration();
        if t <= 0.0 {
            Sample::default()
        } else if t < speeding {
            self.accelerate.at(&self.peak, t)
        } else if t < speeding + self.cruise {
            Sample {
                s: self.accelerate.distance + self.peak.speed * (t - speeding),
                v: self.peak.speed,
                a: 0.0,
            }
        } else {
            let left = self.duration() - t;
            if left <= 0.0 {
                return Sample {
                    s: self.distance,
                    ..Sample::default()
                };
            }
            // Counted from the end, so that the last sample is exact.
            let mirrored = self.brake.at(&self.peak, left);
            Sample {
                s: self.distance - mirrored.s,
                v: mirrored.v,
                a: -mirrored.a,
            }
        }
    }

    /// The same motion with time running backwards.
    pub fn reversed(&self) -> Self {
        Self {
            accelerate: self.brake,
            brake: self.accelerate,
            ..*self
        }
    }

    /// First time at which the coordinate has reached `s`: 0 to the distance, which is not zero.
    #[inline(never)]
    pub fn time_at(&self, s: f32) -> f32 {
        let left = self.distance - s;
        if s < self.accelerate.distance {
            self.accelerate.time_at(&self.peak, s)
        } else if left > self.brake.distance {
            self.accelerate.duration() + (s - self.accelerate.distance) / self.peak.speed
        } else {
            self.duration() - self.brake.time_at(&self.peak, left.max(0.0))
        }
    }

    /// The shortest distance whose profile speeds up over all of `way` (positive), so that it passes there as early as any.
    #[inline(never)]
    pub fn run_out(way: f32, bounds: &Bounds) -> f32 {
        let there = Growth::new(&bounds.accelerate, bounds.jerk);
        let back = Growth::new(&bounds.brake, bounds.jerk);
        let m = meet(2.0 * way, &there, &there, bounds);
        way + back.half(m).distance
    }
}

/// The m, at most that of the speed limit, at which both halves together make `distance`.
#[inline(never)]
fn meet(distance: f32, there: &Growth, back: &Growth, bounds: &Bounds) -> f32 {
    // It is less than without a limit of acceleration, and less than if the ramps took no time.
    let unlimited = cbrt(distance / (there.cubic + back.cubic));
    let unramped = fourth_root_or_more(distance / (there.unramped() + back.unramped()));
    let mut m = unlimited.min(unramped);
    for _ in 0..NEWTON_STEPS {
        let (there, there_slope) = there.distance_and_slope(m);
        let (back, back_slope) = back.distance_and_slope(m);
        m -= (there + back - distance) / (there_slope + back_slope);
    }
    if m * m > bounds.speed * bounds.jerk {
        sqrt(bounds.speed * bounds.jerk)
    } else {
        m
    }
}

#[cfg(test)]
mod tests;
