//! Eq. 1-29: forward and inverse kinematics, Jacobian, singularities.

use nalgebra::{Matrix3, Matrix4, SMatrix, Vector2, Vector3, Vector4};

use crate::arm::Arm;

/// One row of Table 1: `a`, `alpha`, `d`, `theta` (m, rad).
#[derive(Clone, Copy)]
pub(crate) struct DhRow {
    pub a: f64,
    pub alpha: f64,
    pub d: f64,
    pub theta: f64,
}

/// Table 1.
pub(crate) fn table_1(arm: &Arm, q: &Vector4<f64>) -> [DhRow; 4] {
    let row = |a, alpha: f64, d, theta| DhRow {
        a,
        alpha: alpha.to_radians(),
        d,
        theta,
    };
    [
        row(arm.a1, 0.0, 0.0, q.x),
        row(arm.a2, 180.0, 0.0, q.y),
        row(0.0, 0.0, q.z, 0.0),
        row(0.0, 0.0, arm.d4, q.w),
    ]
}

/// Eq. 2, the link transform of standard (distal) Denavit-Hartenberg.
pub(crate) fn eq_2(row: &DhRow) -> Matrix4<f64> {
    let (s, c) = row.theta.sin_cos();
    let (sa, ca) = row.alpha.sin_cos();
    Matrix4::new(
        c,
        -s * ca,
        s * sa,
        row.a * c,
        s,
        c * ca,
        -c * sa,
        row.a * s,
        0.0,
        sa,
        ca,
        row.d,
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

/// The link transform according to the sentence before eq. 1: twist `alpha_i` and length `a_i` about and along
/// `x_{i-1}`, then angle and offset about and along z.
pub(crate) fn text_before_eq_1(row: &DhRow) -> Matrix4<f64> {
    let twist = eq_2(&DhRow {
        d: 0.0,
        theta: 0.0,
        ..*row
    });
    let joint = eq_2(&DhRow {
        a: 0.0,
        alpha: 0.0,
        ..*row
    });
    twist * joint
}

/// Eq. 4, T_2^1, with the printed +1 in row 3, column 3.
pub(crate) fn eq_4(arm: &Arm, theta2: f64) -> Matrix4<f64> {
    let (s2, c2) = theta2.sin_cos();
    Matrix4::new(
        c2,
        s2,
        0.0,
        arm.a2 * c2,
        s2,
        -c2,
        0.0,
        arm.a2 * s2,
        0.0,
        0.0,
        1.0,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

/// Eq. 1: the chain of four transforms.
pub(crate) fn eq_1(links: [Matrix4<f64>; 4]) -> Matrix4<f64> {
    links.into_iter().product()
}

/// Eq. 8-19: rotation [n s a] and position o of the flange.
pub(crate) fn eq_8_to_19(arm: &Arm, q: &Vector4<f64>) -> (Matrix3<f64>, Vector3<f64>) {
    let (s1, c1) = q.x.sin_cos();
    let (s12, c12) = (q.x + q.y).sin_cos();
    let (s4, c4) = q.w.sin_cos();
    let rotation = Matrix3::new(
        c12 * c4 + s12 * s4,
        s12 * c4 - c12 * s4,
        0.0,
        s12 * c4 - c12 * s4,
        -s12 * s4 - c12 * c4,
        0.0,
        0.0,
        0.0,
        -1.0,
    );
    let position = Vector3::new(
        arm.a1 * c1 + arm.a2 * c12,
        arm.a1 * s1 + arm.a2 * s12,
        -q.z - arm.d4,
    );
    (rotation, position)
}

/// `atan2` with the arguments in the order of programming languages: `atan2(first, second)` of the paper typed
/// literally, so the first is the sine side.
pub(crate) fn atan2_typed(first: f64, second: f64) -> f64 {
    first.atan2(second)
}

/// `atan2` with the arguments as meant by the paper (after Spong): cosine side first.
pub(crate) fn atan2_meant(first: f64, second: f64) -> f64 {
    second.atan2(first)
}

/// A reading of the paper's `a tan 2`.
pub(crate) type Atan2 = fn(f64, f64) -> f64;

/// Inverse kinematics: the yaw `alpha = atan2(r11, r12)`.
pub(crate) fn ik_alpha(rotation: &Matrix3<f64>, atan2: Atan2) -> f64 {
    atan2(rotation[(0, 0)], rotation[(0, 1)])
}

/// Inverse kinematics: `c2 = (ox^2 + oy^2 - a1^2 - a2^2) / (2 a1 a2)`.
pub(crate) fn ik_c2(arm: &Arm, o: &Vector2<f64>) -> f64 {
    (o.norm_squared() - arm.a1.powi(2) - arm.a2.powi(2)) / (2.0 * arm.a1 * arm.a2)
}

/// Inverse kinematics: `theta2 = atan2(c2, +-sqrt(1 - c2))`.
pub(crate) fn ik_theta2(c2: f64, sign: f64, atan2: Atan2) -> f64 {
    atan2(c2, sign * (1.0 - c2).sqrt())
}

/// Inverse kinematics: `theta1 = atan2(ox, oy) - atan2(a1 + a2 c2, a2 s2)`.
pub(crate) fn ik_theta1(arm: &Arm, o: &Vector2<f64>, theta2: f64, atan2: Atan2) -> f64 {
    let (s2, c2) = theta2.sin_cos();
    atan2(o.x, o.y) - atan2(arm.a1 + arm.a2 * c2, arm.a2 * s2)
}

/// Inverse kinematics: `theta4 = theta1 + theta2 - alpha`, without wrapping.
pub(crate) fn ik_theta4(theta1: f64, theta2: f64, alpha: f64) -> f64 {
    theta1 + theta2 - alpha
}

/// Inverse kinematics: `d3 = oz + d4`.
pub(crate) fn ik_d3(arm: &Arm, oz: f64) -> f64 {
    oz + arm.d4
}

/// The origin o_4 listed with eq. 26: z = d3 - d4.
pub(crate) fn eq_26_o4(arm: &Arm, q: &Vector4<f64>) -> Vector3<f64> {
    let (_, o) = eq_8_to_19(arm, q);
    Vector3::new(o.x, o.y, q.z - arm.d4)
}

/// Eq. 24: the Jacobian column of a revolute joint with axis `z` through `origin`, for a flange at `flange`.
pub(crate) fn eq_24(
    z: &Vector3<f64>,
    origin: &Vector3<f64>,
    flange: &Vector3<f64>,
) -> SMatrix<f64, 6, 1> {
    let linear = z.cross(&(flange - origin));
    SMatrix::<f64, 6, 1>::new(linear.x, linear.y, linear.z, z.x, z.y, z.z)
}

/// Eq. 27: the 6x4 Jacobian, rows vx vy vz wx wy wz.
pub(crate) fn eq_27(arm: &Arm, q: &Vector4<f64>) -> SMatrix<f64, 6, 4> {
    let (s1, c1) = q.x.sin_cos();
    let (s12, c12) = (q.x + q.y).sin_cos();
    let (x1, y1) = (arm.a1 * c1, arm.a1 * s1);
    let (x2, y2) = (arm.a2 * c12, arm.a2 * s12);
    SMatrix::from_row_slice(&[
        -y1 - y2,
        -y2,
        0.0,
        0.0, //
        x1 + x2,
        x2,
        0.0,
        0.0, //
        0.0,
        0.0,
        -1.0,
        0.0, //
        0.0,
        0.0,
        0.0,
        0.0, //
        0.0,
        0.0,
        0.0,
        0.0, //
        1.0,
        1.0,
        0.0,
        -1.0,
    ])
}

/// Eq. 29: the block J_11 that is supposed to determine singularities.
pub(crate) fn eq_29(arm: &Arm, q: &Vector4<f64>) -> Matrix3<f64> {
    let (s1, c1) = q.x.sin_cos();
    let (s12, c12) = (q.x + q.y).sin_cos();
    Matrix3::new(
        -arm.a1 * s1 - arm.a2 * s12,
        arm.a1 * c1 + arm.a2 * c12,
        0.0,
        -arm.a1 * s12,
        arm.a1 * c12,
        0.0,
        0.0,
        0.0,
        -1.0,
    )
}

/// The rank condition after eq. 29, `alpha1 alpha4 - alpha2 alpha3`, of four numbers that the paper never defines.
pub(crate) fn rank_condition(alpha: [f64; 4]) -> f64 {
    alpha[0] * alpha[3] - alpha[1] * alpha[2]
}
