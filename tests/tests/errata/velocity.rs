//! Errata 16 to 21 and 45: velocity propagation.

use nalgebra::{Matrix3, Vector3, Vector4};
use tests::{Row, Table};

use crate::arm::{Arm, Twist, U64, bound_over, largest, rotation, translation, verdict, worst};
use crate::paper::{kinematics, velocity as paper};
use crate::product;

/// Step of the central differences, s.
const STEP: f64 = 1e-6;

/// Pose of frame `i` in the base frame, from the transforms of eq. 2, which agree with Pinocchio (erratum 3).
fn frame(arm: &Arm, q: &Vector4<f64>, i: usize) -> (Matrix3<f64>, Vector3<f64>) {
    let rows = kinematics::table_1(arm, q);
    let t = rows[..=i].iter().map(kinematics::eq_2).product();
    (rotation(&t), translation(&t))
}

/// Velocity of frame `i` in its own axes: the derivative of its pose.
fn differentiated(arm: &Arm, q: &Vector4<f64>, qd: &Vector4<f64>, i: usize) -> Twist {
    let (r, _) = frame(arm, q, i);
    let (r_before, o_before) = frame(arm, &(q - qd * STEP), i);
    let (r_after, o_after) = frame(arm, &(q + qd * STEP), i);
    // The skew matrix R^T Rdot holds the angular velocity in the axes of the frame itself.
    let skew = r.transpose() * (r_after - r_before) / (2.0 * STEP);
    Twist {
        angular: Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]),
        linear: r.transpose() * (o_after - o_before) / (2.0 * STEP),
    }
}

/// Error of the central difference plus that of the controller, for velocities of up to `w` rad/s in sum: the third
/// derivative w^3 times STEP^2 / 6, positions rounded to a few u over STEP, and 32 u of f32.
fn bound(arm: &Arm, w: f64) -> f64 {
    let reach = arm.a1 + arm.a2;
    let difference = w.powi(3) * STEP.powi(2) / 6.0 + 8.0 * U64 / STEP;
    reach * (difference + product::ANGLE_BOUND * w)
}

/// Sum of the joint speeds of the fastest state.
fn fastest(table: &Table) -> f64 {
    bound_over(table.rows(), |row| row.vector::<4>("qd").lp_norm(1))
}

fn angular(row: &Row) -> Vector3<f64> {
    Vector3::new(row.f64("wx"), row.f64("wy"), row.f64("wz"))
}

fn linear(row: &Row) -> Vector3<f64> {
    Vector3::new(row.f64("vx"), row.f64("vy"), row.f64("vz"))
}

#[test]
fn erratum_16_the_joint_turns_about_the_axis_of_the_frame_before() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let w = fastest(&table);
    let errors = worst(table.rows(), |row| {
        let (q, qd) = (row.vector("q"), row.vector("qd"));
        let (r, _) = frame(&arm, &q, 3);
        let printed = paper::eq_30_to_33(&arm, &q, &qd);
        // The recursion explains the closed forms: run literally it gives eq. 36.
        assert!(largest(&(printed[1].angular - paper::eq_36_37(&qd)[1])) <= 8.0 * U64 * w);
        let corrected = product::link_velocities(&q, &qd);
        (
            largest(&(r * printed[3].angular - angular(&row))),
            largest(&(r * corrected[3].angular - angular(&row))),
        )
    });
    // Theory: joint 2 counts with the wrong sign, 2 theta2-dot; the elbow turns at up to 12 rad/s.
    verdict(
        16,
        "angular velocity of the flange, eq. 30",
        "rad/s",
        errors,
        12.0,
        bound(&arm, w),
    );
}

#[test]
fn erratum_17_the_lever_turns_with_the_joint() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let w = fastest(&table);
    let errors = worst(table.rows(), |row| {
        let (q, qd) = (row.vector("q"), row.vector("qd"));
        let (r, _) = frame(&arm, &q, 3);
        let printed = paper::eq_30_to_33(&arm, &q, &qd);
        // And eq. 34, 35.
        for (literal, closed) in printed.iter().zip(paper::eq_34_35(&arm, &q, &qd)) {
            assert!(largest(&(literal.linear - closed)) <= 8.0 * U64 * w);
        }
        let corrected = product::link_velocities(&q, &qd);
        (
            largest(&(r * printed[3].linear - linear(&row))),
            largest(&(r * corrected[3].linear - linear(&row))),
        )
    });
    // Theory: a1 theta1-dot is missing entirely (7.7 rad/s x 0.56 m at full speed), among other things.
    verdict(
        17,
        "linear velocity of the flange, eq. 32, 33",
        "m/s",
        errors,
        2.0,
        bound(&arm, w),
    );
}

#[test]
fn erratum_18_linear_velocities_of_the_frames() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let w = fastest(&table);
    for i in 0..4 {
        let errors = worst(table.rows(), |row| {
            let (q, qd) = (row.vector("q"), row.vector("qd"));
            let expected = differentiated(&arm, &q, &qd, i).linear;
            (
                largest(&(paper::eq_34_35(&arm, &q, &qd)[i] - expected)),
                largest(&(product::link_velocities(&q, &qd)[i].linear - expected)),
            )
        });
        let what = format!("V{0}{0}, eq. {1}", i + 1, if i < 2 { 34 } else { 35 });
        // Theory: as above, a1 theta1-dot is missing from every frame.
        verdict(18, &what, "m/s", errors, 2.0, bound(&arm, w));
    }
}

#[test]
fn erratum_19_angular_velocities_of_the_frames() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let w = fastest(&table);
    for i in 1..4 {
        let errors = worst(table.rows(), |row| {
            let (q, qd) = (row.vector("q"), row.vector("qd"));
            let expected = differentiated(&arm, &q, &qd, i).angular;
            (
                largest(&(paper::eq_36_37(&qd)[i] - expected)),
                largest(&(product::link_velocities(&q, &qd)[i].angular - expected)),
            )
        });
        let what = format!("w{0}{0}, eq. {1}", i + 1, if i < 2 { 36 } else { 37 });
        // Theory: 2 theta2-dot, and theta4-dot is missing from the last.
        verdict(19, &what, "rad/s", errors, 12.0, bound(&arm, w));
    }
}

#[test]
fn erratum_20_angular_velocity_of_the_flange() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let w = fastest(&table);
    let errors = worst(table.rows(), |row| {
        let (q, qd) = (row.vector("q"), row.vector("qd"));
        let (_, corrected) = product::flange_velocity(&q, &qd);
        (
            largest(&(paper::eq_38(&qd) - angular(&row))),
            largest(&(corrected - angular(&row))),
        )
    });
    // Theory: 2 theta2-dot - theta4-dot, with the wrist at up to 30 rad/s.
    verdict(20, "w04, eq. 38", "rad/s", errors, 20.0, bound(&arm, w));
}

#[test]
fn erratum_21_linear_velocity_of_the_flange() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let w = fastest(&table);
    let errors = worst(table.rows(), |row| {
        let (q, qd) = (row.vector("q"), row.vector("qd"));
        let (corrected, _) = product::flange_velocity(&q, &qd);
        (
            largest(&(paper::eq_39(&arm, &q, &qd) - linear(&row))),
            largest(&(corrected - linear(&row))),
        )
    });
    verdict(21, "V04, eq. 39", "m/s", errors, 2.0, bound(&arm, w));
}

#[test]
fn erratum_45_eq_39_contradicts_eq_35() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let w = fastest(&table);
    // Oracle: the velocity of one point does not depend on the axes it is written in.
    let errors = worst(table.rows(), |row| {
        let (q, qd) = (row.vector("q"), row.vector("qd"));
        let (r, _) = frame(&arm, &q, 3);
        let own = product::link_velocities(&q, &qd)[3].linear;
        (
            largest(&(r * paper::eq_34_35(&arm, &q, &qd)[3] - paper::eq_39(&arm, &q, &qd))),
            largest(&(r * own - product::flange_velocity(&q, &qd).0)),
        )
    });
    // Theory: the sign of y is reversed, 2 a2 theta1-dot cos(theta1 + theta2).
    verdict(45, "R04 V44 - V04", "m/s", errors, 2.0, bound(&arm, w));
}
