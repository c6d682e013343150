//! Kinematic control in task space: qd = J^-1 (mu_d' + r (mu_d - mu)), mu = (x, y, z, yaw).
//!
//! The paper prints `r mu''` for `r mu~` and inverts a 6x4 matrix; here J is the 4x4 task
//! Jacobian, and the yaw error is wrapped. Near the stretched elbow its inverse is damped, and joint space fills in what the
//! damping leaves out.

use nalgebra::Vector4;

use super::{ControlInput, Gains, Memory, Task, kinematic_joint, velocity_loop};
use crate::mechanics::kinematics::Trig;

/// Joint torques of the velocity loop that follows the law's velocities.
pub fn torque(
    input: &ControlInput<'_>,
    trig: &Trig,
    gains: &Gains,
    memory: &mut Memory,
) -> Vector4<f32> {
    let task = Task::new(input, trig);
    let velocity = task.desired.task_velocity(&input.motion.mean_qd())
        + task.position * velocity_loop::outer_gain(gains);
    let command = task.joint_space(&velocity, || kinematic_joint::velocity(input.motion, gains));
    velocity_loop::torque(&command, input, gains, memory)
}
