//! Properties of the dynamics, for any arm and payload: two derivations agree, and the laws of mechanics hold.
//!
//! The bounds are numbers of roundings times the magnitudes of `common::magnitude`.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::magnitude::{self, LAGRANGE, NEWTON_EULER};
use common::{U, acceleration, arm, assert_close, payload, position, speed};
use firmware::mechanics::arm::{ArmModel, Payload};
use firmware::mechanics::body::Body;
use firmware::mechanics::dynamics::lagrange::Lagrange;
use firmware::mechanics::dynamics::newton_euler;
use firmware::mechanics::kinematics::Trig;
use nalgebra::{Matrix4, Vector4};
use proptest::prelude::*;

fn wide(vector: &Vector4<f32>) -> Vector4<f64> {
    vector.map(f64::from)
}

fn magnitude(
    arm: &ArmModel,
    payload: &Payload,
    gravity: f32,
    qd: &Vector4<f32>,
    qdd: &Vector4<f32>,
) -> Vector4<f64> {
    magnitude::effort(arm, payload, gravity, &wide(qd), &wide(qdd))
}

fn assert_matrix_close(
    what: &str,
    actual: &Matrix4<f32>,
    expected: &Matrix4<f32>,
    bound: &Matrix4<f64>,
) {
    for column in 0..4 {
        let what = format!("{what}, column {}", column + 1);
        assert_close(
            &what,
            &actual.column(column).into(),
            &wide(&expected.column(column).into()),
            &bound.column(column).into(),
        );
    }
}

proptest! {
    #![proptest_config(common::draws::cases(512))]

    /// The inertia that laws and planner use is links plus rotors.
    #[test]
    fn the_mass_of_the_body_is_that_of_links_and_rotors(
        arm in arm(), payload in payload(), q in position(), qdd in acceleration(),
    ) {
        let body = Body::new(&arm, &payload);
        let trig = Trig::new(&q);
        let rotors = body.drive.rotor_inertia();
        let expected = wide(&(Lagrange::new(&arm, &payload).mass_matrix(&trig) * qdd)) + wide(&(rotors * qdd));
        let rotors = rotors.map(|x| f64::from(x.abs())) * wide(&qdd).abs();
        let bound = (magnitude(&arm, &payload, 0.0, &Vector4::zeros(), &qdd) + rotors) * (2.0 * LAGRANGE * U);
        assert_close("efforts", &body.inertial(&body.lagrange.couplings(&trig), &qdd), &expected, &bound);
    }

    #[test]
    fn lagrange_and_newton_euler_agree(
        arm in arm(), payload in payload(), q in position(), qd in speed(), qdd in acceleration(),
    ) {
        let lagrange = Lagrange::new(&arm, &payload);
        let trig = Trig::new(&q);
        let zero = Vector4::zeros();
        let roundings = (LAGRANGE + NEWTON_EULER) * U;

        let other = newton_euler::inverse(&arm, &payload, &q, &qd, &qdd);
        let bound = magnitude(&arm, &payload, arm.gravity, &qd, &qdd) * roundings;
        assert_close("inverse", &lagrange.inverse(&trig, &qd, &qdd), &wide(&other), &bound);

        let other = newton_euler::bias(&arm, &payload, &q, &qd);
        let bound = magnitude(&arm, &payload, 0.0, &qd, &zero) * roundings;
        assert_close("bias", &lagrange.bias(&trig, &qd), &wide(&other), &bound);

        let other = newton_euler::gravity(&arm, &payload, &q);
        let bound = magnitude(&arm, &payload, arm.gravity, &zero, &zero) * roundings;
        assert_close("gravity", &lagrange.gravity(), &wide(&other), &bound);

        let other = newton_euler::mass_matrix(&arm, &payload, &q);
        let bound = magnitude::mass_matrix(&arm, &payload) * roundings;
        assert_matrix_close("mass matrix", &lagrange.mass_matrix(&trig), &other, &bound);
    }

    /// tau = M qdd + C qd + g, each from its own function.
    #[test]
    fn the_parts_of_lagrange_add_up(
        arm in arm(), payload in payload(), q in position(), qd in speed(), qdd in acceleration(),
    ) {
        let lagrange = Lagrange::new(&arm, &payload);
        let trig = Trig::new(&q);
        let zero = Vector4::zeros();

        let bias = lagrange.bias(&trig, &qd);
        let coriolis = lagrange.coriolis(&trig, &qd) * qd;
        // Two computations of the same terms: the products of C with qd, written out, are the squares of the rates.
        let bound = magnitude(&arm, &payload, 0.0, &qd, &zero) * (2.0 * LAGRANGE * U);
        assert_close("C qd", &coriolis, &wide(&bias), &bound);

        // C^T qd, of the same terms again.
        let gradient = lagrange.coriolis(&trig, &qd).transpose() * qd;
        assert_close("C^T qd", &lagrange.couplings(&trig).kinetic_gradient(&qd), &wide(&gradient), &bound);

        let sum = lagrange.mass_matrix(&trig) * qdd + bias + lagrange.gravity();
        let bound = magnitude(&arm, &payload, arm.gravity, &qd, &qdd) * (2.0 * LAGRANGE * U);
        assert_close("sum", &lagrange.inverse(&trig, &qd, &qdd), &wide(&sum), &bound);
    }

    /// Kinetic energy is positive: M is symmetric to the bit, and elimination finds only positive pivots.
    #[test]
    fn mass_matrix_is_symmetric_positive_definite(arm in arm(), payload in payload(), q in position()) {
        let mass = Lagrange::new(&arm, &payload).mass_matrix(&Trig::new(&q));
        prop_assert_eq!(mass, mass.transpose());

        let mut rest = mass.map(f64::from);
        for k in 0..4 {
            prop_assert!(rest[(k, k)] > 0.0, "pivot {}: {} of {}", k + 1, rest[(k, k)], mass);
            for i in k + 1..4 {
                let factor = rest[(i, k)] / rest[(k, k)];
                for j in k..4 {
                    rest[(i, j)] -= factor * rest[(k, j)];
                }
            }
        }
    }

    /// M' - 2 C is skew-symmetric, that is, M' = C + C^T: the Coriolis efforts that M does not account for do no work.
    #[test]
    fn mass_rate_minus_twice_coriolis_is_skew(
        arm in arm(), payload in payload(), q in position(), direction in speed(),
    ) {
        // Speeds of magnitude 1, so that a step in time is a step in angle.
        prop_assume!(direction.y.abs() + direction.w.abs() > 1.0);
        let qd = direction / (direction.y.abs() + direction.w.abs());
        let lagrange = Lagrange::new(&arm, &payload);
        let step = 1.0 / 64.0;
        let at = |s: f32| lagrange.mass_matrix(&Trig::new(&(q + qd * s)));
        let rate = (at(step) - at(-step)) / (2.0 * step);
        let coriolis = lagrange.coriolis(&Trig::new(&q), &qd);

        // Central difference: truncation h^2 / 6 of a third derivative, no greater than the coefficient of the sine, since
        // angles move at rate 1 at most; rounding of M over h, and of q: 8 u, half the spacing at 7 rad, in each of three angles.
        let h = f64::from(step);
        let share = h * h / 6.0 + (LAGRANGE + 3.0 * 8.0) * U / h;
        // C is bounded by the speed of the faster body, arm 1 included.
        let fast = f64::from(qd.x.abs() + qd.y.abs() + qd.w.abs());
        let bound = magnitude::mass_matrix(&arm, &payload) * (share + 4.0 * LAGRANGE * U * fast);
        assert_matrix_close("M'", &rate, &(coriolis + coriolis.transpose()), &bound);
    }

    /// The accelerations from forward dynamics require the efforts that it was given.
    #[test]
    fn inverse_of_forward_is_the_identity(
        arm in arm(), payload in payload(), q in position(), qd in speed(), qdd in acceleration(),
    ) {
        let lagrange = Lagrange::new(&arm, &payload);
        let trig = Trig::new(&q);
        let tau = lagrange.inverse(&trig, &qd, &qdd);
        let found = lagrange.forward(&trig, &qd, &tau);
        // Residual of elimination without pivoting on a positive definite matrix of order 3 (Higham 2002, thm 10.3 and
        // 10.4): 10 u |L| D |L^T| |x|, and an element of that product is at most the root of the product of the
        // diagonal elements: the rates of the three bodies count as independent.
        let rates = Vector4::new(
            found.x.abs(), (found.x + found.y).abs(), (found.x + found.y - found.w).abs(), 0.0,
        ).map(f64::from);
        let diagonal = magnitude::mass_matrix(&arm, &payload).diagonal();
        let (arm1, arm2, tool) = (diagonal.x.sqrt(), diagonal.y.sqrt(), diagonal.w.sqrt());
        let sum = arm1 * rates.x + arm2 * rates.y + tool * rates.z;
        let (f1, f2, f4) = (arm1 * sum, arm2 * sum, tool * sum);
        let residual = Vector4::new(f1 + f2 + f4, f2 + f4, 0.0, f4) * (10.0 * U);
        let bound = magnitude(&arm, &payload, arm.gravity, &qd, &found) * (2.0 * LAGRANGE * U)
            + magnitude(&arm, &payload, arm.gravity, &qd, &qdd) * (2.0 * LAGRANGE * U)
            + residual;
        assert_close("effort", &lagrange.inverse(&trig, &qd, &found), &wide(&tau), &bound);
    }
}

/// The lift alone: a falling mass.
#[test]
fn released_lift_falls_at_g() {
    let lagrange = Lagrange::new(&firmware::mechanics::arm::IRB_930, &Payload::NONE);
    let rest = Vector4::zeros();
    let qdd = lagrange.forward(&Trig::new(&rest), &rest, &rest);
    assert!((f64::from(qdd.z) - 9.81).abs() <= 4.0 * U * 9.81, "{qdd}");
    assert_eq!((qdd.x, qdd.y, qdd.w), (0.0, 0.0, 0.0));
}
