//! Errata 31 to 37 and 46: the Newton-Euler recursion, one printed line at a time.

use nalgebra::{Vector3, Vector4};
use tests::Table;

use crate::arm::{Arm, State, U32, U64, bound_over, largest, verdict, worst};
use crate::paper::kinematics::DhRow;
use crate::paper::newton_euler::{Joint, Misprint, Motion, inverse_dynamics, outward};
use crate::product;

/// Worst torque error over both payloads of `dynamics.csv`: of the recursion with `misprints`, and of the controller's.
fn torque_errors(misprints: &[Misprint]) -> (f64, f64) {
    let table = Table::load("dynamics.csv");
    worst(table.rows(), |row| {
        let arm = Arm::with_payload(row.text("payload"));
        let state = State::of(&row);
        let expected: Vector4<f64> = row.vector("tau");
        (
            largest(&(inverse_dynamics(&arm, &state, misprints) - expected)),
            largest(&(product::newton_euler(row.text("payload"), &state) - expected)),
        )
    })
}

/// Largest sum of magnitudes in the recursion over the table.
fn scale() -> f64 {
    let table = Table::load("dynamics.csv");
    bound_over(table.rows(), |row| {
        let arm = Arm::with_payload(row.text("payload"));
        product::recursion_scale(&arm, &State::of(&row))
    })
}

/// The roundings of the controller's recursion, in f64, and as many again in Pinocchio's.
fn f64_bound() -> f64 {
    2.0 * product::RECURSION_ROUNDINGS / U32 * U64 * scale()
}

fn assert_wrong_by(erratum: u8, misprints: &[Misprint], wrong_by: f64) {
    let what = match misprints {
        [one] => format!("torque, {one:?} alone"),
        _ => "torque, recursion as printed".to_owned(),
    };
    verdict(
        erratum,
        &what,
        "N m, N",
        torque_errors(misprints),
        wrong_by,
        product::RECURSION_ROUNDINGS * scale(),
    );
}

#[test]
fn the_recursion_without_misprints_agrees_with_pinocchio() {
    let (error, _) = torque_errors(&[]);
    println!("Newton-Euler, all misprints corrected: off by {error:.1e} N m");
    assert!(error <= f64_bound());
}

#[test]
fn erratum_31_gravity_has_to_enter_the_recursion() {
    let arm = Arm::with_payload("p10");
    let weight = arm.lifted_mass() * arm.g;
    // Theory: the whole weight of lift and payload is missing. 1e-9 is for rounding.
    assert_wrong_by(31, &[Misprint::NoGravity], weight * (1.0 - 1e-9));
}

#[test]
fn erratum_32_coriolis_term_takes_the_rate_of_the_slide() {
    // A slide on a turntable, the simplest arm with a prismatic axis not parallel to the rotation that carries it.
    let (r, rd, rdd, w, alpha) = (1.0, 1.0, 3.0, 2.0, 5.0);
    let row = |alpha: f64, d| DhRow {
        a: 0.0,
        alpha,
        d,
        theta: 0.0,
    };
    let turntable = Joint {
        row: row(std::f64::consts::FRAC_PI_2, 0.0),
        prismatic: false,
        rate: w,
        acceleration: alpha,
    };
    let slide = Joint {
        row: row(0.0, r),
        prismatic: true,
        rate: rd,
        acceleration: rdd,
    };
    let acceleration = |misprints: &[Misprint]| {
        let base = outward(&turntable, &Motion::default(), misprints);
        outward(&slide, &base, misprints).a
    };
    // Acceleration in polar coordinates: tangential along x, radial along z of the slide.
    let expected = Vector3::new(r * alpha + 2.0 * rd * w, 0.0, rdd - r * w * w);
    let errors = (
        largest(&(acceleration(&[Misprint::Coriolis]) - expected)),
        largest(&(acceleration(&[]) - expected)),
    );
    // Theory: 2 w rdd for 2 w rd, here 2 x 2 x (3 - 1); rounding of cos(pi/2) = 6e-17 and of a dozen operations on
    // numbers below 10.
    verdict(
        32,
        "acceleration of a slide on a turntable",
        "m/s^2",
        errors,
        8.0 - 1e-9,
        240.0 * U64,
    );

    // In a SCARA slide and rotation are parallel, and the misprint has no effect.
    assert!(torque_errors(&[Misprint::Coriolis]).0 <= f64_bound());
}

#[test]
fn erratum_33_angular_acceleration_mixes_two_frames() {
    // Theory: theta2-double-dot counts with the wrong sign, and wrist inertia of the payload alone makes 10 N m of
    // 2 x 0.05 kg m^2 x 100 rad/s^2.
    assert_wrong_by(33, &[Misprint::AngularAcceleration], 10.0);
}

#[test]
fn erratum_34_lever_of_the_centre_of_mass_takes_the_angular_acceleration() {
    // Theory: m lc qdd is replaced by m w a lc; at 10 rad/s and 10 m/s^2 they differ by about 100 N m.
    assert_wrong_by(34, &[Misprint::ComAcceleration], 100.0);
}

#[test]
fn erratum_35_moment_takes_the_inertia_tensor() {
    // Theory: 0.3 (of metres) for the shaft's 0.00035 kg m^2, at wrist accelerations of hundreds of rad/s^2.
    assert_wrong_by(35, &[Misprint::LeverForInertia], 10.0);
}

#[test]
fn erratum_36_force_is_carried_over_once() {
    // Theory: the horizontal force of shaft and payload, some 12 kg at 10 m/s^2 and more on a lever of 0.5 m, is
    // rotated by theta4.
    assert_wrong_by(36, &[Misprint::ForceFrame], 10.0);
}

#[test]
fn erratum_37_effort_acts_along_the_axis_of_the_frame_before() {
    // Theory: moments about the far end of a link omit its whole lever.
    assert_wrong_by(37, &[Misprint::DistalMoment], 100.0);
}

#[test]
fn erratum_46_the_lever_of_a_revolute_joint_turns_with_it() {
    // Theory: the acceleration of the end of arm 1 is zero as printed.
    assert_wrong_by(46, &[Misprint::OriginAcceleration], 100.0);
}

#[test]
fn errata_30_to_37_together() {
    assert_wrong_by(37, &Misprint::ALL, 100.0);
}
