//! One half of a profile: from rest to the peak speed, or, run backwards, from that to rest.

use super::{HalfBounds, Sample};
use crate::mechanics::math::{cbrt, sqrt};

/// Where both halves meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Peak {
    pub(super) speed: f32,
    /// Of the segments next to it.
    pub(super) jerk: f32,
}

/// How the distance of one half grows with its peak speed. In the root w of that speed all distances are polynomials.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth {
    bounds: HalfBounds,
    /// Jerk next to the peak.
    jerk: f32,
    /// Up to this w the acceleration is a triangle, whose apex is `apex` times w and whose distance `cubic` times w³.
    triangle: f32,
    apex: f32,
    pub(super) cubic: f32,
    /// Above it, the speed that the ramps alone lead to, and the distance as a polynomial of the time between them.
    ramps: f32,
    distance: [f32; 3],
}

impl Growth {
    pub(super) fn new(bounds: &HalfBounds, jerk: f32) -> Self {
        let HalfBounds {
            jerk: own,
            slow,
            fast,
        } = *bounds;
        let apex = sqrt(2.0 * own * jerk / (own + jerk));
        let (ramp, fall) = (slow / own, fast / jerk);
        let speed = 0.5 * slow * ramp;
        let (up, down) = (apex / own, apex / jerk);
        Self {
            bounds: *bounds,
            jerk,
            triangle: slow.max(fast) / apex,
            apex,
            cubic: apex * (up * (up / 6.0 + 0.5 * down) + down * down / 3.0),
            ramps: speed + 0.5 * fast * fall,
            distance: [
                speed * (ramp / 3.0 + fall) + fast * fall * fall / 3.0,
                speed + 0.5 * (slow + fast) * fall,
                (2.0 * slow + fast) / 6.0,
            ],
        }
    }

    /// Time between the ramps, and its slope over the speed.
    fn hold(&self, w: f32) -> (f32, f32) {
        let slope = 2.0 / (self.bounds.slow + self.bounds.fast);
        ((w * w - self.ramps) * slope, slope)
    }

    /// Distance and its derivative with respect to w: no root in either.
    pub(super) fn distance_and_slope(&self, w: f32) -> (f32, f32) {
        if w < self.triangle {
            let squared = self.cubic * w * w;
            (squared * w, 3.0 * squared)
        } else {
            let (hold, slope) = self.hold(w);
            let [constant, linear, square] = self.distance;
            (
                constant + hold * (linear + hold * square),
                (linear + 2.0 * hold * square) * slope * 2.0 * w,
            )
        }
    }

    /// What the distance over w⁴ would be if the ramps took no time.
    pub(super) fn unramped(&self) -> f32 {
        let HalfBounds { slow, fast, .. } = self.bounds;
        let sum = slow + fast;
        (2.0 / 3.0) * (slow + sum) / (sum * sum)
    }

    /// The half with this peak.
    pub(super) fn half(&self, w: f32) -> Half {
        let HalfBounds { jerk, slow, fast } = self.bounds;
        let (distance, _) = self.distance_and_slope(w);
        if w < self.triangle {
            let apex = self.apex * w;
            Half {
                jerk,
                ramp: apex / jerk,
                hold: 0.0,
                bend: 0.0,
                fall: apex / self.jerk,
                distance,
            }
        } else {
            let (hold, _) = self.hold(w);
            let change = fast - slow;
            Half {
                jerk,
                ramp: slow / jerk,
                hold,
                bend: if hold > 0.0 { change / hold } else { 0.0 },
                fall: fast / self.jerk,
                distance,
            }
        }
    }
}

/// One half: from rest to the peak speed, or, run backwards, from that to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Half {
    /// Jerk of the first segment.
    jerk: f32,
    /// Duration of it.
    pub(super) ramp: f32,
    /// Duration of the segment between the ramps.
    pub(super) hold: f32,
    /// Jerk there.
    bend: f32,
    /// Duration of the last segment, next to the peak.
    pub(super) fall: f32,
    pub(super) distance: f32,
}

impl Half {
    pub(super) fn duration(&self) -> f32 {
        self.ramp + self.hold + self.fall
    }

    /// At the end of the first segment.
    fn ramped(&self) -> Sample {
        let a = self.jerk * self.ramp;
        let v = 0.5 * a * self.ramp;
        Sample {
            s: v * self.ramp / 3.0,
            v,
            a,
        }
    }

    /// Time at which the half, from rest, has come as far as `s`, at most its distance.
    #[inline(never)]
    pub(super) fn time_at(&self, peak: &Peak, s: f32) -> f32 {
        let ramped = self.ramped();
        if s < ramped.s {
            return cbrt(6.0 * s / self.jerk);
        }
        let held = ramped.after(self.hold, self.bend);
        if s < held.s {
            // From the time without the bend, Newton steps on a cubic that hardly bends.
            let way = s - ramped.s;
            let mut u = (sqrt(ramped.v * ramped.v + 2.0 * ramped.a * way) - ramped.v) / ramped.a;
            for _ in 0..4 {
                let here = ramped.after(u, self.bend);
                u -= (here.s - s) / here.v;
            }
            return self.ramp + u;
        }
        // A cubic that bends less and less towards the end: from its tangent there the steps come nearer from one side.
        let Peak { speed, jerk } = *peak;
        let mut left = (self.distance - s) / speed;
        for _ in 0..5 {
            let bend = 0.5 * jerk * left * left;
            left = (self.distance - s - bend * left * (2.0 / 3.0)) / (speed - bend);
        }
        self.duration() - left
    }

    /// Motion at `t` in `0..=duration`, from rest.
    pub(super) fn at(&self, peak: &Peak, t: f32) -> Sample {
        if t < self.ramp {
            return Sample::default().after(t, self.jerk);
        }
        let since = t - self.ramp;
        if since < self.hold {
            return self.ramped().after(since, self.bend);
        }
        let left = (self.hold + self.fall - since).max(0.0);
        let a = peak.jerk * left;
        let lost = 0.5 * a * left;
        Sample {
            s: self.distance - left * (peak.speed - lost / 3.0),
            v: peak.speed - lost,
            a,
        }
    }
}

impl Sample {
    /// `t` seconds later, with this jerk.
    #[inline(always)]
    fn after(&self, t: f32, jerk: f32) -> Self {
        let gain = jerk * t;
        Self {
            s: self.s + t * (self.v + t * (0.5 * self.a + gain / 6.0)),
            v: self.v + t * (self.a + 0.5 * gain),
            a: self.a + gain,
        }
    }
}
