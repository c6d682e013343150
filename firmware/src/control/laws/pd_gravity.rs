//! PD with gravity compensation: tau = Kp (q_d - q) + Kd (qd_d - qd) + g(q).
//!
//! The paper's dynamic control in joint space. Stable at set points (Takegaki & Arimoto, 1981); while tracking, it lags
//! for want of the torque that the motion needs, which [`super::computed_torque`] adds.

use nalgebra::Vector4;

use super::{ControlInput, Gains};

/// Joint torques; the gain matrices are nominal inertias times Kp and Kd.
pub fn torque(input: &ControlInput<'_>, gains: &Gains) -> Vector4<f32> {
    let motion = input.motion;
    let acceleration =
        motion.error * gains.proportional() + motion.velocity_error * gains.derivative();
    input.body.nominal_inertia.component_mul(&acceleration) + input.body.lagrange.gravity()
}
