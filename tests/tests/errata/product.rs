//! The controller's side of every comparison: its functions converted to f64, and their errors due to f32.
//!
//! u is the unit roundoff of f32, 2^-24. The bounds count roundings to first order (Higham 2002, chapter 3) on top of the
//! errors that the controller documents for its own functions. They are for states inside the joint limits, whose angles
//! sum to at most 2.6 + 2.5 + 7.0 = 12.1 rad, so rounding the inputs to f32 turns the arm by up to 12.1 u.

use firmware::mechanics::arm::{ArmModel, Axis, Geometry, IRB_930, Payload};
use firmware::mechanics::dynamics::drive::Drive;
use firmware::mechanics::dynamics::lagrange::Lagrange;
use firmware::mechanics::dynamics::newton_euler;
use firmware::mechanics::jacobian::Jacobian;
use firmware::mechanics::kinematics::{self, Pose, Trig};
pub(crate) use firmware::mechanics::kinematics::{Elbow, IkError};
use firmware::mechanics::velocity::propagate;
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};
use tests::{Row, Table};

use crate::arm::{Arm, Link, State, Twist, U32, bound_over, largest};

const GEOMETRY: &Geometry = &IRB_930.geometry;

/// Error of an angle of the flange (rad) and of an element of a rotation: 12.1 u of the inputs, 9.1 u of the sine of a sum
/// of angles, 17.2 u of summing the angles of the yaw or 8 u of products, 6.3 u of wrapping.
pub(crate) const ANGLE_BOUND: f64 = 48.0 * U32;

/// Error of a coordinate of the flange or an element of the Jacobian (m): angle errors as above, times the reach.
pub(crate) fn position_bound(arm: &Arm) -> f64 {
    ANGLE_BOUND * (arm.a1 + arm.a2)
}

/// Relative error of an element of the mass matrix without angles: rounded constants and their sums.
pub(crate) const MASS_ROUNDINGS: f64 = 8.0 * U32;

/// Rounding of the recursive Newton-Euler algorithm, as a fraction of the sum of magnitudes in it: 15 u for inputs; for
/// each of four frames 6 u to transform a vector outwards, 6 u for the acceleration of the next origin, and 10 u to
/// transform force and moment back and add them up; and 6 u for the inertial force of a link.
pub(crate) const RECURSION_ROUNDINGS: f64 = 128.0 * U32;

fn f32s(v: &Vector4<f64>) -> Vector4<f32> {
    v.cast()
}

fn trig(q: &Vector4<f64>) -> Trig {
    Trig::new(&f32s(q))
}

fn jacobian_at(q: &Vector4<f64>) -> Jacobian {
    Jacobian::new(GEOMETRY, &trig(q))
}

/// Upper joint limits.
pub(crate) fn upper_limit() -> Vector4<f64> {
    IRB_930.limits.upper.cast()
}

/// x, y, z, yaw of the flange.
pub(crate) fn forward(q: &Vector4<f64>) -> Vector4<f64> {
    let Pose { x, y, z, yaw } = kinematics::forward(GEOMETRY, &f32s(q));
    Vector4::new(x, y, z, yaw).cast()
}

/// Orientation of the flange.
pub(crate) fn rotation(q: &Vector4<f64>) -> Matrix3<f64> {
    kinematics::rotation(&trig(q)).cast()
}

/// The target x, y, z, yaw of a row of `ik.csv`.
pub(crate) fn pose(row: &Row) -> Vector4<f64> {
    Vector4::from(["x", "y", "z", "yaw"].map(|column| row.f64(column)))
}

fn to_pose(pose: &Vector4<f64>) -> Pose {
    let [[x, y, z, yaw]] = f32s(pose).data.0;
    Pose { x, y, z, yaw }
}

/// Inverse kinematics by geometry alone, of a row that has a solution.
pub(crate) fn solve(row: &Row, elbow: Elbow) -> Vector4<f64> {
    kinematics::solve(GEOMETRY, &to_pose(&pose(row)), elbow)
        .unwrap_or_else(|e| panic!("{row}: {e}"))
        .cast()
}

/// Inverse kinematics within the joint limits.
pub(crate) fn inverse(
    pose: &Vector4<f64>,
    elbow: Elbow,
    near: &Vector4<f64>,
) -> Result<Vector4<f64>, IkError> {
    kinematics::inverse(&IRB_930, &to_pose(pose), elbow, &f32s(near)).map(|q| q.cast())
}

/// Whether a refusal names the `reason` of `ik.csv`.
pub(crate) fn reason_fits(refusal: &IkError, reason: &str) -> bool {
    let expected = match reason {
        "too_far" => return matches!(refusal, IkError::TooFar { .. }),
        "inside_hole" => return matches!(refusal, IkError::TooNear { .. }),
        "joint1_limit" => Axis::Shoulder,
        "joint2_limit" => Axis::Elbow,
        "z_high" | "z_low" => Axis::Lift,
        other => panic!("ik.csv has an unknown reason {other}"),
    };
    matches!(refusal, IkError::Limit { axis, .. } if *axis == expected)
}

/// Error of theta1 and theta2 (rad) for the target of a row. Its radius r is known to 8 u of the reach (rounded target,
/// hypot, rounded lengths), which theta2 multiplies by r / det J and theta1 by as much again times
/// a2 (a1 + a2) / r^2; four arc tangents and sums add 4 u of pi each.
pub(crate) fn ik_bound(arm: &Arm, row: &Row) -> f64 {
    let reach = arm.a1 + arm.a2;
    let r = pose(row).xy().norm();
    let theta2 = r * 8.0 * U32 * reach / row.f64("detJ_a").abs();
    theta2 * (1.0 + arm.a2 * reach / (r * r)) + 16.0 * std::f64::consts::PI * U32
}

/// The 6x4 Jacobian.
pub(crate) fn jacobian(q: &Vector4<f64>) -> SMatrix<f64, 6, 4> {
    jacobian_at(q).geometric().cast()
}

/// Determinant of the task Jacobian.
pub(crate) fn determinant(q: &Vector4<f64>) -> f64 {
    jacobian_at(q).determinant().into()
}

/// Inverse of the 4x4 task Jacobian.
pub(crate) fn task_inverse(q: &Vector4<f64>) -> Matrix4<f64> {
    let inverse = jacobian_at(q).inverse();
    inverse.expect("a state off the singularity").cast()
}

/// Joint speeds for a task velocity, damped near the singularity.
pub(crate) fn joint_speed_damped(q: &Vector4<f64>, v: &Vector4<f64>) -> Vector4<f64> {
    jacobian_at(q).joint_speed_damped(&f32s(v)).cast()
}

/// Error of J times the inverse: an element of the inverse is at most reach / det; its numerator is off by as much as a
/// coordinate, and 1 / sin theta2 by 8 u / sin theta2 of itself. Three such elements make one of the product.
pub(crate) fn inverse_jacobian_bound(arm: &Arm, q: &Vector4<f64>) -> f64 {
    let reach = arm.a1 + arm.a2;
    let s2 = q.y.sin().abs();
    let element = reach / (arm.a1 * arm.a2 * s2) * (ANGLE_BOUND + 8.0 * U32 / s2);
    3.0 * reach * element
}

/// Task acceleration J' qd at zero joint acceleration.
pub(crate) fn rate_product(q: &Vector4<f64>, qd: &Vector4<f64>) -> Vector4<f64> {
    jacobian_at(q).bias(&f32s(qd)).cast()
}

/// An angle brought into (-pi, pi].
pub(crate) fn wrap(angle: f64) -> f64 {
    firmware::mechanics::math::wrap(angle as f32).into()
}

/// Velocities of frames 1 to 4 in their own axes.
pub(crate) fn link_velocities(q: &Vector4<f64>, qd: &Vector4<f64>) -> [Twist; 4] {
    let frames = kinematics::link_frames(GEOMETRY, &trig(q), q.z as f32);
    propagate(&frames, &f32s(qd)).map(|v| Twist {
        angular: v.angular.cast(),
        linear: v.linear.cast(),
    })
}

/// Linear and angular velocity of the flange in the base frame, by the Jacobian.
pub(crate) fn flange_velocity(q: &Vector4<f64>, qd: &Vector4<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let v: Vector4<f64> = jacobian_at(q).task_velocity(&f32s(qd)).cast();
    (v.xyz(), Vector3::z() * v.w)
}

/// The payload of the `payload` column of the dynamics tables.
pub(crate) fn payload(label: &str) -> Payload {
    match label {
        "none" => Payload::NONE,
        "p10" => Payload {
            mass: 10.0,
            com: Vector3::new(0.0, 0.0, 0.08),
            inertia: Vector3::new(1.0 / 30.0, 1.0 / 30.0, 0.05),
        },
        other => panic!("no payload {other}"),
    }
}

/// The closed-form dynamics of the arm with a payload.
pub(crate) struct Dynamics(Lagrange);

impl Dynamics {
    /// The arm with the payload of a table.
    pub(crate) fn new(label: &str) -> Self {
        Self(Lagrange::new(&IRB_930, &payload(label)))
    }

    /// The bare arm under another gravity.
    pub(crate) fn with_gravity(gravity: f64) -> Self {
        let arm = ArmModel {
            gravity: gravity as f32,
            ..IRB_930
        };
        Self(Lagrange::new(&arm, &Payload::NONE))
    }

    /// The bare arm with both arm lengths multiplied.
    pub(crate) fn stretched(factor: f32) -> Self {
        let geometry = Geometry {
            a1: factor * GEOMETRY.a1,
            a2: factor * GEOMETRY.a2,
            ..*GEOMETRY
        };
        let arm = ArmModel {
            geometry,
            ..IRB_930
        };
        Self(Lagrange::new(&arm, &Payload::NONE))
    }

    /// M(q).
    pub(crate) fn mass_matrix(&self, q: &Vector4<f64>) -> Matrix4<f64> {
        self.0.mass_matrix(&trig(q)).cast()
    }

    /// C(q, qd) qd.
    pub(crate) fn bias(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vector4<f64> {
        self.0.bias(&trig(q), &f32s(qd)).cast()
    }

    /// g.
    pub(crate) fn gravity(&self) -> Vector4<f64> {
        self.0.gravity().cast()
    }

    /// M qdd + C qd + g.
    pub(crate) fn inverse(&self, state: &State) -> Vector4<f64> {
        let State { q, qd, qdd } = state;
        self.0.inverse(&trig(q), &f32s(qd), &f32s(qdd)).cast()
    }
}

/// M qdd + C qd + g by recursive Newton-Euler.
pub(crate) fn newton_euler(label: &str, state: &State) -> Vector4<f64> {
    let State { q, qd, qdd } = state;
    newton_euler::inverse(&IRB_930, &payload(label), &f32s(q), &f32s(qd), &f32s(qdd)).cast()
}

/// Inertia of arm 1, arm 2 and tool about their axes with their loads, and the coupling of the two arms (kg m^2):
/// `A`, `B`, `G` and `h` of an arm whose shaft and payload are balanced about axis 4.
fn lumps(arm: &Arm) -> [f64; 4] {
    let [arm1, arm2, carriage, shaft] = &arm.links;
    let lifted = arm.lifted_mass();
    let izz = |link: &Link| link.inertia[(2, 2)];
    [
        izz(arm1) + arm1.mass * arm.lc[0].powi(2) + (arm2.mass + lifted) * arm.a1.powi(2),
        izz(arm2) + arm2.mass * arm.lc[1].powi(2) + izz(carriage) + lifted * arm.a2.powi(2),
        izz(shaft),
        arm.a1 * (arm2.mass * arm.lc[1] + lifted * arm.a2),
    ]
}

/// The equations of motion with every term replaced by its magnitude, sine and cosine by 1.
fn magnitudes(arm: &Arm, state: &State) -> Vector4<f64> {
    let [a, b, g, h] = lumps(arm);
    let (qd, qdd) = (state.qd.abs(), state.qdd.abs());
    let (w1, w2) = (qd.x, qd.x + qd.y);
    let (e1, e2) = (qdd.x, qdd.x + qdd.y);
    let f1 = a * e1 + h * e2 + h * w2 * w2;
    let f2 = h * e1 + b * e2 + h * w1 * w1;
    let f4 = g * (e2 + qdd.w);
    let lifted = arm.lifted_mass();
    Vector4::new(f1 + f2 + f4, f2 + f4, lifted * (qdd.z + arm.g), f4)
}

/// Error of the closed-form torques: 32 u of the magnitudes as documented by the controller for exact
/// inputs, 9.5 u for angles of up to 2.5 + 7.0 rad rounded, 3 u for rounded rates and accelerations.
pub(crate) fn torque_bounds(arm: &Arm, state: &State) -> Vector4<f64> {
    magnitudes(arm, state) * (48.0 * U32)
}

/// The largest of the four.
pub(crate) fn torque_bound(arm: &Arm, state: &State) -> f64 {
    largest(&torque_bounds(arm, state))
}

/// The same, largest over the rows with one payload.
pub(crate) fn torque_bound_over(arm: &Arm, table: &Table, label: &str) -> f64 {
    let rows = table.rows_where("payload", label);
    bound_over(rows, |row| torque_bound(arm, &State::of(&row)))
}

/// The same for the wrist alone, largest over the rows with one payload.
pub(crate) fn wrist_bound(arm: &Arm, table: &Table, label: &str) -> f64 {
    let rows = table.rows_where("payload", label);
    48.0 * U32 * bound_over(rows, |row| magnitudes(arm, &State::of(&row)).w)
}

/// Sum of magnitudes in the Newton-Euler recursion: for every link its inertial force times the whole lever back to the
/// base, with distances added where the recursion goes out to the far end of a link and back to its centre of mass.
pub(crate) fn recursion_scale(arm: &Arm, state: &State) -> f64 {
    let (qd, qdd) = (state.qd.abs(), state.qdd.abs());
    let turning = |joints: usize| {
        let (w, alpha) = if joints == 1 {
            (qd.x, qdd.x)
        } else {
            (qd.x + qd.y, qdd.x + qdd.y)
        };
        (alpha + w * w, alpha)
    };
    let ends = [arm.a1, arm.a1 + arm.a2, arm.a1 + arm.a2, arm.a1 + arm.a2];
    let mut sum = 0.0;
    for (i, (link, end)) in arm.links.iter().zip(ends).enumerate() {
        let (centripetal, mut alpha) = turning(i + 1);
        if i == 3 {
            alpha += qdd.w;
        }
        let lever = end + link.com.xy().norm();
        let force = link.mass * (lever * centripetal + qdd.z + arm.g);
        sum += force * (1.0 + lever) + link.inertia[(2, 2)] * alpha;
    }
    sum
}

/// Contribution of rotors and friction to the joint efforts.
pub(crate) fn drive_efforts(state: &State) -> Vector4<f64> {
    let drive = Drive::new(&IRB_930.drive);
    let efforts = drive.rotor_inertia() * f32s(&state.qdd) + drive.friction(&f32s(&state.qd));
    efforts.cast()
}

/// Error of those: 8 u of inertial and viscous efforts, and the 4e-7 of the controller's tanh of Coulomb friction.
pub(crate) fn drive_bound(state: &State) -> f64 {
    let drive = Drive::new(&IRB_930.drive);
    let inertia: Matrix4<f64> = drive.rotor_inertia().cast();
    let viscous: Vector4<f64> = IRB_930.drive.viscous.cast();
    let coulomb: Vector4<f64> = IRB_930.drive.coulomb.cast();
    let smooth = inertia * state.qdd.abs() + viscous.component_mul(&state.qd.abs());
    largest(&(smooth * (8.0 * U32) + coulomb * 4e-7))
}
