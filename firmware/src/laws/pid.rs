//! PID, one axis by itself. The paper names it and gives no law; this is the textbook form
//! (Siciliano et al., *Robotics*, 2009, section 8.3) with clamping anti-windup.

use nalgebra::Vector4;

use super::{Gains, Memory, Situation};

/// Joint torques: nominal inertia times (Kp e + Ki integral e + Kd e').
pub fn torque(situation: &Situation<'_>, gains: &Gains, memory: &mut Memory) -> Vector4<f32> {
    let error = situation.position_error();
    let integral = memory.integrate(&error, situation);
    let acceleration = error * gains.proportional()
        + situation.velocity_error() * gains.derivative()
        + integral * gains.integral();
    situation.body.nominal_inertia.component_mul(&acceleration)
}
