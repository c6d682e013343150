//! One half of a profile: from rest to the peak speed, or, run backwards, from that to rest.

use super::{HalfBounds, Sample};
use crate::mechanics::math::{cbrt, sqrt};

const THIRD: f32 = 1.0 / 3.0;

/// Where both halves meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Peak {
    pub(super) speed: f32,
    /// Of the segments next to it.
    pub(super) jerk: f32,
}

/// How the distance of one half grows with its peak speed. All distances are polynomials in m, the peak acceleration that ramps of the
/// peak's jerk alone would need: the speed is m²/jerk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth {
    bounds: HalfBounds,
    /// Reciprocal of the jerk next to the peak.
    per_jerk: f32,
    /// Up to this m the acceleration is a triangle, whose apex is `apex` times m and whose distance `cubic` times m³.
    triangle: f32,
    apex: f32,
    pub(super) cubic: f32,
    /// Above it, the speed that the ramps alone lead to, and the distance as a polynomial of the time between them.
    ramps: f32,
    /// Time between the ramps for each unit of speed above that.
    hold: f32,
    distance: [f32; 3],
}

impl Growth {
    // Out of line, for the size of one copy.
    #[inline(never)]
    pub(super) fn new(bounds: &HalfBounds, jerk: f32) -> Self {
        let HalfBounds {
            jerk: own,
            slow,
            fast,
        } = *bounds;
        // The root of what is between 1 and 2 where the jerk next to rest is the higher one, as it is in a plan: four steps from there
        // leave nothing, down to a third of it.
        let squared = 2.0 * own / (own + jerk);
        let mut apex = 1.2;
        for _ in 0..4 {
            apex = 0.5 * (apex + squared / apex);
        }
        let (ramp, fall) = (slow / own, fast / jerk);
        let speed = 0.5 * slow * ramp;
        let (up, down) = (apex / own, apex / jerk);
        Self {
            bounds: *bounds,
            per_jerk: 1.0 / jerk,
            triangle: slow.max(fast) / apex,
            apex,
            cubic: apex * (up * (up / 6.0 + 0.5 * down) + down * down / 3.0),
            ramps: speed + 0.5 * fast * fall,
            hold: 2.0 / (slow + fast),
            distance: [
                speed * (ramp / 3.0 + fall) + fast * fall * fall / 3.0,
                speed + 0.5 * (slow + fast) * fall,
                (2.0 * slow + fast) / 6.0,
            ],
        }
    }

    /// Distance of the half with a peak speed above the triangle's, and its slope.
    fn long(&self, speed: f32) -> (f32, f32) {
        let hold = (speed - self.ramps) * self.hold;
        let [constant, linear, square] = self.distance;
        (
            constant + hold * (linear + hold * square),
            (linear + 2.0 * hold * square) * self.hold,
        )
    }

    /// Distance and its derivative with respect to m: no root in either.
    pub(super) fn distance_and_slope(&self, m: f32) -> (f32, f32) {
        if m < self.triangle {
            let squared = self.cubic * m * m;
            (squared * m, 3.0 * squared)
        } else {
            let slow = m * self.per_jerk;
            let (distance, slope) = self.long(m * slow);
            (distance, 2.0 * slope * slow)
        }
    }

    /// What the distance over m⁴ would be if the ramps took no time.
    pub(super) fn unramped(&self) -> f32 {
        let ratio = self.hold * self.per_jerk;
        self.distance[2] * ratio * ratio
    }

    /// The half with this m.
    pub(super) fn half(&self, m: f32) -> Half {
        let HalfBounds { jerk, slow, fast } = self.bounds;
        if m < self.triangle {
            let apex = self.apex * m;
            return Half {
                jerk,
                ramp: apex / jerk,
                hold: 0.0,
                bend: 0.0,
                fall: apex * self.per_jerk,
                distance: self.cubic * m * m * m,
            };
        }
        let speed = m * m * self.per_jerk;
        let hold = (speed - self.ramps) * self.hold;
        let (distance, _) = self.long(speed);
        Half {
            jerk,
            ramp: slow / jerk,
            hold,
            bend: if hold > 0.0 {
                (fast - slow) / hold
            } else {
                0.0
            },
            fall: fast * self.per_jerk,
            distance,
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

    /// First border after `t`, from rest: up to the duration.
    pub(super) fn border_after(&self, t: f32) -> f32 {
        let mut border = self.ramp;
        if border <= t {
            border += self.hold;
        }
        // Rounding must not let the last third end before the half does.
        let third = THIRD * self.fall;
        for _ in 0..2 {
            if border <= t {
                border += third;
            }
        }
        if border <= t { self.duration() } else { border }
    }

    /// Last border before `t`, from rest.
    pub(super) fn border_before(&self, t: f32) -> f32 {
        let third = THIRD * self.fall;
        let held = self.ramp + self.hold;
        [held + 2.0 * third, held + third, held, self.ramp]
            .into_iter()
            .find(|border| *border < t)
            .unwrap_or(0.0)
    }

    /// At the end of the first segment.
    fn ramped(&self) -> Sample {
        from_rest(self.jerk, self.ramp)
    }

    /// Motion so long after the end of the first segment, up to the beginning of the last.
    pub(super) fn held(&self, since: f32) -> Sample {
        self.ramped().after(since, self.bend)
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
            return from_rest(self.jerk, t);
        }
        let since = t - self.ramp;
        if since < self.hold {
            return self.held(since);
        }
        let left = (self.hold + self.fall - since).max(0.0);
        // What is missing to even motion is the same motion from rest.
        let lost = from_rest(peak.jerk, left);
        Sample {
            s: self.distance - left * peak.speed + lost.s,
            v: peak.speed - lost.v,
            a: lost.a,
        }
    }
}

/// `t` seconds after rest, with this jerk.
#[inline(always)]
fn from_rest(jerk: f32, t: f32) -> Sample {
    let a = jerk * t;
    let v = 0.5 * a * t;
    Sample {
        s: v * t * THIRD,
        v,
        a,
    }
}

impl Sample {
    /// `t` seconds later, with this jerk.
    #[inline(always)]
    fn after(&self, t: f32, jerk: f32) -> Self {
        let gain = jerk * t;
        Self {
            s: self.s + t * (self.v + t * (0.5 * self.a + gain * (0.5 * THIRD))),
            v: self.v + t * (self.a + 0.5 * gain),
            a: self.a + gain,
        }
    }
}
