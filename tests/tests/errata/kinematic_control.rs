//! Errata 38, 39 and 50: kinematic control.

use nalgebra::{Matrix4, SVector, Vector2, Vector4};
use tests::Table;

use crate::arm::{Arm, U32, U64, bound_over, largest, verdict, worst};
use crate::ode::{integrate, split, stack};
use crate::paper::control as paper;
use crate::paper::kinematics::{eq_8_to_19, eq_27};
use crate::product;

#[test]
fn erratum_38_joint_law_feeds_back_the_position_error() {
    // A set point, at a distance of 0.1 rad; the same gain for both forms.
    let (lambda, start, end): (f64, f64, f64) = (1.0, 0.1, 10.0);
    let as_printed = |speed: f64| {
        // qd = qd_d + lambda qdd with qd_d = 0 determines the acceleration.
        let f = |_: f64, x: &Vector2<f64>| Vector2::new(x.y, x.y / lambda);
        integrate(Vector2::new(start, speed), end, 1000, f, |_, x| {
            assert_eq!(x.y, paper::kinematic_joint(0.0, lambda, x.y / lambda));
        })
    };
    let corrected = integrate(start, end, 1000, |_, error| -lambda * error, |_, _| ());

    // Theory: printed, the error stays where it is and a speed grows as e^(t / lambda); corrected, the error falls as
    // e^(-lambda t). 1e-6 is more than the error of the Runge-Kutta method, (lambda h)^4 / 120 per e-fold.
    let decayed = start * (-lambda * end).exp();
    let grown = 0.01 * (end / lambda).exp();
    verdict(
        38,
        "position error 10 s after a start at rest",
        "rad",
        (as_printed(0.0).x, corrected),
        start,
        decayed * (1.0 + 1e-6),
    );
    verdict(
        38,
        "speed 10 s after a push of 0.01 rad/s",
        "rad/s",
        (as_printed(0.01).y, lambda * corrected),
        grown * (1.0 - 1e-6),
        lambda * decayed * (1.0 + 1e-6),
    );
}

#[test]
fn erratum_39_task_law_feeds_back_the_pose_error() {
    let arm = Arm::bare();
    let (r, end, steps): (f64, f64, u32) = (10.0, 1.0, 200);
    let v = Vector4::new(0.1, -0.05, -0.02, 0.3);
    let start = Vector4::new(0.3, 1.2, 0.1, 0.5);
    let pose = |q: &Vector4<f64>| {
        let (_, o) = eq_8_to_19(&arm, q);
        Vector4::new(o.x, o.y, o.z, q.x + q.y - q.w)
    };
    let offset = Vector4::new(0.05, -0.02, 0.01, 0.2);
    let reference = |t: f64| pose(&start) + offset + v * t;

    // As printed mud = mud_d + r mudd, which determines the acceleration; from rest.
    let implied = |rate: &Vector4<f64>| (rate - v) / r;
    let f = |_: f64, x: &SVector<f64, 8>| {
        let (_, rate) = split(x);
        stack(&rate, &implied(&rate))
    };
    let rest = stack(&pose(&start), &Vector4::zeros());
    let x = integrate(rest, end, steps, f, |_, x| {
        let (_, rate) = split(x);
        let asked = paper::kinematic_task(&Matrix4::identity(), &v, r, &implied(&rate));
        // Rounding: rates below 1 in their unit, three operations.
        assert!(
            largest(&(asked - rate)) <= 4.0 * U64,
            "the law holds all the way"
        );
    });
    let printed = largest(&(reference(end) - split(&x).0));

    let f = |t: f64, q: &Vector4<f64>| {
        let error = reference(t) - product::forward(q);
        product::task_inverse(q) * (v + error * r)
    };
    let mut path = Vec::new();
    integrate(start, end, steps, f, |t, q| path.push((t, *q)));
    let errors = worst(&path, |(t, q)| {
        // Theory: every component of the error falls as e^(-r t).
        let error = reference(*t) - pose(q);
        (printed, largest(&(error - offset * (-r * t).exp())))
    });
    // The law sees the pose rounded to f32; a relative error of the inverse leaves that fraction of its argument, over
    // r. Runge-Kutta: (r h)^4 / 120 of the error.
    let inverse = bound_over(&path, |(_, q)| product::inverse_jacobian_bound(&arm, q));
    let asked = v.lp_norm(1) / r + offset.lp_norm(1);
    let method = (r * end / f64::from(steps)).powi(4) / 120.0 * largest(&offset);
    let bound = product::position_bound(&arm) + inverse * asked + method;
    // Theory: the printed law keeps its initial error, and the missing speed grows as e^(t / r).
    verdict(
        39,
        "pose error against e^(-rt), 1 s",
        "m, rad",
        errors,
        largest(&offset),
        bound,
    );
}

#[test]
fn erratum_50_the_inverse_needs_a_guard_at_the_stretched_arm() {
    let arm = Arm::bare();
    let table = Table::load("ik.csv");
    // At theta2 = 0 itself the printed law divides by zero.
    let rows: Vec<_> = table
        .rows_where("kind", "near_singular")
        .filter(|row| row.f64("detJ_a") != 0.0)
        .collect();
    let speed = 0.1;
    let errors = worst(&rows, |row| {
        let q: Vector4<f64> = row.vector("a_q");
        let outwards = Vector2::new(row.f64("x"), row.f64("y")).normalize();
        let v = Vector4::new(-speed * outwards.x, -speed * outwards.y, 0.0, 0.0);
        let j = eq_27(&arm, &q);
        // J^-1 in closed form, so that the result is due to the law and not to an elimination.
        let determinant = arm.a1 * arm.a2 * q.y.sin();
        let printed = Vector2::new(
            j[(1, 1)] * v.x - j[(0, 1)] * v.y,
            j[(0, 0)] * v.y - j[(1, 0)] * v.x,
        ) / determinant;
        (
            largest(&printed),
            product::joint_speed_damped(&q, &v).xy().norm(),
        )
    });
    // Theory: stretched, the radius is the reach and falls by det J / reach per radian of theta2; 1 % for the rows
    // where it is a little less. The controller guarantees 1.155 over 3 % of the reach; 64 u for rounding.
    let reach = arm.a1 + arm.a2;
    let asked = bound_over(&rows, |row| speed * reach / row.f64("detJ_a"));
    let promised = 1.155 / (0.03 * reach) * speed;
    verdict(
        50,
        "shoulder and elbow speed for 0.1 m/s inwards",
        "rad/s",
        errors,
        0.99 * asked,
        promised * (1.0 + 64.0 * U32),
    );
}
