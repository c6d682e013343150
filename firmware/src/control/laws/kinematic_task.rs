//! Kinematic control in task space: qd = J^-1 (mu_d' + r (mu_d - mu)), mu = (x, y, z, yaw).
//!
//! The paper prints `r mu''` for `r mu~` and inverts a 6x4 matrix; here J is the 4x4 task
//! Jacobian, its inverse is damped near the stretched elbow, and the yaw error is wrapped.

use nalgebra::Vector4;

use super::{ControlInput, Gains, Memory, velocity_loop};

/// Joint torques of the velocity loop that follows the law's velocities.
pub fn torque(input: &ControlInput<'_>, gains: &Gains, memory: &mut Memory) -> Vector4<f32> {
    let task = input.task;
    let velocity = task.desired.task_velocity(&input.motion.mean_qd)
        + task.position * velocity_loop::outer_gain(gains);
    let command = task.actual.joint_speed_damped(&velocity);
    velocity_loop::torque(&command, input, gains, memory)
}
