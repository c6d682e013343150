//! The control laws: two unnumbered kinematic ones, PD with gravity, eq. 49.

use nalgebra::{Matrix4, Vector4};

/// Kinematic control, joint space: `qd = qd_d + lambda qdd`.
pub(crate) fn kinematic_joint(qd_d: f64, lambda: f64, qdd: f64) -> f64 {
    qd_d + lambda * qdd
}

/// Kinematic control, task space: `qd = J^-1 (mud_d + r mudd)`.
pub(crate) fn kinematic_task(
    j_inverse: &Matrix4<f64>,
    mud_d: &Vector4<f64>,
    r: f64,
    mudd: &Vector4<f64>,
) -> Vector4<f64> {
    j_inverse * (mud_d + mudd * r)
}

/// A state or reference: position and velocity.
pub(crate) type Motion = (Vector4<f64>, Vector4<f64>);

/// Dynamic control, joint space: `tau = kp (q_d - q) + kd (qd_d - qd) + g(q)`.
pub(crate) fn pd_gravity(
    kp: &Matrix4<f64>,
    kd: &Matrix4<f64>,
    (q_d, qd_d): Motion,
    (q, qd): Motion,
    g: &Vector4<f64>,
) -> Vector4<f64> {
    kp * (q_d - q) + kd * (qd_d - qd) + g
}

/// Eq. 49, the bracket: `mudd_d - Jdot(q_d) qd_d + kp (mu_d - mu) + kd (mud_d - mud)`.
pub(crate) fn eq_49_bracket(
    mudd_d: &Vector4<f64>,
    jdot_qd_desired: &Vector4<f64>,
    (kp, kd): (f64, f64),
    (mu_d, mud_d): Motion,
    (mu, mud): Motion,
) -> Vector4<f64> {
    mudd_d - jdot_qd_desired + (mu_d - mu) * kp + (mud_d - mud) * kd
}
