//! Computed torque in task space, eq 49:
//! tau = M J^-1 [mu_d'' - J' qd + Kp (mu_d - mu) + Kd (mu_d' - mu')] + V + g, mu = (x, y, z, yaw).
//!
//! The paper prints J'(q_d) qd_d, which leaves up to 20 m/s² uncancelled off the path, and a 6x4
//! Jacobian; here J' qd is that of the measured motion and J the 4x4 task Jacobian. Near the stretched elbow its inverse
//! is damped, and joint space fills in what the damping leaves out.

use nalgebra::Vector4;
use protocol::messages::Compensation;

use super::{ControlInput, Gains, Memory, Output, Task, computed_torque};
use crate::mechanics::kinematics::Trig;

/// Joint torques.
pub fn torque(
    input: &ControlInput<'_>,
    (trig, model): (&Trig, &Output),
    gains: &Gains,
    compensation: Compensation,
    memory: &mut Memory,
) -> Vector4<f32> {
    let motion = input.motion;
    let ahead = &motion.setpoint.ahead;
    let task = Task::new(input, trig);
    let mut pull = task.velocity * gains.derivative() + task.position * gains.proportional();
    if compensation == Compensation::Integral {
        pull += memory.integrate(&task.position, motion) * gains.integral();
    }
    let desired = task.desired.task_velocity(&ahead.qdd) + task.desired.bias(&ahead.qd);
    let carried = task.actual.bias(&motion.qd_ahead);
    let acceleration = task.joint_space(&(desired - carried + pull), || {
        computed_torque::acceleration(motion, gains)
    });
    computed_torque::realise(input, model, &acceleration)
}
