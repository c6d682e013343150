//! Computed torque in task space, eq 49:
//! tau = M J^-1 [mu_d'' - J' qd + Kp (mu_d - mu) + Kd (mu_d' - mu')] + V + g, mu = (x, y, z, yaw).
//!
//! The paper prints J'(q_d) qd_d, which leaves up to 20 m/s² uncancelled off the path, and a 6x4
//! Jacobian; here J' qd is that of the measured motion and J the 4x4 task Jacobian, inverted with
//! damping near the stretched elbow.

use nalgebra::Vector4;
use protocol::messages::Compensation;

use super::{Gains, Memory, Situation, computed_torque};
use crate::jacobian::Jacobian;
use crate::kinematics::{self, Trig};
use crate::math::wrap;

/// Joint torques.
pub fn torque(
    situation: &Situation<'_>,
    gains: &Gains,
    compensation: Compensation,
    memory: &mut Memory,
) -> Vector4<f32> {
    let task = TaskError::new(situation);
    let mut pull = task.velocity * gains.derivative() + task.position * gains.proportional();
    if compensation == Compensation::Integral {
        pull += memory.integrate(&task.position, situation) * gains.integral();
    }
    let ahead = &situation.ahead;
    let desired = task.desired.task_velocity(&ahead.qdd) + task.desired.bias(&ahead.qd);
    let carried = task.actual.bias(&situation.velocity_ahead());
    let acceleration = task.actual.joint_speed_damped(&(desired - carried + pull));
    computed_torque::realise(situation, &acceleration, gains, compensation, memory)
}

/// Where the tool is not, and how fast it does not move.
pub(super) struct TaskError {
    /// Jacobian at the reference.
    pub(super) desired: Jacobian,
    /// Jacobian at the measured position.
    pub(super) actual: Jacobian,
    /// mu_d - mu: m, m, m, rad (wrapped).
    pub(super) position: Vector4<f32>,
    /// mu_d' - mu', means over the last sample.
    pub(super) velocity: Vector4<f32>,
}

impl TaskError {
    pub(super) fn new(situation: &Situation<'_>) -> Self {
        let geometry = &situation.arm.geometry;
        let q_desired = &situation.reference.q;
        let trig_desired = Trig::new(q_desired);
        let mu_desired = kinematics::forward_with(geometry, &trig_desired, q_desired);
        let mu = kinematics::forward_with(geometry, situation.trig, &situation.q);
        let desired = Jacobian::new(geometry, &trig_desired);
        let actual = Jacobian::new(geometry, situation.trig);
        Self {
            position: Vector4::new(
                mu_desired.x - mu.x,
                mu_desired.y - mu.y,
                mu_desired.z - mu.z,
                wrap(mu_desired.yaw - mu.yaw),
            ),
            velocity: desired.task_velocity(&situation.mean_qd)
                - actual.task_velocity(&situation.qd),
            desired,
            actual,
        }
    }
}
