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
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The three derivatives, integrated in f64, reproduce the distance; no bound is exceeded.
        #[test]
        fn integrates_to_the_distance_within_bounds(
            distance in 0.01f32..6.0,
            speed in 0.05f32..30.0,
            accelerate in 0.5f32..600.0,
            ratio in 0.2f32..5.0,
            jerk in 50.0f32..40_000.0,
        ) {
            let bounds = Bounds { speed, accelerate, brake: accelerate * ratio, jerk };
            let curve = SCurve::new(distance, &bounds);
            let duration = curve.duration();
            let steps = 4000;
            let h = f64::from(duration) / f64::from(steps);
            let mut s = 0.0f64;
            let mut before = 0.0;
            for i in 0..steps {
                let sample = curve.at(((f64::from(i) + 0.5) * h) as f32);
                s += f64::from(sample.v) * h;
                prop_assert!(sample.v >= -1e-5 && sample.v <= speed * 1.00001);
                prop_assert!(sample.a <= accelerate * 1.00001);
                prop_assert!(-sample.a <= accelerate * ratio * 1.00001);
                // Accelerations of f32, each off by 4 u.
                // And of f32 times.
                let noise = 8.0 * f32::EPSILON * accelerate * ratio.max(1.0)
                    + 2.0 * f32::EPSILON * duration * jerk;
                prop_assert!((sample.a - before).abs() <= jerk * (h as f32) * 1.0001 + noise);
                before = sample.a;
            }
            // Midpoint rule: error below h^2/24 * T * max|a'| = jerk; plus f32 in the evaluation.
            let rule = h * h * f64::from(duration * jerk) / 24.0;
            prop_assert!((s - f64::from(distance)).abs() < rule + 4e-6 * f64::from(distance), "{s} {distance}");
            prop_assert_eq!(curve.at(duration).s, distance);
            prop_assert_eq!(curve.at(-1.0), Sample::default());
        }

        /// Position is continuous across the segment borders: no jump larger than speed x step.
        #[test]
        fn is_continuous(
            distance in 0.01f32..6.0,
            accelerate in 0.5f32..600.0,
            jerk in 50.0f32..40_000.0,
        ) {
            let bounds = Bounds { speed: 1e3, accelerate, brake: accelerate, jerk };
            let curve = SCurve::new(distance, &bounds);
            let h = curve.duration() / 1000.0;
            for i in 0..1000 {
                let (before, after) = (curve.at(i as f32 * h), curve.at((i + 1) as f32 * h));
                let slack = 4e-6 * distance;
                prop_assert!((after.s - before.s - 0.5 * (before.v + after.v) * h).abs()
                    <= slack + jerk * h * h * h);
            }
        }
    }

    /// The jerk is constant between borders and changes at each. All eight are found, and no other.
    #[test]
    fn borders_are_where_the_jerk_changes() {
        let bounds = Bounds {
            speed: 2.0,
            accelerate: 20.0,
            brake: 30.0,
            jerk: 1e3,
        };
        let curve = SCurve::new(1.0, &bounds);
        let mut t = -0.1;
        let borders = [(); 8].map(|()| {
            let border = curve.border_after(t);
            t = border + 1e-6;
            border
        });
        assert_eq!(curve.border_after(t), f32::INFINITY);
        assert_eq!(borders[0], 0.0);
        assert!((borders[7] / curve.duration() - 1.0).abs() < 1e-6);
        for (segment, jerk) in borders
            .windows(2)
            .zip([1e3, 0.0, -1e3, 0.0, -1e3, 0.0, 1e3])
        {
            let length = segment[1] - segment[0];
            for share in [0.01, 0.4, 0.7] {
                let t = segment[0] + share * length;
                let change = curve.at(t + 0.29 * length).a - curve.at(t).a;
                // Time and acceleration off by 4 u each, over 0.29 of some 10 ms.
                let slope = change / (0.29 * length);
                assert!((slope - jerk).abs() < 1.0, "{slope} {jerk} {borders:?}");
            }
        }
    }

    #[test]
    fn symmetric_triangle_has_the_textbook_duration() {
        // Without a speed limit and with jerk only: T = (32 s / j)^(1/3).
        let curve = SCurve::new(
            1.0,
            &Bounds {
                speed: 1e3,
                accelerate: 1e6,
                brake: 1e6,
                jerk: 500.0,
            },
        );
        let expected = libm::cbrtf(32.0 / 500.0);
        assert!((curve.duration() / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn time_at_inverts_the_profile() {
        let curve = SCurve::new(
            0.025,
            &Bounds {
                speed: 2.2,
                accelerate: 55.0,
                brake: 40.0,
                jerk: 1e4,
            },
        );
        for i in 1..10 {
            let s = 0.0025 * i as f32;
            // At the peak speed of 1 m/s, 2^-14 of 50 ms.
            assert!((curve.at(curve.time_at(s)).s - s).abs() < 4e-6);
        }
    }
}
