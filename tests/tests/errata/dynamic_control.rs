//! Errata 40 to 43 and 51: dynamic control.

use std::f64::consts::TAU;

use nalgebra::{Matrix4, SVector, Vector4};
use tests::{Row, Table};

use crate::arm::{Arm, State, bound_over, largest, verdict, worst};
use crate::ode::{integrate, split, stack};
use crate::paper::control as paper;
use crate::paper::kinematics::eq_27;
use crate::paper::newton_euler::inverse_dynamics;
use crate::product::{self, Dynamics};

/// Mass matrix and C qd + g by the recursion that agrees with Pinocchio.
fn equations_of_motion(
    arm: &Arm,
    q: &Vector4<f64>,
    qd: &Vector4<f64>,
) -> (Matrix4<f64>, Vector4<f64>) {
    let effort = |qd: Vector4<f64>, qdd| inverse_dynamics(arm, &State { q: *q, qd, qdd }, &[]);
    let held = effort(Vector4::zeros(), Vector4::zeros());
    let unit = [Vector4::x(), Vector4::y(), Vector4::z(), Vector4::w()];
    let columns = unit.map(|qdd| effort(Vector4::zeros(), qdd) - held);
    (
        Matrix4::from_columns(&columns),
        effort(*qd, Vector4::zeros()),
    )
}

#[test]
fn erratum_40_tracking_takes_the_whole_model() {
    let arm = Arm::with_payload("p10");
    let model = Dynamics::new("p10");
    let (bandwidth, omega, swing, end, steps): (f64, f64, f64, f64, u32) =
        (30.0, TAU, 0.5, 1.0, 1000);
    let rest = Vector4::new(0.2, 0.8, 0.1, 0.0);
    let along = Vector4::new(swing, swing, 0.0, 0.0);
    let reference = |t: f64| {
        let (s, c) = (omega * t).sin_cos();
        (
            rest + along * (1.0 - c),
            along * (omega * s),
            along * (omega * omega * c),
        )
    };
    let (m0, g) = equations_of_motion(&arm, &rest, &Vector4::zeros());
    // The same stiffness for both: inertia at the start times bandwidth squared, critically damped.
    let inertia = Matrix4::from_diagonal(&m0.diagonal());
    let kp = bandwidth * bandwidth;
    let kd = 2.0 * bandwidth;

    let follow = |law: &dyn Fn(f64, &State) -> Vector4<f64>| {
        let f = |t: f64, x: &SVector<f64, 8>| {
            let (q, qd) = split(x);
            let qdd = Vector4::zeros();
            let tau = law(t, &State { q, qd, qdd });
            let (m, n) = equations_of_motion(&arm, &q, &qd);
            stack(&qd, &m.cholesky().expect("a mass matrix").solve(&(tau - n)))
        };
        let mut errors = Vec::new();
        integrate(stack(&rest, &Vector4::zeros()), end, steps, f, |t, x| {
            errors.push(largest(&(reference(t).0 - split(x).0)));
        });
        largest(&errors)
    };
    let printed = follow(&|t, s| {
        let (q_d, qd_d, _) = reference(t);
        paper::pd_gravity(
            &(inertia * kp),
            &(inertia * kd),
            (q_d, qd_d),
            (s.q, s.qd),
            &g,
        )
    });
    let corrected = follow(&|t, s| {
        let (q_d, qd_d, qdd_d) = reference(t);
        let qdd = qdd_d + (qd_d - s.qd) * kd + (q_d - s.q) * kp;
        model.inverse(&State { qdd, ..*s })
    });

    // Theory: PD holds M qdd_d with its stiffness, so it lags by about qdd_d / bandwidth^2. Computed torque leaves a
    // critically damped error equation, driven by the rounding of the torque: at most M^-1 delta / bandwidth^2; the Runge-Kutta
    // method adds some (omega h)^4 of the swing.
    let lag = swing * omega * omega / kp;
    let rounding = bound_over(0..100, |hundredths| {
        let (q, qd, qdd) = reference(f64::from(hundredths) * end / 100.0);
        let (m, _) = equations_of_motion(&arm, &q, &qd);
        let inverse = m.try_inverse().expect("a mass matrix");
        inverse.norm() * product::torque_bound(&arm, &State { q, qd, qdd })
    });
    let method = (omega * end / f64::from(steps)).powi(4) * swing;
    verdict(
        40,
        "tracking error on a 1 Hz swing of 1 rad, 10 kg",
        "rad",
        (printed, corrected),
        0.5 * lag,
        rounding / kp + method,
    );
}

#[test]
fn erratum_41_rate_product_is_that_of_the_actual_motion() {
    let arm = Arm::bare();
    let table = Table::load("kinematics.csv");
    let errors = worst(table.rows(), |row| {
        let (q, qd) = (row.vector::<4>("q"), row.vector::<4>("qd"));
        // An arm 2 degrees and 5 % of speed off its path.
        let (q_d, qd_d) = (
            q + Vector4::new(2.0, 2.0, 0.0, 2.0).map(f64::to_radians),
            qd * 1.05,
        );
        let expected = row.vector::<6>("Jdqd");
        let bracket = paper::eq_49_bracket(
            &Vector4::zeros(),
            &rate_product(&arm, &q_d, &qd_d),
            (0.0, 0.0),
            (q, qd),
            (q, qd),
        );
        // The bracket subtracts what the motion adds of itself; what does not cancel accelerates the tool.
        (
            largest(&(bracket + Vector4::new(expected[0], expected[1], expected[2], expected[5]))),
            largest(&(product::rate_product(&q, &qd).xyz() - expected.fixed_rows::<3>(0))),
        )
    });
    let scale = bound_over(table.rows(), |row| {
        let qd = row.vector::<4>("qd");
        let (w1, w2) = (qd.x.abs(), qd.x.abs() + qd.y.abs());
        arm.a1 * w1 * w1 + arm.a2 * w2 * w2
    });
    // Theory: 5 % of speed is 10 % of a centripetal acceleration that reaches 200 m/s^2.
    verdict(
        41,
        "acceleration left over, 2 degrees and 5 % off the path",
        "m/s^2",
        errors,
        2.0,
        product::ANGLE_BOUND * scale,
    );
}

/// Jdot qd of the task (vx, vy, vz, wz), from differences of eq. 27, which agrees with Pinocchio.
fn rate_product(arm: &Arm, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vector4<f64> {
    let step = 1e-6;
    let rate = (eq_27(arm, &(q + qd * step)) - eq_27(arm, &(q - qd * step))) / (2.0 * step) * qd;
    Vector4::new(rate[0], rate[1], rate[2], rate[5])
}

#[test]
fn erratum_42_dynamics_are_no_function_of_the_tool_pose() {
    let arm = Arm::with_payload("p10");
    let model = Dynamics::new("p10");
    let table = Table::load("ik.csv");
    let v = Vector4::new(1.0, 0.5, 0.2, 1.0);
    let state = |row: &Row, elbow: &str| {
        let q = row.vector(elbow);
        let qd = product::task_inverse(&q) * v;
        let qdd = Vector4::zeros();
        State { q, qd, qdd }
    };
    let coriolis = |s: &State| {
        let (_, n) = equations_of_motion(&arm, &s.q, &s.qd);
        n.xy()
    };
    let errors = worst(table.rows_where("kind", "reachable"), |row| {
        // One pose, one tool velocity, two postures: n(mu, mud) can be right for one of them.
        let (a, b) = (state(&row, "a_q"), state(&row, "b_q"));
        (
            largest(&(coriolis(&a) - coriolis(&b))),
            largest(&(model.bias(&b.q, &b.qd).xy() - coriolis(&b))),
        )
    });
    let bound = bound_over(table.rows_where("kind", "reachable"), |row| {
        product::torque_bound(&arm, &state(&row, "b_q"))
    });
    // Theory: sin theta2 changes sign with the elbow, so does h sin theta2 thd1^2: several N m at 1 m/s.
    verdict(
        42,
        "n(mu, mud) of the other elbow",
        "N m",
        errors,
        5.0,
        bound,
    );
}

#[test]
fn erratum_43_motors_are_part_of_the_model() {
    let arm = Arm::bare();
    let model = Dynamics::new("none");
    let table = Table::load("actuation.csv");
    let errors = worst(table.rows(), |row| {
        let state = State::of(&row);
        let expected: Vector4<f64> = row.vector("tau_joint_total");
        let links: Vector4<f64> = row.vector("tau_link");
        let corrected = model.inverse(&state) + product::drive_efforts(&state);
        (
            largest(&(links - expected)),
            largest(&(corrected - expected)),
        )
    });
    let bound = bound_over(table.rows(), |row| {
        let state = State::of(&row);
        product::torque_bound(&arm, &state) + product::drive_bound(&state)
    });
    // Theory: a rotor of 2.5 kg m^2 at the shoulder and some 60 rad/s^2, and friction.
    verdict(
        43,
        "torque without rotors and friction",
        "N m, N",
        errors,
        100.0,
        bound,
    );
}

#[test]
fn erratum_51_a_yaw_error_is_the_short_way_round() {
    let table = Table::load("kinematics.csv");
    let pairs: Vec<_> = table.rows().zip(table.rows().skip(1)).collect();
    let zero = Vector4::zeros();
    let errors = worst(pairs, |(desired, actual)| {
        // Oracle: the rotation that is left, from Pinocchio's matrices.
        let [(c_d, s_d), (c, s)] = [&desired, &actual].map(|row| (row.f64("R11"), row.f64("R21")));
        let expected = (s_d * c - c_d * s).atan2(c_d * c + s_d * s);
        let pose = |row: &Row| Vector4::w() * row.f64("yaw");
        let gains = (1.0, 0.0);
        let printed = paper::eq_49_bracket(
            &zero,
            &zero,
            gains,
            (pose(&desired), zero),
            (pose(&actual), zero),
        )
        .w;
        let corrected = product::wrap(desired.f64("yaw") - actual.f64("yaw"));
        (printed - expected, corrected - expected)
    });
    // Theory: a whole turn, whenever the yaws lie on either side of half a turn. 1e-9 is for rounding.
    verdict(
        51,
        "yaw error",
        "rad",
        errors,
        TAU - 1e-9,
        product::ANGLE_BOUND,
    );
}
