//! Errata 26, 30, 47 and 48: eq. 40-43 against laws that every Lagrangian system obeys.

use nalgebra::{Matrix4, Vector2, Vector4};

use crate::arm::{Arm, State, largest, verdict, worst};
use crate::lagrange::{as_printed, bare, empty_flange, given};
use crate::paper::lagrange as paper;
use crate::product;

/// The mass matrix of eq. 40-43 read charitably: first-power theta-dots for accelerations, no gravity.
fn charitable(arm: &Arm, q: &Vector4<f64>) -> Matrix4<f64> {
    let weightless = paper::Given {
        g: 0.0,
        ..given(arm)
    };
    let column = |rate| paper::eq_40_to_43(&weightless, q, &rate, &Vector2::zeros());
    Matrix4::from_columns(&[
        column(Vector2::x()),
        column(Vector2::y()),
        Vector4::zeros(),
        Vector4::zeros(),
    ])
}

#[test]
fn erratum_26_nothing_depends_on_theta1() {
    let (arm, table, product) = empty_flange();
    let errors = worst(bare(&table), |row| {
        let state = State::of(&row);
        let mut turned = state;
        turned.q.x += 1.0;
        (
            largest(&(as_printed(&given(&arm), &turned) - as_printed(&given(&arm), &state))),
            largest(&(product.inverse(&turned) - product.inverse(&state))),
        )
    });
    // Theory: theta1 is cyclic, so turning the whole arm changes nothing. As printed, gravity on the shoulder alone
    // varies by more than a2 m2 g.
    let wrong_by = arm.a2 * arm.links[1].mass * arm.g;
    verdict(
        26,
        "torque after turning the arm by 1 rad",
        "N m, N",
        errors,
        wrong_by,
        2.0 * product::torque_bound_over(&arm, &table, "none"),
    );
}

#[test]
fn erratum_30_no_charitable_reading_is_a_mass_matrix() {
    let (arm, table, product) = empty_flange();
    let asymmetry = |m: Matrix4<f64>| largest(&(m - m.transpose()));
    let errors = worst(bare(&table), |row| {
        let q = State::of(&row).q;
        (
            asymmetry(charitable(&arm, &q)),
            asymmetry(product.mass_matrix(&q)),
        )
    });
    // Theory: M = M^T, as second derivative of an energy. a2^2 m2 is among the terms without a counterpart.
    let wrong_by = arm.a2 * arm.a2 * arm.links[1].mass;
    verdict(
        30,
        "M - M^T, theta-dot read as theta-double-dot",
        "kg m^2",
        errors,
        wrong_by,
        0.0,
    );

    let definite = |m: Matrix4<f64>| usize::from((m + m.transpose()).cholesky().is_some());
    let (mut printed, mut corrected, mut states) = (0, 0, 0);
    for row in bare(&table) {
        let q = State::of(&row).q;
        states += 1;
        printed += definite(charitable(&arm, &q));
        corrected += definite(product.mass_matrix(&q));
        assert_eq!(
            charitable(&arm, &q).determinant(),
            0.0,
            "eq. 43 has no acceleration"
        );
    }
    println!(
        "erratum 30  positive definite M: printed {printed}, corrected {corrected} of {states} states"
    );
    // Theory: kinetic energy is positive.
    assert_eq!((printed, corrected), (0, states));
}

#[test]
fn erratum_47_gravity_as_printed_has_no_potential() {
    let (arm, table, product) = empty_flange();
    let step = 1e-6;
    let rest = |q: Vector4<f64>| State {
        q,
        qd: Vector4::zeros(),
        qdd: Vector4::zeros(),
    };
    let curl = |effort: &dyn Fn(&State) -> Vector4<f64>, q: &Vector4<f64>| {
        let by = |shift: Vector4<f64>| {
            (effort(&rest(q + shift)) - effort(&rest(q - shift))) / (2.0 * step)
        };
        by(Vector4::y() * step).x - by(Vector4::x() * step).y
    };
    let errors = worst(bare(&table), |row| {
        let q = State::of(&row).q;
        (
            curl(&|s| as_printed(&given(&arm), s), &q),
            curl(&|s| product.inverse(s), &q),
        )
    });
    // Theory: a gradient has no curl; as printed, a closed path of shoulder and elbow gains energy on every round. The
    // terms a1 m1 g sin theta1 and a2 m2 g sin(theta1 + theta2) remain.
    let wrong_by = arm.a2 * arm.links[1].mass * arm.g;
    verdict(
        47,
        "d tau1 / d theta2 - d tau2 / d theta1 at rest",
        "N m/rad",
        errors,
        wrong_by,
        0.0,
    );
}

#[test]
fn erratum_48_centrifugal_terms_are_on_the_wrong_joint() {
    let (arm, table, product) = empty_flange();
    let weightless = paper::Given {
        g: 0.0,
        ..given(&arm)
    };
    let products = |q: &Vector4<f64>, qd: &Vector4<f64>| {
        paper::eq_40_to_43(&weightless, q, &Vector2::zeros(), &qd.xy())
    };
    let errors = worst(bare(&table), |row| {
        let State { q, qd, .. } = State::of(&row);
        let shoulder = Vector4::x() * qd.x;
        (products(&q, &shoulder).x, product.bias(&q, &shoulder).x)
    });
    // Theory: an arm that turns as a whole at constant speed needs no torque (theta1 is cyclic, so the Christoffel symbol
    // c_111 = dM11/dtheta1 / 2 is zero). As printed a1 a2 m2 thd1^2 sin theta2 and more.
    let turning = State {
        q: Vector4::zeros(),
        qd: Vector4::x() * 7.68,
        qdd: Vector4::zeros(),
    };
    verdict(
        48,
        "tau1 of a steady turn",
        "N m",
        errors,
        100.0,
        product::torque_bound(&arm, &turning),
    );

    let errors = worst(bare(&table), |row| {
        let State { q, qd, .. } = State::of(&row);
        // Gravity does not act on joint 2, so its share of n is centrifugal.
        let expected = row.f64("n2");
        (
            products(&q, &qd).y - expected,
            product.bias(&q, &qd).y - expected,
        )
    });
    // Theory: h thd1^2 sin theta2, with h = 2.16 kg m^2 and up to 7.7 rad/s; eq. 41 has no product of velocities.
    verdict(
        48,
        "centrifugal torque on the elbow",
        "N m",
        errors,
        50.0,
        product::torque_bound_over(&arm, &table, "none"),
    );
}
