//! End stops: a one-sided spring with a damper at each joint limit.

use crate::maths::square;
use crate::model::JointLimits;
use nalgebra::Vector4;

/// The eight end stops.
#[derive(Clone, Debug, PartialEq)]
pub struct EndStops {
    lower: Vector4<f64>,
    upper: Vector4<f64>,
    stiffness: Vector4<f64>,
    damping: Vector4<f64>,
}

/// Angular frequency of a joint on its stop, rad/s. An axis that arrives at speed v compresses its stop by less than
/// v / RATE (1 degree on axis 1 at full speed, 6 mm on the lift); slow enough for the integrator to resolve.
const RATE: f64 = 400.0;

/// Damping ratio on the stop: an axis leaves it with three tenths of its arrival speed.
const DAMPING_RATIO: f64 = 0.5;

impl EndStops {
    /// Stops at the limits, for joints of these inertias (kg m2, kg).
    pub fn new(limits: &JointLimits, inertia: &Vector4<f64>) -> Self {
        Self {
            lower: limits.lower.into(),
            upper: limits.upper.into(),
            stiffness: inertia * (RATE * RATE),
            damping: inertia * (2.0 * DAMPING_RATIO * RATE),
        }
    }

    /// Efforts that push the joints back inside. A stop never pulls.
    pub fn effort(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vector4<f64> {
        Vector4::from_fn(|i, _| {
            let depth = self.depth(q, i);
            if depth == 0.0 {
                return 0.0;
            }
            let push = -self.stiffness[i] * depth - self.damping[i] * qd[i];
            if depth > 0.0 {
                push.min(0.0)
            } else {
                push.max(0.0)
            }
        })
    }

    /// Energy stored in the springs, J.
    pub fn energy(&self, q: &Vector4<f64>) -> f64 {
        (0..4)
            .map(|i| 0.5 * self.stiffness[i] * square(self.depth(q, i)))
            .sum()
    }

    /// Power that goes into the springs, W; the rest of what the joints deliver to the stops is lost.
    pub fn spring_power(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> f64 {
        (0..4)
            .map(|i| self.stiffness[i] * self.depth(q, i) * qd[i])
            .sum()
    }

    /// How far joint `i` is beyond a limit: positive beyond the upper, negative beyond the lower, otherwise 0.
    fn depth(&self, q: &Vector4<f64>, i: usize) -> f64 {
        (q[i] - self.upper[i]).max(0.0) + (q[i] - self.lower[i]).min(0.0)
    }
}
