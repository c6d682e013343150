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
use crate::kinematics;
use crate::math::wrap;

/// Joint torques.
pub fn torque(
    situation: &Situation<'_>,
    gains: &Gains,
    compensation: Compensation,
    memory: &mut Memory,
) -> Vector4<f32> {
    let jacobian = Jacobian::new(&situation.arm.geometry, situation.trig);
    let error = pose_error(situation);
    let mut pull = jacobian.task_velocity(&situation.velocity_error()) * gains.derivative()
        + error * gains.proportional();
    if compensation == Compensation::Integral {
        pull += memory.integrate(&error, situation) * gains.integral();
    }
    // mu_d'' = J qdd_d + J'(q, qd_d) qd_d: the part J qdd_d passes through J^-1 unchanged, so only
    // the difference of the two rate products has to be mapped.
    let rates = jacobian.bias(&situation.ahead.qd) - jacobian.bias(&situation.velocity_ahead());
    let acceleration = situation.ahead.qdd + jacobian.joint_speed_damped(&(pull + rates));
    computed_torque::realise(situation, &acceleration, gains, compensation, memory)
}

/// Tool pose error mu_d - mu: m, m, m, rad (wrapped).
pub(super) fn pose_error(situation: &Situation<'_>) -> Vector4<f32> {
    let geometry = &situation.arm.geometry;
    let desired = kinematics::forward(geometry, &situation.reference.q);
    let actual = kinematics::forward_with(geometry, situation.trig, &situation.q);
    Vector4::new(
        desired.x - actual.x,
        desired.y - actual.y,
        desired.z - actual.z,
        wrap(desired.yaw - actual.yaw),
    )
}
