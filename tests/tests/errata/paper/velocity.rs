//! Eq. 30-39: velocity propagation, as recursion and as the closed forms printed for this arm.

use nalgebra::{Vector3, Vector4};

use super::kinematics::{eq_2, table_1};
use crate::arm::{Arm, Twist, rotation, translation};

/// Eq. 30-33 run literally over the frames of Table 1: the velocities of frames 1..4, each in its own axes.
///
/// Revolute joints: `w' = R w + thd z'` (30) and `v' = R (v + w x P)` (32). Prismatic: `w' = R w` (31) and
/// `v' = R (v + w x P + dd z)` (33). R turns frame i into frame i+1, P is the origin of frame i+1 in frame i.
pub(crate) fn eq_30_to_33(arm: &Arm, q: &Vector4<f64>, qd: &Vector4<f64>) -> [Twist; 4] {
    let rows = table_1(arm, q);
    let mut last = Twist::default();
    std::array::from_fn(|i| {
        let link = eq_2(&rows[i]);
        let r = rotation(&link).transpose();
        let p = translation(&link);
        let rate = Vector3::z() * qd[i];
        let carried = last.linear + last.angular.cross(&p);
        last = if i == 2 {
            Twist {
                angular: r * last.angular,
                linear: r * (carried + rate),
            }
        } else {
            Twist {
                angular: r * last.angular + rate,
                linear: r * carried,
            }
        };
        last
    })
}

/// Eq. 34, 35: the linear velocities of the frames, each in its own axes.
pub(crate) fn eq_34_35(arm: &Arm, q: &Vector4<f64>, qd: &Vector4<f64>) -> [Vector3<f64>; 4] {
    let (s4, c4) = q.w.sin_cos();
    let v = -arm.a2 * qd.x;
    [
        Vector3::zeros(),
        Vector3::new(0.0, v, 0.0),
        Vector3::new(0.0, v, qd.z),
        Vector3::new(v * s4, v * c4, qd.z),
    ]
}

/// Eq. 36, 37: the angular velocities of the frames, each in its own axes.
pub(crate) fn eq_36_37(qd: &Vector4<f64>) -> [Vector3<f64>; 4] {
    [qd.x, qd.y - qd.x, qd.y - qd.x, qd.y - qd.x].map(|rate| Vector3::z() * rate)
}

/// Eq. 38: the angular velocity of the flange in the base frame.
pub(crate) fn eq_38(qd: &Vector4<f64>) -> Vector3<f64> {
    Vector3::z() * (qd.x - qd.y)
}

/// Eq. 39: the linear velocity of the flange in the base frame.
pub(crate) fn eq_39(arm: &Arm, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vector3<f64> {
    let (s12, c12) = (q.x + q.y).sin_cos();
    Vector3::new(-arm.a2 * qd.x * s12, -arm.a2 * qd.x * c12, -qd.z)
}
