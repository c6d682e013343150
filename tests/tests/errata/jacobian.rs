//! Errata 10 to 15: Jacobian, its inverse, singularities.

use nalgebra::{Matrix4, SMatrix, Vector3, Vector4};
use tests::Table;

use crate::arm::{Arm, U32, bound_over, largest, verdict, worst};
use crate::paper::kinematics as paper;
use crate::product;

/// Rows vx vy vz wz of a 6x4 Jacobian.
fn task_rows(j: &SMatrix<f64, 6, 4>) -> Matrix4<f64> {
    j.select_rows(&[0, 1, 2, 5])
        .fixed_view::<4, 4>(0, 0)
        .into_owned()
}

#[test]
fn erratum_10_joint_3_is_the_prismatic_one() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let q: Vector4<f64> = row.vector("q");
        let expected: SMatrix<f64, 6, 4> = row.matrix("J");
        let (_, flange) = paper::eq_8_to_19(&arm, &q);
        let axis = -Vector3::z();
        let above = Vector3::new(flange.x, flange.y, 0.0);
        let as_revolute = paper::eq_24(&axis, &above, &flange);
        (
            largest(&(as_revolute - expected.column(2))),
            largest(&(product::jacobian(&q) - expected)),
        )
    });
    // Theory: a revolute joint 3 turns the tool and does not lift it: 0 for -1 in vz, -1 for 0 in wz.
    verdict(
        10,
        "column of joint 3 taken for revolute",
        "",
        errors,
        1.0,
        product::position_bound(&arm),
    );
}

#[test]
fn erratum_11_o4_lies_below_the_arm() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let z = row.f64("z");
        (paper::eq_26_o4(&arm, &q).z - z, product::forward(&q).z - z)
    });
    // Theory: d3 for -d3, 2 d3; the states cover the stroke of 0.3 m.
    verdict(
        11,
        "z of o4",
        "m",
        errors,
        0.3,
        product::position_bound(&arm),
    );
}

#[test]
fn erratum_12_only_the_4x4_task_jacobian_has_an_inverse() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let bound = bound_over(table.rows(), |row| {
        product::inverse_jacobian_bound(&arm, &row.vector("q"))
    });
    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let j: SMatrix<f64, 6, 4> = row.matrix("J");
        // The nearest thing to J^-1: the left inverse, which exists away from the singularity.
        let left = (j.transpose() * j).try_inverse().expect("rank 4") * j.transpose();
        let residual = j * left - SMatrix::<f64, 6, 6>::identity();
        let residual4 = task_rows(&j) * product::task_inverse(&q) - Matrix4::identity();
        (largest(&residual), largest(&residual4))
    });
    // Theory: rank 4 of 6; commands in wx and wy are lost entirely.
    verdict(12, "J J^-1 - I", "", errors, 1.0, bound);
}

#[test]
fn erratum_13_singular_block_is_transposed_and_has_a1_for_a2() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let expected: SMatrix<f64, 6, 4> = row.matrix("J");
        let block = expected.fixed_view::<3, 3>(0, 0);
        let corrected = product::jacobian(&q);
        (
            largest(&(paper::eq_29(&arm, &q) - block)),
            largest(&(corrected.fixed_view::<3, 3>(0, 0) - block)),
        )
    });
    // Theory: off-diagonal elements of the size of the reach, in each other's place.
    verdict(
        13,
        "J_11",
        "m",
        errors,
        arm.a1 + arm.a2,
        product::position_bound(&arm),
    );

    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let expected = row
            .matrix::<6, 4>("J")
            .fixed_view::<3, 3>(0, 0)
            .determinant();
        (
            paper::eq_29(&arm, &q).determinant() - expected,
            -product::determinant(&q) - expected,
        )
    });
    // Theory: -a1^2 s2 for -a1 a2 s2, so a1 (a1 - a2) at right angles; half of it allows for the states' positions.
    verdict(
        13,
        "det J_11",
        "m^2",
        errors,
        0.5 * arm.a1 * (arm.a1 - arm.a2),
        product::position_bound(&arm),
    );
}

#[test]
fn erratum_14_the_four_alphas_are_not_the_twists() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let q = row.vector("q");
        let j: SMatrix<f64, 6, 4> = row.matrix("J");
        let twists = paper::table_1(&arm, &q).map(|r| r.alpha);
        let determinant = j.fixed_view::<2, 2>(0, 0).determinant();
        (
            paper::rank_condition(twists) - determinant,
            product::determinant(&q) - determinant,
        )
    });
    // Theory: with the only alphas that the paper defines, 0, pi, 0, 0, the condition holds everywhere: every
    // configuration would be singular. The determinant is a1 a2 sin theta2.
    verdict(
        14,
        "alpha1 alpha4 - alpha2 alpha3",
        "m^2",
        errors,
        0.5 * arm.a1 * arm.a2,
        product::position_bound(&arm),
    );
}

#[test]
fn erratum_15_the_folded_singularity_is_out_of_reach() {
    let arm = Arm::bare();
    let limit = product::upper_limit().y;
    // Past a right angle sin theta2 falls towards the limit, so the least determinant of a folded arm is at the limit.
    let least = arm.a1 * arm.a2 * limit.sin();
    let at_limit = product::determinant(&Vector4::new(0.0, limit, 0.0, 0.0));
    verdict(
        15,
        "determinant of the arm folded as far as it goes (printed: 0)",
        "m^2",
        (least, at_limit - least),
        0.1,
        32.0 * U32 * arm.a1 * arm.a2,
    );
    let folded = Vector4::new(arm.a1 - arm.a2, 0.0, -arm.d4, 0.0);
    for elbow in [product::Elbow::Positive, product::Elbow::Negative] {
        let refusal = product::inverse(&folded, elbow, &Vector4::zeros());
        let reason = refusal.expect_err("145 degrees do not fold the arm");
        assert!(product::reason_fits(&reason, "joint2_limit"), "{reason:?}");
    }
}
