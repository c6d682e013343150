//! Computed torque in joint space: tau = M(q)(qdd_d + Kd e' + Kp e) + C qd + g + friction.
//!
//! The tracking form of the paper's dynamic control in joint space, whose M and n the paper lists
//! and does not use. Feed-forward is evaluated for when the command will act, not when the measurement was taken: half
//! a hold and the bus delay later.

use nalgebra::Vector4;
use protocol::messages::Compensation;

use super::{ControlInput, Gains, Memory, Motion, Output};

/// Joint torques.
pub fn torque(
    input: &ControlInput<'_>,
    model: &Output,
    gains: &Gains,
    compensation: Compensation,
    memory: &mut Memory,
) -> Vector4<f32> {
    let motion = input.motion;
    let mut acceleration = acceleration(motion, gains);
    if compensation == Compensation::Integral {
        acceleration += memory.integrate(motion.error, motion) * gains.integral();
    }
    realise(input, model, &acceleration)
}

/// Joint accelerations of the reference, corrected by its errors.
pub(super) fn acceleration(motion: &Motion<'_>, gains: &Gains) -> Vector4<f32> {
    motion.setpoint.ahead.qdd
        + motion.velocity_error * gains.derivative()
        + motion.error * gains.proportional()
}

/// The torques that give the joints `acceleration` against the modelled forces.
#[inline(always)]
pub(super) fn realise(
    input: &ControlInput<'_>,
    model: &Output,
    acceleration: &Vector4<f32>,
) -> Vector4<f32> {
    let ControlInput { motion, body, .. } = input;
    body.frictionless(&model.couplings, &motion.qd_ahead, acceleration) + model.friction
}
