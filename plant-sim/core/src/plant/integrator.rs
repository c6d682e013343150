//! One step in time of `M(q) qdd = effort(q, qd)` with stiff friction.
//!
//! Coulomb friction that builds up over 0.001 m/s on a 10 kg lift is a damper of 2000 1/s, and a model file may
//! have far more, so with an explicit method the robot's friction would dictate the step. The step here is linearly
//! implicit in the friction alone: ROS34PW2 of Rang and Angermann (BIT 45, 2005), four stages, order 3, L-stable. It is
//! a W-method: it keeps its order with any approximate Jacobian, which allows two simplifications.
//!
//! * Only the joint damping D enters the Jacobian: `-M^-1 D` in the velocity block, zero elsewhere.
//! * D is the secant of the friction law, friction / speed, not its tangent. The tangent vanishes at speed; a step
//!   that crosses zero would then overshoot, turn, and chatter without end. The secant of a saturating law is never
//!   below its tangent, and with at least 0.8 times the true Jacobian the method is damped at any step size.
//!
//! With D = 0 this is an explicit Runge-Kutta method of order 3.

use super::factor::Factor;
use nalgebra::{Matrix4, SVector, Vector4};

/// Diagonal coefficient.
const GAMMA: f64 = 0.435_866_521_508_459;
/// Nodes of the stages.
const ALPHA: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [0.871_733_043_016_918, 0.0, 0.0],
    [0.844_570_600_153_694_2, -0.112_990_642_364_841_85, 0.0],
    [0.0, 0.0, 1.0],
];
/// Coefficients of the Jacobian times earlier stages.
const GAMMAS: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [-0.871_733_043_016_918, 0.0, 0.0],
    [-0.903_380_570_130_440_8, 0.054_180_672_388_095_326, 0.0],
    [
        0.242_123_807_060_953_46,
        -1.223_250_583_904_514_7,
        0.545_260_255_335_102_1,
    ],
];
/// Weights of the stages.
const WEIGHTS: [f64; 4] = [
    0.242_123_807_060_953_46,
    -1.223_250_583_904_514_7,
    1.545_260_255_335_102,
    GAMMA,
];

/// Speed below which an axis stands, rad/s and m/s: in the age of the universe it would move by less than the last place of
/// its position. Friction alone would slow it down for ever, and processors are slow with the smallest numbers.
const LEAST_SPEED: f64 = 1e-40;

/// Rates of the quantities integrated along with the motion: four motor torques, motor power, lost power.
pub(super) type Rates = SVector<f64, 6>;

/// Effect of a state on the joints.
pub(super) struct Slope {
    /// Mass matrix at the beginning of the step, times the acceleration.
    pub(super) force: Vector4<f64>,
    /// Rates of the quantities integrated along.
    pub(super) rates: Rates,
}

/// Advances `q` and `qd` by `h` seconds and returns the integrals of the rates.
///
/// `mass`, `damping` and `first` are those at the beginning of the step; `slope` is called for the later stages.
pub(super) fn step(
    q: &mut Vector4<f64>,
    qd: &mut Vector4<f64>,
    h: f64,
    mass: &Matrix4<f64>,
    damping: &Vector4<f64>,
    first: Slope,
    slope: impl Fn(&Vector4<f64>, &Vector4<f64>) -> Slope,
) -> Rates {
    let implicit = Factor::of(&(mass + Matrix4::from_diagonal(&(damping * (GAMMA * h)))));
    let (mut dq, mut dqd) = ([Vector4::zeros(); 4], [Vector4::zeros(); 4]);
    dq[0] = *qd * h;
    dqd[0] = implicit.solve(&(first.force * h));
    let mut integral = first.rates * (h * WEIGHTS[0]);
    for i in 1..4 {
        let (mut at, mut speed, mut carried) = (*q, *qd, Vector4::zeros());
        for j in 0..i {
            at += dq[j] * ALPHA[i][j];
            speed += dqd[j] * ALPHA[i][j];
            carried += dqd[j] * GAMMAS[i][j];
        }
        let Slope { force, rates } = slope(&at, &speed);
        dq[i] = speed * h;
        dqd[i] = implicit.solve(&((force - damping.component_mul(&carried)) * h));
        integral += rates * (h * WEIGHTS[i]);
    }
    for i in 0..4 {
        *q += dq[i] * WEIGHTS[i];
        *qd += dqd[i] * WEIGHTS[i];
    }
    let stands = |speed: f64| speed.abs() < LEAST_SPEED;
    *qd = qd.map(|speed| if stands(speed) { 0.0 } else { speed });
    integral
}

/// Step (ns) that settles a loaded axis on its friction law within a few steps.
///
/// The integrator is stable at any stiffness, but where friction builds up over less than a thirtieth of the speed
/// that it can remove in one step, a loaded axis oscillates about rest with a fraction of that speed. Friction so steep
/// that steps of 10 us do not suffice is left to oscillate by some 0.01 mm/s.
pub(super) fn resolvable_step(mass: &Matrix4<f64>, damping_at_rest: &Vector4<f64>) -> u64 {
    let factor = Factor::of(mass);
    let response = Vector4::from_fn(|i, _| factor.solve(&Vector4::ith(i, 1.0))[i]);
    (30e9 / response.component_mul(damping_at_rest).max()) as u64
}
