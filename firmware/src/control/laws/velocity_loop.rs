//! The inner loop that kinematic control takes for granted: PI control of joint velocity with gravity compensation.

use nalgebra::Vector4;

use super::{ControlInput, Gains, Memory};

/// Joint torques that make the joints follow the velocities `command` (means over a sample).
///
/// The proportional gain is the derivative gain of the other laws; the integral time is
/// four time constants of the loop, the usual compromise of overshoot and stiffness.
pub(super) fn torque(
    command: &Vector4<f32>,
    input: &ControlInput<'_>,
    gains: &Gains,
    memory: &mut Memory,
) -> Vector4<f32> {
    let gain = gains.derivative();
    let error = command - input.motion.qd;
    let integral = memory.integrate(&error, input.motion);
    let acceleration = error * gain + integral * (0.25 * gain * gain);
    input.body.nominal_inertia.component_mul(&acceleration) + input.body.lagrange.gravity()
}

/// Position gain of a kinematic law around this loop, 1/s: a quarter of the inner bandwidth, so
/// that the inner loop looks instantaneous to the outer one.
pub(super) fn outer_gain(gains: &Gains) -> f32 {
    0.25 * gains.derivative()
}
