//! How warm the motors get if a cycle goes on as planned, and what the controller makes of that.

use firmware::control::fault::OVERLOAD_PERCENT;
use firmware::control::heat::{LEAST_PACE, WARM, pace};
use firmware::mechanics::body::Body;
use firmware::mechanics::kinematics::Trig;
use firmware::trajectory::Reference;
use nalgebra::Vector4;

use crate::maths::ln;
use crate::metrics::time_constant;
use crate::model::AXES;

/// Heat that is foreseen only roughly: a stop is said to be certain where it is passed by this factor.
const CERTAIN: f64 = 1.1;

/// Mean squares of a cycle, by axis, of the effort over the continuous one.
#[derive(Clone, Debug, Default)]
pub(super) struct Cycle {
    /// Samples while the reference moves, and while it rests.
    moving: f64,
    resting: f64,
    /// Of what goes with the square of the pace, of what does not depend on it, and their product.
    dynamic: [f64; 4],
    product: [f64; 4],
    constant: [f64; 4],
    /// Of weight at rest.
    holding: [f64; 4],
}

impl Cycle {
    /// What a sample of the reference needs.
    pub(super) fn add(&mut self, body: &Body, continuous: &Vector4<f32>, reference: &Reference) {
        let own = |effort: &Vector4<f32>| {
            let motor = body.drive.motor_torque(effort);
            let share = body.drive.own_torque(&motor).component_div(continuous);
            share.map(f64::from)
        };
        let Reference { q, qd, qdd } = reference;
        let weight = body.lagrange.gravity();
        if qd.amax() == 0.0 {
            self.resting += 1.0;
            let held = own(&weight);
            for axis in 0..4 {
                self.holding[axis] += held[axis] * held[axis];
            }
            return;
        }
        self.moving += 1.0;
        let friction = body.drive.friction(qd);
        let constant = own(&(weight + friction));
        let dynamic =
            own(&(body.frictionless(&body.lagrange.couplings(&Trig::new(q)), qd, qdd) - weight));
        for axis in 0..4 {
            let (constant, dynamic) = (constant[axis], dynamic[axis]);
            self.constant[axis] += constant * constant;
            self.product[axis] += 2.0 * constant * dynamic;
            self.dynamic[axis] += dynamic * dynamic;
        }
    }

    /// Heat of each motor if it goes on for ever at this pace.
    pub(super) fn for_ever(&self, pace: f64) -> [f64; 4] {
        let square = pace * pace;
        let samples = (self.moving / pace + self.resting).max(1.0);
        std::array::from_fn(|axis| {
            let moving =
                self.constant[axis] + square * (self.product[axis] + square * self.dynamic[axis]);
            (moving / pace + self.holding[axis]) / samples
        })
    }

    /// The pace at which it goes on for ever, and the heat of the motors then.
    fn settled(&self) -> (f64, [f64; 4]) {
        let paces = (0..=100).rev().map(|percent| f64::from(percent) * 0.01);
        let least = f64::from(LEAST_PACE);
        let paces = paces.take_while(|pace| *pace > least);
        let kept = |&at: &f64| f64::from(pace(greatest(&self.for_ever(at)).1 as f32)) >= at;
        let at = paces.into_iter().find(kept).unwrap_or(least);
        (at, self.for_ever(at))
    }

    /// What is to be said of `cycles` of them, `period` s a sample: a warning, or why they end.
    pub(super) fn foresee(&self, cycles: u32, period: f64) -> Option<Result<String, String>> {
        let (axis, heat) = greatest(&self.for_ever(1.0));
        let warm = f64::from(WARM);
        if heat <= warm {
            return None;
        }
        let cycle_s = (self.moving + self.resting) * period;
        let after = time_constant() * -ln(1.0 - warm / heat);
        let lasts = cycle_s * f64::from(cycles);
        if after >= lasts {
            return None;
        }
        let mut text = format!(
            "as planned, the motor of the {axis} gets to {:.0} % of the heat that it may have for ever: from about {after:.0} s on, in cycle {:.0}, \
             moves begin more slowly",
            heat * 100.0,
            (after / cycle_s).ceil()
        );
        let (at, settled) = self.settled();
        let (axis, hottest) = greatest(&settled);
        let limit = f64::from(OVERLOAD_PERCENT) * 0.01;
        if hottest > limit {
            // At the latest: as if it had been so slow from the beginning.
            let stops = time_constant() * -ln(1.0 - limit / hottest);
            text += &format!(
                ", and even at {at:.2} of their speed the {axis} gets to {:.0} %: at {:.0} % the controller stops the arm for overload, within about {stops:.0} s; \
                 a lighter load or longer pauses without torque are needed",
                hottest * 100.0,
                limit * 100.0
            );
            let is_certain = hottest > limit * CERTAIN && stops * CERTAIN < lasts;
            return Some(if is_certain { Err(text) } else { Ok(text) });
        }
        let slower_s = (self.moving / at + self.resting) * period;
        text += &format!(
            ", until they have settled at about {at:.2} of their speed and a cycle takes {slower_s:.2} s instead of {cycle_s:.2}"
        );
        if let Some(pause) = self.pause(warm) {
            text += &format!(
                "; with {:.2} s more of dwell a cycle they need not",
                pause * period
            );
        }
        Some(Ok(text))
    }

    /// Samples of rest that keep every motor below `warm`, if any do.
    fn pause(&self, warm: f64) -> Option<f64> {
        let samples = self.moving + self.resting;
        let mut longest = 0.0f64;
        for (heat, holding) in self.for_ever(1.0).into_iter().zip(self.holding) {
            // While it rests, it only holds.
            let rest = holding / self.resting.max(1.0);
            let missing = samples * (heat - warm);
            if missing > 0.0 {
                if rest >= warm {
                    return None;
                }
                longest = longest.max(missing / (warm - rest));
            }
        }
        Some(longest)
    }
}

fn greatest(shares: &[f64; 4]) -> (&'static str, f64) {
    let each = AXES.into_iter().zip(*shares);
    each.fold((AXES[0], 0.0), |greatest, axis| {
        if axis.1 > greatest.1 { axis } else { greatest }
    })
}
