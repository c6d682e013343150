//! Kinematic control in joint space: qd = qd_d + lambda (q_d - q).
//!
//! The paper prints `lambda q''` for `lambda q~`: an unstable equation without position feedback.

use nalgebra::Vector4;

use super::{ControlInput, Gains, Memory, Motion, velocity_loop};

/// Joint torques of the velocity loop that follows the law's velocities.
pub fn torque(input: &ControlInput<'_>, gains: &Gains, memory: &mut Memory) -> Vector4<f32> {
    velocity_loop::torque(&velocity(input.motion, gains), input, gains, memory)
}

/// Joint velocities that the law asks for.
pub(super) fn velocity(motion: &Motion<'_>, gains: &Gains) -> Vector4<f32> {
    motion.mean_qd() + motion.error * velocity_loop::outer_gain(gains)
}
