//! Errata 40 to 43 and 51: dynamic control.

use std::f64::consts::TAU;

use nalgebra::{Matrix4, SVector, Vector4};
use protocol::messages::Law;
use tests::{Row, Table};

use crate::arm::{Arm, State, bound_over, largest, verdict, worst};
use crate::laws::{Controller, sensing_bound};
use crate::ode::{integrate, split, stack};
use crate::paper::control::{self as paper, Motion};
use crate::paper::kinematics::{eq_8_to_19, eq_27};
use crate::paper::newton_euler::inverse_dynamics;
use crate::product::{self, Dynamics};

/// Mass matrix and C qd + g by the recursion, which agrees with Pinocchio.
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

/// Moves the arm under `law` from rest at `start` and returns time and position after every millisecond.
fn run(
    arm: &Arm,
    start: &Vector4<f64>,
    end: f64,
    law: &dyn Fn(f64, Motion) -> Vector4<f64>,
) -> Vec<(f64, Motion)> {
    let f = |t: f64, x: &SVector<f64, 8>| {
        let (q, qd) = split(x);
        let (m, n) = equations_of_motion(arm, &q, &qd);
        let effort = law(t, (q, qd)) - n;
        stack(&qd, &m.cholesky().expect("a mass matrix").solve(&effort))
    };
    let mut path = Vec::new();
    let steps = (end / STEP).round() as u32;
    integrate(stack(start, &Vector4::zeros()), end, steps, f, |t, x| {
        path.push((t, split(x)));
    });
    path
}

/// Step of the integration, s.
const STEP: f64 = 1e-3;

/// Bandwidth of all laws, rad/s, critically damped.
const BANDWIDTH: f64 = 30.0;
const KP: f64 = BANDWIDTH * BANDWIDTH;
const KD: f64 = 2.0 * BANDWIDTH;

#[test]
fn erratum_40_tracking_takes_the_whole_model() {
    let arm = Arm::with_payload("p10");
    let (omega, swing) = (TAU, 0.5);
    let rest = Vector4::new(0.2, 0.8, 0.1, 0.0);
    let along = Vector4::new(swing, swing, 0.0, 0.0);
    let reference = |t: f64| {
        let (s, c) = (omega * t).sin_cos();
        State {
            q: rest + along * (1.0 - c),
            qd: along * (omega * s),
            qdd: along * (omega * omega * c),
        }
    };
    let (m0, g) = equations_of_motion(&arm, &rest, &Vector4::zeros());
    // The same stiffness for both: inertia at the start times bandwidth squared, critically damped.
    let inertia = Matrix4::from_diagonal(&m0.diagonal());
    let printed = run(&arm, &rest, 1.0, &|t, actual| {
        let State { q, qd, .. } = reference(t);
        paper::pd_gravity(&(inertia * KP), &(inertia * KD), (q, qd), actual, &g)
    });
    let controller = Controller::new(Law::ComputedTorqueJoint, BANDWIDTH, "p10");
    let corrected = run(&arm, &rest, 1.0, &|t, actual| {
        controller.efforts(&reference(t), actual)
    });
    let off =
        |path: &[(f64, Motion)]| bound_over(path, |(t, (q, _))| largest(&(reference(*t).q - q)));

    // Theory: PD holds M qdd_d with its stiffness, so it lags by about qdd_d / bandwidth^2. Computed torque leaves a
    // critically damped error equation, driven by the rounding of the torque: at most M^-1 delta / bandwidth^2; the Runge-Kutta
    // method adds some (omega h)^4 of the swing.
    let lag = swing * omega * omega / KP;
    let rounding = bound_over(0..100, |hundredths| {
        let state = reference(f64::from(hundredths) / 100.0);
        let (m, _) = equations_of_motion(&arm, &state.q, &state.qd);
        let inverse = m.try_inverse().expect("a mass matrix");
        inverse.norm() * product::torque_bound(&arm, &state)
    });
    let method = (omega * STEP).powi(4) * swing;
    verdict(
        40,
        "tracking error on a 1 Hz swing of 1 rad, 10 kg",
        "rad",
        (off(&printed), off(&corrected)),
        0.5 * lag,
        rounding / KP + sensing_bound(swing * omega, BANDWIDTH) + method,
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
        // The bracket subtracts what the motion itself contributes; anything that does not cancel accelerates the tool.
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

/// x, y, z and yaw of the flange; yaw without wrapping.
fn pose(arm: &Arm, q: &Vector4<f64>) -> Vector4<f64> {
    let (_, o) = eq_8_to_19(arm, q);
    Vector4::new(o.x, o.y, o.z, q.x + q.y - q.w)
}

/// Rows vx vy vz wz of eq. 27.
fn task_jacobian(arm: &Arm, q: &Vector4<f64>) -> Matrix4<f64> {
    let j = eq_27(arm, q);
    Matrix4::from_rows(&[0, 1, 2, 5].map(|row| j.row(row).into_owned()))
}

#[test]
fn erratum_41_and_51_the_task_law_has_linear_error_dynamics() {
    let arm = Arm::with_payload("p10");
    let controller = Controller::new(Law::ComputedTorqueTask, BANDWIDTH, "p10");
    let end = 0.5;
    // Two set points: one at a yaw of 0.9 rad, and one to which the short way leads past half a turn, from 3.04 to 3.24 rad.
    for wrist in [0.8, -1.54] {
        let target = State {
            q: Vector4::new(0.1, 1.6, 0.15, wrist),
            qd: Vector4::zeros(),
            qdd: Vector4::zeros(),
        };
        let start = Vector4::new(0.6, 1.0, 0.05, wrist + 0.1);
        let goal = pose(&arm, &target.q);
        let offset = goal - pose(&arm, &start);
        let zero = Vector4::zeros();

        let printed = run(&arm, &start, end, &|_, (q, qd)| {
            let (m, n) = equations_of_motion(&arm, &q, &qd);
            let j = task_jacobian(&arm, &q);
            let here = (pose(&arm, &q), j * qd);
            let bracket = paper::eq_49_bracket(&zero, &zero, (KP, KD), (goal, zero), here);
            m * j.try_inverse().expect("off the singularity") * bracket + n
        });
        let corrected = run(&arm, &start, end, &|_, actual| {
            controller.efforts(&target, actual)
        });
        // Theory: e'' + 2 b e' + b^2 e = 0 from rest.
        let off = |path: &[(f64, Motion)]| {
            bound_over(path, |(t, (q, _))| {
                let decay = (1.0 + BANDWIDTH * t) * (-BANDWIDTH * t).exp();
                largest(&(goal - pose(&arm, q) - offset * decay))
            })
        };

        // The remainder of Jdot qd is a centripetal acceleration of the speed half-way, e0 b / e, at the reach.
        let reach = arm.a1 + arm.a2;
        let distance = offset.xy().norm();
        let centripetal = (distance * BANDWIDTH / 1.0_f64.exp()).powi(2) / reach;
        // Rounding: torque through M^-1 and J; the inverse of J on its whole argument; the state; the method,
        // (b h)^4 / 120 of the way.
        let rounding = bound_over(&corrected, |(t, (q, qd))| {
            let (m, _) = equations_of_motion(&arm, q, qd);
            let inverse = m.try_inverse().expect("a mass matrix");
            let j = task_jacobian(&arm, q);
            let pull = offset * (KP * (1.0 + BANDWIDTH * t) * (-BANDWIDTH * t).exp());
            let back = j.try_inverse().expect("off the singularity");
            let qdd = back.abs() * (pull.abs() + (j * qd).abs() * KD);
            let state = State {
                q: *q,
                qd: *qd,
                qdd,
            };
            let efforts = product::torque_bounds(&arm, &state);
            let asked = pull.lp_norm(1) + (j * qd).lp_norm(1) * KD;
            largest(&(j.abs() * inverse.abs() * efforts))
                + product::inverse_jacobian_bound(&arm, q) * asked
        });
        let sensing = product::ANGLE_BOUND + sensing_bound(distance * BANDWIDTH, BANDWIDTH);
        let method = (BANDWIDTH * STEP).powi(4) / 120.0 * offset.lp_norm(1);
        verdict(
            41,
            "pose error against (1 + b t) e^(-b t) on the way to a set point",
            "m, rad",
            (off(&printed), off(&corrected)),
            0.1 * centripetal / KP,
            rounding / KP + sensing + method,
        );
    }
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
        // Oracle: the remaining rotation, from Pinocchio's matrices.
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
