//! Jerk-limited time law: a rest-to-rest S-curve over a scalar path coordinate.
//!
//! Seven segments at most (Biagiotti & Melchiorri, *Trajectory Planning for Automatic Machines
//! and Robots*, 2008, section 3.4), with different accelerations for speeding up and for braking:
//! friction assists braking, gravity assists a descending lift, and inertia changes along the way.
//!
//! ```text
//!  accel   ____                      one half: jerk +j, constant a, jerk -j
//!         /    \__________
//!                         \____/     the other half, mirrored in time
//! ```

use crate::mechanics::math::{cbrt, sqrt};

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
    /// Acceleration limit while speeding up.
    pub accelerate: f32,
    /// Acceleration limit while braking.
    pub brake: f32,
    /// Jerk limit.
    pub jerk: f32,
}

/// One half: from rest to `speed`, or, run backwards, from `speed` to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Half {
    jerk: f32,
    acceleration: f32,
    /// Duration of each jerk segment.
    ramp: f32,
    /// Duration of the constant-acceleration segment.
    hold: f32,
    speed: f32,
    distance: f32,
}

impl Half {
    /// The half that ends at the speed `jerk * w²`, where `full` is the length of a ramp to the greatest acceleration.
    /// Where the speed is reached before that, `w` is the length of the ramp.
    fn new(w: f32, full: f32, jerk: f32) -> Self {
        let ramp = w.min(full);
        let hold = (w * w / ramp - ramp).max(0.0);
        let speed = jerk * (w * w);
        Self {
            jerk,
            acceleration: jerk * ramp,
            ramp,
            hold,
            speed,
            distance: 0.5 * speed * (2.0 * ramp + hold),
        }
    }

    /// Distance of [`Half::new`] over the jerk, and its derivative with respect to `w`: no root in either.
    fn distance_and_slope(w: f32, full: f32) -> (f32, f32) {
        let squared = w * w;
        if w < full {
            (squared * w, 3.0 * squared)
        } else {
            let longer = squared / full;
            (0.5 * squared * (longer + full), w * (2.0 * longer + full))
        }
    }

    fn duration(&self) -> f32 {
        2.0 * self.ramp + self.hold
    }

    /// Time at which the half, from rest, has come as far as `s`, at most its distance.
    #[inline(never)]
    fn time_at(&self, s: f32) -> f32 {
        let Self {
            jerk,
            acceleration,
            ramp,
            hold,
            speed,
            distance,
        } = *self;
        // As in `at`, solved for the time.
        let u = 0.5 * ramp + hold;
        let shift = ramp * ramp / 24.0;
        if 6.0 * s < acceleration * ramp * ramp {
            return cbrt(6.0 * s / jerk);
        }
        if s < acceleration * (0.5 * u * u + shift) {
            return 0.5 * ramp + sqrt(2.0 * (s / acceleration - shift));
        }
        // A cubic that bends less and less towards the end: from its tangent there the steps come nearer from one side.
        let mut left = (distance - s) / speed;
        for _ in 0..3 {
            let bend = 0.5 * jerk * left * left;
            left = (distance - s - bend * left * (2.0 / 3.0)) / (speed - bend);
        }
        self.duration() - left
    }

    /// First segment border after `t`; infinite from the end on. Both ramps have the same length, so time may run from
    /// either end.
    fn border_after(&self, t: f32) -> f32 {
        let held = self.ramp + self.hold;
        if t < self.ramp {
            self.ramp
        } else if t < held {
            held
        } else if t < held + self.ramp {
            held + self.ramp
        } else {
            f32::INFINITY
        }
    }

    /// Motion at `t` in `0..=duration`, from rest.
    fn at(&self, t: f32) -> Sample {
        let held = self.ramp + self.hold;
        if t < self.ramp {
            let j = self.jerk;
            Sample {
                s: j * t * t * t / 6.0,
                v: 0.5 * j * t * t,
                a: j * t,
            }
        } else if t < held {
            let a = self.acceleration;
            let u = t - 0.5 * self.ramp;
            Sample {
                // The ramp counts as a shift by half its length.
                s: 0.5 * a * u * u + a * self.ramp * self.ramp / 24.0,
                v: a * u,
                a,
            }
        } else {
            let left = (self.duration() - t).max(0.0);
            let j = self.jerk;
            Sample {
                s: self.distance - self.speed * left + j * left * left * left / 6.0,
                v: self.speed - 0.5 * j * left * left,
                a: j * left,
            }
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
}

/// Newton steps for the peak speed. The start lies at most an eighth above the root of a convex increasing function, so that
/// the steps fall monotonically and the error squares; four leave less than one part in 10^6 for any ratio of the bounds
/// that a robot has (tested).
const NEWTON_STEPS: usize = 4;

impl SCurve {
    /// The fastest profile over `distance` (positive) within `bounds`.
    ///
    /// Worst case: four Newton steps, without a root.
    #[inline(never)]
    pub fn new(distance: f32, bounds: &Bounds) -> Self {
        let Bounds {
            speed,
            accelerate,
            brake,
            jerk,
        } = *bounds;
        let (up, down) = (accelerate / jerk, brake / jerk);
        let wanted = distance / jerk;
        // In the root of the peak speed over the jerk all distances are polynomials. It is less than without a limit of
        // acceleration, and less than if the ramps to it took no way.
        let unlimited = cbrt(0.5 * wanted);
        let unramped = sqrt(sqrt(2.0 * wanted * up * down / (up + down)));
        let mut w = unlimited.min(unramped);
        for _ in 0..NEWTON_STEPS {
            let (there, there_slope) = Half::distance_and_slope(w, up);
            let (back, back_slope) = Half::distance_and_slope(w, down);
            w -= (there + back - wanted) / (there_slope + back_slope);
        }
        let w = w.min(sqrt(speed / jerk));
        let accelerate = Half::new(w, up, jerk);
        let brake = Half::new(w, down, jerk);
        let cruise =
            ((distance - accelerate.distance - brake.distance) / accelerate.speed).max(0.0);
        Self {
            distance,
            accelerate,
            brake,
            cruise,
        }
    }

    /// From start to end.
    pub fn distance(&self) -> f32 {
        self.distance
    }

    /// Time from rest to rest, s.
    pub fn duration(&self) -> f32 {
        self.accelerate.duration() + self.cruise + self.brake.duration()
    }

    /// Time at which speeding up ends, s.
    pub fn accelerate_end(&self) -> f32 {
        self.accelerate.duration()
    }

    /// Peak accelerations reached: speeding up, braking.
    pub fn peaks(&self) -> (f32, f32) {
        (self.accelerate.acceleration, self.brake.acceleration)
    }

    /// Time at which braking begins, s.
    pub fn brake_start(&self) -> f32 {
        self.accelerate.duration() + self.cruise
    }

    /// First segment border after `t`, s; infinite from the end on. Jerk changes at a border, so the extrema of a move
    /// are often there.
    #[inline(never)]
    pub fn border_after(&self, t: f32) -> f32 {
        let (cruise, brake) = (self.accelerate_end(), self.brake_start());
        if t < 0.0 {
            0.0
        } else if t < cruise {
            self.accelerate.border_after(t)
        } else if t < brake {
            brake
        } else {
            brake + self.brake.border_after(t - brake)
        }
    }

    /// Motion at `t`; at rest at the start before it, and at the end after it.
    // Out of line: asked for in many places.
    #[inline(never)]
    pub fn at(&self, t: f32) -> Sample {
        let speeding = self.accelerate.duration();
        let braking = speeding + self.cruise;
        if t <= 0.0 {
            Sample::default()
        } else if t < speeding {
            self.accelerate.at(t)
        } else if t < braking {
            Sample {
                s: self.accelerate.distance + self.accelerate.speed * (t - speeding),
                v: self.accelerate.speed,
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
            let mirrored = self.brake.at(left);
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
            self.accelerate.time_at(s)
        } else if left > self.brake.distance {
            self.accelerate.duration() + (s - self.accelerate.distance) / self.accelerate.speed
        } else {
            self.duration() - self.brake.time_at(left.max(0.0))
        }
    }

    /// The shortest distance whose profile speeds up over all of `way` (positive), so that it passes there as early as any.
    pub fn run_out(way: f32, bounds: &Bounds) -> f32 {
        let there_and_back = Bounds {
            brake: bounds.accelerate,
            ..*bounds
        };
        let jerk = bounds.jerk;
        let speed = Self::new(2.0 * way, &there_and_back).accelerate.speed;
        way + Half::new(sqrt(speed / jerk), bounds.brake / jerk, jerk).distance
    }
}

#[cfg(test)]
mod tests;
