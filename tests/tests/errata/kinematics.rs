//! Errata 1 to 8: forward and inverse kinematics.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector2, Vector3, Vector4};
use tests::{Row, Table};

use crate::arm::{Arm, U32, U64, bound_over, largest, rotation, translation, verdict, worst};
use crate::paper::kinematics as paper;
use crate::product;

/// Flange position of a row of `kinematics.csv` or `ik.csv`.
fn position(row: &Row) -> Vector3<f64> {
    Vector3::new(row.f64("x"), row.f64("y"), row.f64("z"))
}

fn wrap(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

#[test]
fn erratum_01_twist_and_length_belong_to_x_i() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let as_worded = paper::eq_1(paper::table_1(&arm, &q).map(|r| paper::text_before_eq_1(&r)));
        let p = position(&row);
        (
            (translation(&as_worded) - p).norm(),
            (product::forward(&q).xyz() - p).norm(),
        )
    });
    // Taken literally, theta1 moves the flange on a circle of radius a2 about a fixed point: the error is up to the
    // diameter of that circle and more.
    verdict(
        1,
        "flange position",
        "m",
        errors,
        arm.a2,
        product::position_bound(&arm),
    );
}

#[test]
fn erratum_02_second_link_transform_is_a_half_turn_not_a_reflection() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let chain = |q: &Vector4<f64>| {
        let rows = paper::table_1(&arm, q);
        let mut links = rows.map(|row| paper::eq_2(&row));
        links[1] = paper::eq_4(&arm, q.y);
        rotation(&paper::eq_1(links))
    };
    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let expected: Matrix3<f64> = row.matrix("R");
        (
            largest(&(chain(&q) - expected)),
            largest(&(product::rotation(&q) - expected)),
        )
    });
    // +1 for -1.
    verdict(
        2,
        "R(3,3) of the flange",
        "",
        errors,
        2.0,
        product::ANGLE_BOUND,
    );

    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        (
            chain(&q).determinant() - 1.0,
            product::rotation(&q).determinant() - 1.0,
        )
    });
    // Theory: a rotation has determinant +1, a reflection -1. The error of the chain in f64 is some 1e-15 of the 2.
    verdict(
        2,
        "det R - 1",
        "",
        errors,
        2.0 - 1e-12,
        2.0 * product::ANGLE_BOUND,
    );
}

#[test]
fn erratum_03_forward_kinematics_and_jacobian_are_right_as_printed() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let (r, o) = paper::eq_8_to_19(&arm, &q);
        (
            largest(&(o - position(&row))).max(largest(&(r - row.matrix("R")))),
            largest(&(paper::eq_27(&arm, &q) - row.matrix("J"))),
        )
    });
    println!(
        "erratum 03  as printed, against Pinocchio: eq. 8-19 off by {:.1e}, eq. 27 by {:.1e}",
        errors.0, errors.1
    );
    // Angles up to 12.1 rad summed in f64, each rounded: 2 x 12.1 u, and a few u for products, on lengths of 1.05 m,
    // and the same again for the table.
    let bound = 64.0 * U64;
    assert!(errors.0 <= bound && errors.1 <= bound, "{errors:?}");
}

/// Rows of `ik.csv` with a solution well off the singularity.
fn reachable(table: &Table) -> impl Iterator<Item = Row<'_>> {
    table.rows_where("kind", "reachable")
}

fn radial(row: &Row) -> Vector2<f64> {
    position(row).xy()
}

#[test]
fn erratum_04_atan2_takes_the_sine_side_first() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let typed = paper::ik_alpha(&row.matrix("R"), paper::atan2_typed);
        let yaw = row.f64("yaw");
        let q = row.vector("q");
        (wrap(typed - yaw), wrap(product::forward(&q).w - yaw))
    });
    // Theory: swapped arguments give pi/2 - yaw, so the error |pi/2 - 2 yaw| covers all angles.
    verdict(
        4,
        "yaw, arguments typed as printed",
        "rad",
        errors,
        3.0,
        product::ANGLE_BOUND,
    );

    let table = Table::load("ik.csv");
    let bound = bound_over(reachable(&table), |row| product::ik_bound(&arm, &row));
    let errors = worst(reachable(&table), |row| {
        let theta1 = paper::ik_theta1(&arm, &radial(&row), row.f64("a_q2"), paper::atan2_typed);
        let solution = product::solve(&row, product::Elbow::Positive);
        (
            wrap(theta1 - row.f64("a_q1")),
            wrap(solution.x - row.f64("a_q1")),
        )
    });
    // Theory: both swapped angles change sign, so the printed theta1 is -theta1.
    verdict(
        4,
        "theta1, arguments typed as printed",
        "rad",
        errors,
        2.0,
        bound,
    );
}

#[test]
fn erratum_05_theta2_needs_the_square_of_its_cosine() {
    let arm = Arm::bare();
    let table = Table::load("ik.csv");
    let bound = bound_over(reachable(&table), |row| product::ik_bound(&arm, &row));
    let errors = worst(reachable(&table), |row| {
        let c2 = paper::ik_c2(&arm, &radial(&row));
        let printed = paper::ik_theta2(c2, 1.0, paper::atan2_meant);
        let solution = product::solve(&row, product::Elbow::Positive);
        (printed - row.f64("a_q2"), solution.y - row.f64("a_q2"))
    });
    // Theory: sqrt(1 - c) for sqrt(1 - c^2) is exact at 90 degrees and 0.41 rad off at the limit of 145 degrees.
    verdict(
        5,
        "theta2, arguments of atan2 in order",
        "rad",
        errors,
        0.2,
        bound,
    );
    let mirrored = worst(reachable(&table), |row| {
        let solution = product::solve(&row, product::Elbow::Negative);
        (0.0, solution.y - row.f64("b_q2"))
    });
    assert!(mirrored.1 <= bound, "the other elbow: {mirrored:?}");
}

#[test]
fn erratum_06_lift_is_positive_down() {
    let arm = Arm::bare();
    let table = Table::load("ik.csv");
    let errors = worst(reachable(&table), |row| {
        let solution = product::solve(&row, product::Elbow::Positive);
        let d3 = row.f64("a_q3");
        (paper::ik_d3(&arm, row.f64("z")) - d3, solution.z - d3)
    });
    // Theory: the printed value is -d3, off by 2 d3; targets are spread over the stroke of 0.3 m.
    verdict(6, "d3", "m", errors, 0.3, product::position_bound(&arm));
}

#[test]
fn erratum_07_theta4_needs_a_turn_inside_its_range() {
    // A shoulder and an elbow near their limits and a yaw of nearly half a turn the other way: legal for every axis.
    let q = Vector4::new(2.6, 2.5, 0.1, 5.1 + 3.1 - TAU);
    let arm = Arm::bare();
    let (r, _) = paper::eq_8_to_19(&arm, &q);
    let limit = product::upper_limit().w;
    let alpha = paper::ik_alpha(&r, paper::atan2_meant);
    let printed = paper::ik_theta4(q.x, q.y, alpha);
    // The wrist is close to its upper limit: the nearest turn of all would be the printed one.
    let near = Vector4::new(q.x, q.y, q.z, limit - 0.1);
    let corrected = product::inverse(&product::forward(&q), product::Elbow::Positive, &near)
        .expect("a pose within reach");
    println!(
        "erratum 07  theta4: printed {printed:.3} rad, limit {limit:.3} rad, corrected {:.3} rad",
        corrected.w
    );
    assert!(printed > limit, "printed form stays inside the range");
    let errors = (printed - q.w, corrected.w - q.w);
    // Three f32 angles up to 8.3 rad and the conditioning of theta1 and theta2 at this pose: both divide by at least
    // a1 a2 sin theta2 = 0.16, so lengths rounded at 32 u give 32 u / 0.16.
    verdict(
        7,
        "theta4",
        "rad",
        errors,
        TAU - 1e-9,
        2.0 * 32.0 * U32 / 0.16 + product::ANGLE_BOUND,
    );
}

#[test]
fn erratum_08_unreachable_poses_are_to_be_refused() {
    let arm = Arm::bare();
    let table = Table::load("ik.csv");
    let (mut poses, mut answered) = (0, 0);
    for row in table.rows_where("kind", "unreachable") {
        poses += 1;
        let c2 = paper::ik_c2(&arm, &radial(&row));
        answered += usize::from(paper::ik_theta2(c2, 1.0, paper::atan2_meant).is_finite());

        let refusals = [product::Elbow::Positive, product::Elbow::Negative].map(|elbow| {
            product::inverse(&product::pose(&row), elbow, &Vector4::zeros())
                .expect_err("no joint position")
        });
        // The two postures may fail at different axes; the table names one.
        let reason = row.text("reason");
        assert!(
            refusals
                .iter()
                .any(|refusal| product::reason_fits(refusal, reason)),
            "{row}: refused for {refusals:?}"
        );
    }
    println!(
        "erratum 08  unreachable poses that get an answer: printed {answered} of {poses} (not a number for the others), corrected 0"
    );
    // Theory: only a target beyond the stretched arm makes 1 - c2 negative.
    assert_eq!(
        answered,
        poses - table.rows_where("reason", "too_far").count()
    );
    assert!(answered > 0);
}
