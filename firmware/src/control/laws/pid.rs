//! PID, each axis by itself. The paper names it and gives no law; this is the textbook form
//! (Siciliano et al., *Robotics*, 2009, section 8.3) with clamping anti-windup.

use nalgebra::Vector4;

use super::{ControlInput, Gains, Memory};

/// Joint torques: nominal inertia times (Kp e + Ki integral e + Kd e').
pub fn torque(input: &ControlInput<'_>, gains: &Gains, memory: &mut Memory) -> Vector4<f32> {
    let motion = input.motion;
    let error = motion.error;
    let integral = memory.integrate(error, motion);
    let acceleration = error * gains.proportional()
        + motion.velocity_error * gains.derivative()
        + integral * gains.integral();
    input.body.nominal_inertia.component_mul(&acceleration)
}
