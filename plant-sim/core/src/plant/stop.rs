//! End stops: a one-sided spring with a damper at each joint limit.

use std::f64::consts::TAU;

use crate::maths::square;
use crate::model::{JointLimits, RobotModel};
use nalgebra::Vector4;

use super::arm::Arm;
use super::drive::Drive;
use super::factor::Factor;

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

/// Longest step (ns) that resolves every joint of a robot on its end stops. A short one takes masses that are far out on
/// links that are light themselves.
///
/// A joint whose neighbours may give way meets its stop with the inertia `1 / (M^-1)_ii`, below that of the stretched arm by
/// a factor r. There its motion decays with `2 D r RATE` 1/s at most, and two time constants of it are the limit of an
/// explicit method: a step takes one.
pub fn resolvable_step(model: &RobotModel) -> u64 {
    /// Angles of the elbow, on which alone the mass matrix depends.
    const ANGLES: u32 = 64;
    let (arm, drive) = (Arm::new(model, None), Drive::new(&model.drive));
    let mass = |elbow: f64| {
        arm.mass_matrix(&arm.at(&Vector4::new(0.0, elbow, 0.0, 0.0))) + drive.rotor_inertia()
    };
    let stretched = mass(0.0).diagonal();
    let mut ratio = 1.0f64;
    for k in 0..ANGLES {
        let factor = Factor::of(&mass(TAU * f64::from(k) / f64::from(ANGLES)));
        for i in 0..4 {
            ratio = ratio.max(stretched[i] * factor.solve(&Vector4::ith(i, 1.0))[i]);
        }
    }
    (1e9 / (2.0 * DAMPING_RATIO * RATE * ratio)) as u64
}

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

    /// Efforts that push the joints back inside, and the power (W) that goes into the springs; the rest of what the joints
    /// deliver to the stops is lost.
    pub fn push(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> (Vector4<f64>, f64) {
        if (0..4).all(|i| (self.lower[i]..=self.upper[i]).contains(&q[i])) {
            return (Vector4::zeros(), 0.0);
        }
        (self.effort(q, qd), self.spring_power(q, qd))
    }

    /// A stop never pulls.
    fn effort(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vector4<f64> {
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

    fn spring_power(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> f64 {
        (0..4)
            .map(|i| self.stiffness[i] * self.depth(q, i) * qd[i])
            .sum()
    }

    /// How far joint `i` is beyond a limit: positive beyond the upper, negative beyond the lower, otherwise 0.
    fn depth(&self, q: &Vector4<f64>, i: usize) -> f64 {
        (q[i] - self.upper[i]).max(0.0) + (q[i] - self.lower[i]).min(0.0)
    }
}
