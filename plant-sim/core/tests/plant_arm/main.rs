//! The rigid arm against textbook mechanics in Denavit-Hartenberg frames, on robots drawn at random.
//!
//! The oracle shares neither frames nor formulas with the plant: homogeneous transforms of the standard DH table,
//! Jacobians by cross products, Lagrange's equations with the mass matrix differentiated numerically, and the
//! articulated-body algorithm on dense 6 x 6 matrices. A second check runs the recursive algorithms in six
//! dimensions, to test the plant's reduction to the plane.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod chain;
mod oracle;
mod spatial;

use chain::Chain;
use nalgebra::{Matrix3, Vector3, Vector4};
use oracle::{Body, Oracle};
use proptest::array::{uniform3, uniform4};
use proptest::prelude::*;
use sim::model::{Payload, RobotModel};
use sim::plant::arm::Arm;
use sim::plant::kinematics::{self, Pose, wrap};
use std::f64::consts::PI;

/// Compares the arm with the oracle at one state.
///
/// `scale` of an effort is the sum of the magnitudes that go into it. The oracle and the plant each add fewer than 100
/// products, so exact formulas agree within 200 eps; central differences of trigonometric polynomials of first degree
/// have an error of h^2 / 6 of the amplitude, plus 4 eps / h from cancellation.
fn check(
    model: &RobotModel,
    payload: &Payload,
    q: &Vector4<f64>,
    qd: &Vector4<f64>,
    qdd: &Vector4<f64>,
) {
    let (oracle, arm) = (Oracle::new(model, payload), Arm::new(model, Some(payload)));
    let at = arm.at(q);
    let exact = 200.0 * f64::EPSILON;
    let mass = arm.mass_matrix(&at);
    // Lengths enter squared; the model's vertical offsets cancel in M only after being added.
    let mass_scale = size(&oracle);
    let error = (mass - oracle.mass_matrix(q)).amax();
    assert!(error <= exact * mass_scale, "M is off by {error:e}");

    let bias = arm.bias(&at, qd);
    let speed = qd.amax().powi(2);
    let bias_scale = 4.0 * mass_scale * (speed + model.gravity.abs());
    let h = 1e-5;
    let error = (bias - oracle.bias(q, qd, h)).amax();
    let bound = (h * h / 6.0 + 4.0 * f64::EPSILON / h) * 16.0 * bias_scale;
    assert!(error <= bound, "bias is off by {error:e}, bound {bound:e}");

    let energy = arm.kinetic_energy(&at, qd);
    let error = (energy - 0.5 * qd.dot(&(mass * qd))).abs();
    assert!(
        error <= exact * 16.0 * mass_scale * speed,
        "kinetic energy is off by {error:e}"
    );
    let error = (arm.potential_energy(&at) - oracle.potential_energy(q)).abs();
    assert!(
        error <= exact * mass_scale * model.gravity.abs(),
        "potential energy is off by {error:e}"
    );

    let tau = arm.inverse_dynamics(&at, qd, qdd);
    assert!(
        (tau - mass * qdd - bias).amax() <= exact * 4.0 * (mass_scale * qdd.amax() + bias_scale)
    );
    // Forward dynamics is compared by efforts, which do not magnify the error by the condition of M.
    let residual = (mass * (oracle.forward_dynamics(q, qd, &tau) - qdd)).amax();
    let condition = mass_scale / mass.symmetric_eigenvalues().min();
    assert!(
        residual <= exact * condition * 4.0 * (mass_scale * qdd.amax() + bias_scale),
        "ABA: {residual:e}"
    );
}

/// Bound of every term in the mass matrix and in the first moments: all mass at the end of all lengths, squared.
fn size(oracle: &Oracle) -> f64 {
    let g = &oracle.model.geometry;
    let lengths = g.a1 + g.a2 + g.d1.abs() + g.d2.abs() + g.d4.abs() + oracle.model.limits.upper[2];
    let of_body = |body: &Body| {
        let reach = 1.0 + lengths + 2.0 * body.com.norm();
        body.mass * reach * reach + body.inertia.trace()
    };
    oracle.bodies.iter().map(of_body).sum()
}

prop_compose! {
    fn link()(mass in 0.2..20.0, com in uniform3(-0.5..0.5), inertia in uniform3(1e-3..0.5)) -> sim::model::Link {
        sim::model::Link { mass, com, inertia }
    }
}

prop_compose! {
    fn robot()(a in [0.1..0.8, 0.1..0.8], d in uniform3(-0.3..0.3), links in uniform4(link()), gravity in -10.0..10.0)
        -> RobotModel {
        let mut model = RobotModel::irb_930_22_105();
        (model.geometry.a1, model.geometry.a2) = (a[0], a[1]);
        (model.geometry.d1, model.geometry.d2, model.geometry.d4) = (d[0], d[1], d[2]);
        (model.links, model.gravity) = (links, gravity);
        model
    }
}

prop_compose! {
    fn payload()(mass in 0.0..25.0, com in uniform3(-0.2..0.2), inertia in uniform3(0.0..0.5)) -> Payload {
        Payload { mass, com, inertia }
    }
}

fn joints(span: [f64; 4]) -> impl Strategy<Value = Vector4<f64>> {
    uniform4(-1.0..1.0).prop_map(move |x| Vector4::from(x).component_mul(&Vector4::from(span)))
}

fn positions() -> impl Strategy<Value = Vector4<f64>> {
    joints([PI, 2.5, 0.3, 7.0])
}

proptest! {
    #[test]
    fn any_arm_obeys_lagrange(
        model in robot(), payload in payload(), q in positions(),
        qd in joints([8.0, 12.0, 2.2, 30.0]), qdd in joints([60.0, 120.0, 60.0, 600.0]),
    ) {
        check(&model, &payload, &q, &qd, &qdd);
    }

    #[test]
    fn the_built_in_arms_obey_lagrange(
        payload in payload(), q in positions(),
        qd in joints([8.0, 12.0, 2.2, 30.0]), qdd in joints([60.0, 120.0, 60.0, 600.0]),
    ) {
        check(&RobotModel::irb_930_22_105(), &payload, &q, &qd, &qdd);
        check(&RobotModel::irb_930_12_085(), &payload, &q, &qd, &qdd);
    }

    #[test]
    fn the_plane_leaves_nothing_out(
        model in robot(), payload in payload(), q in positions(),
        qd in joints([8.0, 12.0, 2.2, 30.0]), qdd in joints([60.0, 120.0, 60.0, 600.0]),
    ) {
        let (chain, arm) = (Chain::new(&model, Some(&payload)), Arm::new(&model, Some(&payload)));
        let (six, plane) = (chain.at(&q), arm.at(&q));
        let scale = size(&Oracle::new(&model, &payload));
        prop_assert!((arm.mass_matrix(&plane) - chain.mass_matrix(&six)).amax() <= 1e-14 * scale);
        let difference = arm.inverse_dynamics(&plane, &qd, &qdd) - chain.inverse_dynamics(&six, &qd, &qdd);
        let rates = qdd.amax() + qd.amax().powi(2) + model.gravity.abs();
        prop_assert!(difference.amax() <= 1e-14 * scale * rates, "off by {:e}", difference.amax());
    }

    #[test]
    fn the_flange_is_where_the_dh_table_puts_it(model in robot(), q in positions(), qd in joints([1.0; 4])) {
        let (oracle, arm) = (Oracle::new(&model, &Payload { mass: 0.0, com: [0.0; 3], inertia: [0.0; 3] }), Arm::new(&model, None));
        let (at, frames) = (arm.at(&q), oracle.frames(&q));
        let origin: Vector3<f64> = frames[4].fixed_view::<3, 1>(0, 3).into();
        let rotation: Matrix3<f64> = frames[4].fixed_view::<3, 3>(0, 0).into();
        let (found_origin, found_rotation) = arm.flange(&at);
        // Lengths below 3 m and angles below 10 rad, some 20 roundings each.
        prop_assert!((origin - found_origin).amax() < 1e-14);
        prop_assert!((rotation - found_rotation).amax() < 1e-14);

        let (linear, angular) = Oracle::jacobian(&frames, 3, &origin);
        let jacobian = arm.jacobian(&at);
        prop_assert!((jacobian.fixed_view::<3, 4>(0, 0) - linear).amax() < 1e-14);
        prop_assert!((jacobian.fixed_view::<3, 4>(3, 0) - angular).amax() < 1e-14);

        // Central difference along the motion; third derivatives are below 3 m (2 rad/s)^3.
        let h = 1e-4;
        let twist = |time: f64| arm.twist(&arm.at(&(q + qd * time)), &qd);
        let rate = (twist(h) - twist(-h)) / (2.0 * h);
        prop_assert!((rate - arm.jacobian_rate_times(&at, &qd)).amax() < h * h * 24.0);
    }

    #[test]
    fn inverse_kinematics_undoes_forward(model in robot(), q in positions()) {
        prop_assume!(q[1].abs() > 1e-3);
        let arm = Arm::new(&model, None);
        let pose = arm.pose(&arm.at(&q));
        let solutions = kinematics::inverse(&model.geometry, &model.limits, &pose).unwrap();
        let same = &solutions[usize::from(q[1] < 0.0)].q;
        // theta2 follows the radius with a slope r / (a1 a2 sin theta2), and theta1 follows theta2; with arms of
        // nearly equal length the shoulder's direction is ill-conditioned as 1 / r.
        let (a1, a2) = (model.geometry.a1, model.geometry.a2);
        let slope = (a1 + a2) * (a1 + a2) / (a1 * a2 * q[1].sin().abs()) + 1.0 / pose.x.hypot(pose.y);
        for i in [0, 1, 3] {
            prop_assert!(wrap(same[i] - q[i]).abs() < 1e-14 * slope, "axis {i}: {same} {q}");
        }
        prop_assert!((same[2] - q[2]).abs() < 1e-15);
        for solution in solutions {
            let back = arm.pose(&arm.at(&solution.q));
            prop_assert!((back.x - pose.x).hypot(back.y - pose.y) < 1e-14 * slope);
            prop_assert!((back.z - pose.z).abs() < 1e-15);
            prop_assert!(wrap(back.yaw - pose.yaw).abs() < 1e-14);
        }
    }
}

#[test]
fn a_limited_wrist_may_use_another_turn() {
    let mut model = RobotModel::irb_930_22_105();
    (model.limits.lower[3], model.limits.upper[3]) = (PI, 2.0 * PI);
    // theta1 + theta2 - yaw = -1 is out of range, and within range one turn on.
    let arm = Arm::new(&model, None);
    let pose = arm.pose(&arm.at(&Vector4::new(0.3, 1.0, 0.1, -1.0)));
    let reach = |pose: &Pose| {
        kinematics::inverse(&model.geometry, &model.limits, pose).unwrap()[0].violation
    };
    assert_eq!(reach(&pose), None);
    assert_eq!(
        reach(&Pose {
            yaw: pose.yaw - 2.0,
            ..pose
        }),
        Some(kinematics::Violation::Wrist)
    );
}
