//! The plant against Pinocchio and MuJoCo, quantity by quantity.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use nalgebra::{SMatrix, Vector4};
use sim::model::{Payload, RobotModel};
use sim::plant::arm::Arm;
use sim::plant::drive::Drive;
use sim::plant::kinematics::{self, Pose, Unreachable, Violation};
use tests::{Row, Table, reference};

/// Absolute, in the unit of the quantity. The tables hold efforts up to 2e3 N m, each the sum of some hundred
/// roundings of 1.1e-16: below 1e-10. Three engines agree with each other within 1.2e-12.
const TOLERANCE: f64 = 1e-9;

fn model() -> RobotModel {
    let (model, warnings) =
        RobotModel::from_json(&std::fs::read_to_string(reference("model.json")).unwrap()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    model
}

fn payload(key: &str) -> Payload {
    let text = std::fs::read_to_string(reference("model.json")).unwrap();
    let document: serde_json::Value = serde_json::from_str(&text).unwrap();
    Payload::from_json(&document[key].to_string()).unwrap()
}

fn assert_near<const R: usize, const C: usize>(
    row: Row<'_>,
    what: &str,
    found: SMatrix<f64, R, C>,
    wanted: SMatrix<f64, R, C>,
) {
    let error = (found - wanted).amax();
    assert!(
        error <= TOLERANCE,
        "{row}: {what} is off by {error:e}\n{found}{wanted}"
    );
}

#[test]
fn the_default_model_is_the_reference_model() {
    // The table has estimates of greatest accelerations and jerks, which the robot that is shipped does without.
    let mut model = model();
    assert!(model.limits.acceleration.take().is_some() && model.limits.jerk.take().is_some());
    assert_eq!(RobotModel::irb_930_22_105(), model);
}

#[test]
fn kinematics() {
    let arm = Arm::new(&model(), None);
    for row in Table::load("kinematics.csv").rows() {
        let (at, qd) = (arm.at(&row.vector("q")), row.vector("qd"));
        let pose = arm.pose(&at);
        let place = Vector4::new(pose.x, pose.y, pose.z, pose.yaw);
        assert_near(
            row,
            "pose",
            place,
            ["x", "y", "z", "yaw"].map(|c| row.f64(c)).into(),
        );
        assert_near(row, "R", arm.flange(&at).1, row.matrix("R"));
        assert_near(row, "J", arm.jacobian(&at), row.matrix("J"));
        let twist = ["vx", "vy", "vz", "wx", "wy", "wz"].map(|c| row.f64(c));
        assert_near(row, "J qd", arm.twist(&at, &qd), twist.into());
        assert_near(
            row,
            "Jdot qd",
            arm.jacobian_rate_times(&at, &qd),
            row.vector("Jdqd"),
        );
    }
}

fn dynamics(table: &str, label: &str, payload: Option<&Payload>) {
    let arm = Arm::new(&model(), payload);
    for row in Table::load(table).rows_where("payload", label) {
        let (at, qd, qdd) = (
            arm.at(&row.vector("q")),
            row.vector("qd"),
            row.vector("qdd"),
        );
        assert_near(
            row,
            "tau",
            arm.inverse_dynamics(&at, &qd, &qdd),
            row.vector("tau"),
        );
        assert_near(row, "M", arm.mass_matrix(&at), row.matrix("M"));
        assert_near(row, "n", arm.bias(&at, &qd), row.vector("n"));
        assert_near(row, "g", arm.gravity(&at), row.vector("g"));
    }
}

#[test]
fn dynamics_without_payload() {
    dynamics("dynamics.csv", "none", None);
}

#[test]
fn dynamics_with_10_kg() {
    dynamics("dynamics.csv", "p10", Some(&payload("payload_test_10kg")));
}

#[test]
fn dynamics_with_an_eccentric_payload() {
    dynamics(
        "dynamics_eccentric.csv",
        "ecc5",
        Some(&payload("payload_test_ecc5kg")),
    );
}

#[test]
fn actuation() {
    let model = model();
    let (arm, drive) = (Arm::new(&model, None), Drive::new(&model.drive));
    for row in Table::load("actuation.csv").rows() {
        let (q, qd, qdd) = (row.vector("q"), row.vector("qd"), row.vector("qdd"));
        let link = arm.inverse_dynamics(&arm.at(&q), &qd, &qdd);
        let rotor = drive.rotor_inertia() * qdd;
        let friction = drive.friction(&qd);
        let total = link + rotor + friction;
        assert_near(row, "tau_link", link, row.vector("tau_link"));
        assert_near(row, "tau_rotor", rotor, row.vector("tau_rotor"));
        assert_near(row, "tau_fric", friction, row.vector("tau_fric"));
        assert_near(row, "tau_joint_total", total, row.vector("tau_joint_total"));
        assert_near(
            row,
            "tau_motor",
            drive.motor_torque(&total),
            row.vector("tau_motor"),
        );
        assert_near(
            row,
            "phi_motor",
            drive.to_motor(&q),
            row.vector("phi_motor"),
        );
        assert_near(
            row,
            "phid_motor",
            drive.to_motor(&qd),
            row.vector("phid_motor"),
        );
        assert_near(
            row,
            "q from phi",
            drive.to_joint(&row.vector("phi_motor")),
            q,
        );
        assert_near(
            row,
            "tau from motors",
            drive.joint_effort(&row.vector("tau_motor")),
            total,
        );
    }
}

#[test]
fn inverse_kinematics() {
    let model = model();
    for row in Table::load("ik.csv").rows() {
        let [x, y, z, yaw] = ["x", "y", "z", "yaw"].map(|c| row.f64(c));
        let result = kinematics::inverse(&model.geometry, &model.limits, &Pose { x, y, z, yaw });
        let solutions = match row.text("reason") {
            "too_far" => {
                assert_eq!(result, Err(Unreachable::TooFar), "{row}");
                continue;
            }
            "inside_hole" => {
                assert_eq!(result, Err(Unreachable::InsideHole), "{row}");
                continue;
            }
            _ => result.unwrap_or_else(|e| panic!("{row}: {e:?}")),
        };
        let wanted_violation = match row.text("reason") {
            "joint2_limit" => Some(Violation::Elbow),
            "joint1_limit" => Some(Violation::Shoulder),
            "z_high" => Some(Violation::TooHigh),
            "z_low" => Some(Violation::TooLow),
            _ => None,
        };
        // Near the stretched arm the radius, with 16 digits in the table, hardly determines theta2; theta1 and
        // theta4 follow it with factors a2 / (a1 + a2) and a1 / (a1 + a2), both below 1.
        let angle = row.f64("tol_theta2").max(TOLERANCE);
        let tolerance = Vector4::new(angle, angle, TOLERANCE, angle);
        for (solution, side) in solutions.iter().zip(["a", "b"]) {
            let error = (solution.q - row.vector(&format!("{side}_q"))).abs();
            assert!(
                (tolerance - error).min() >= 0.0,
                "{row}: {side} is off by {error}"
            );
            let within = solution.violation.is_none();
            assert_eq!(
                within,
                row.flag(&format!("{side}_in_limits")),
                "{row}: {side} {solution:?}"
            );
        }
        if wanted_violation.is_some() {
            assert_eq!(
                solutions.map(|s| s.violation),
                [wanted_violation; 2],
                "{row}"
            );
        }
    }
}
