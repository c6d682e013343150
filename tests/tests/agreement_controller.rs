//! The controller's f32 mathematics against the reference tables.
//!
//! No tolerance is chosen. A bound is a number of roundings times u = 2^-24 times the magnitudes that are summed:
//! the roundings of the computation, as the firmware documents them, and those of turning the table's f64 inputs and the model's
//! decimals into f32. The latter move an angle by u of itself, so that a sine or cosine of it moves by as much, a speed
//! by u of itself, its square by 2 u, and a product of up to three model parameters by 3 u.

#[path = "../../firmware/tests/common/magnitude.rs"]
mod magnitude;

use std::f64::consts::{PI, TAU};

use firmware::mechanics::arm::{
    ArmModel, Axis, DriveTrain, Geometry, IRB_930, JointLimits, Link, Payload,
};
use firmware::mechanics::dynamics::drive::Drive;
use firmware::mechanics::dynamics::lagrange::Lagrange;
use firmware::mechanics::dynamics::newton_euler;
use firmware::mechanics::jacobian::Jacobian;
use firmware::mechanics::kinematics::{
    Elbow, IkError, Pose, REACH_TOLERANCE, Trig, forward, inverse, link_frames, rotation, solve,
};
use firmware::mechanics::velocity::propagate;
use magnitude::{LAGRANGE, NEWTON_EULER};
use nalgebra::{Matrix4, SMatrix, Vector3, Vector4};
use tests::{Row, Table, reference};

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1u32 << 24) as f64;

const A1: f64 = 0.56;
const A2: f64 = 0.49;
const REACH: f64 = A1 + A2;

/// Position, speeds and accelerations of a row, as the table has them and as the controller gets them.
struct State {
    wide: [Vector4<f64>; 3],
    narrow: [Vector4<f32>; 3],
}

impl State {
    fn of(row: &Row<'_>, columns: &[&str]) -> Self {
        let read = |i: usize| {
            columns
                .get(i)
                .map_or_else(Vector4::zeros, |column| row.vector::<4>(column))
        };
        let wide = [read(0), read(1), read(2)];
        Self {
            wide,
            narrow: wide.map(narrow),
        }
    }

    /// What rounding the angles does to a sine or cosine of any sum of them, in u.
    fn angles(&self) -> f64 {
        let [q, ..] = &self.wide;
        q.x.abs() + q.y.abs() + q.w.abs()
    }
}

fn narrow<const R: usize, const C: usize>(wide: SMatrix<f64, R, C>) -> SMatrix<f32, R, C> {
    wide.map(|value| value as f32)
}

/// Asserts `|actual - expected| <= bound`, element by element.
#[track_caller]
fn agree<const R: usize, const C: usize>(
    row: &Row<'_>,
    what: &str,
    actual: SMatrix<f32, R, C>,
    expected: SMatrix<f64, R, C>,
    bound: SMatrix<f64, R, C>,
) {
    for i in 0..R {
        for j in 0..C {
            let error = (f64::from(actual[(i, j)]) - expected[(i, j)]).abs();
            assert!(
                error <= bound[(i, j)],
                "{row}: {what}[{}][{}] is {}, not {}: off by {error:e}, allowed {:e}",
                i + 1,
                j + 1,
                actual[(i, j)],
                expected[(i, j)],
                bound[(i, j)],
            );
        }
    }
}

fn turn_between(a: f64, b: f64) -> f64 {
    (a - b) - TAU * ((a - b) / TAU).round()
}

/// Roundings in a coordinate of the flange, in u of the reach: 9.1 of the worse sine, 2 sums and products, 1 model length.
const POSITION: f64 = 13.0;

/// Every number of the built-in arm, rounded once.
#[test]
fn built_in_arm_is_the_reference_arm() {
    let text = std::fs::read_to_string(reference("model.json")).expect("readable");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let number = |path: &str| {
        let value = json.pointer(path).unwrap_or_else(|| panic!("no {path}"));
        value
            .as_f64()
            .unwrap_or_else(|| panic!("{path} is no number")) as f32
    };
    let joint = |path: &str| Vector4::from_fn(|i, _| number(&format!("{path}/{i}")));
    let vector = |path: &str| Vector3::from_fn(|i, _| number(&format!("{path}/{i}")));
    let arm = ArmModel {
        geometry: Geometry {
            a1: number("/dh/a1"),
            a2: number("/dh/a2"),
            d1: number("/dh/d1") + number("/dh/d2"),
            d4: number("/dh/d4"),
        },
        links: std::array::from_fn(|i| Link {
            mass: number(&format!("/links/{i}/mass")),
            com: vector(&format!("/links/{i}/com_joint_frame")),
            inertia: vector(&format!("/links/{i}/inertia_com_diag")),
        }),
        gravity: -number("/gravity/2"),
        limits: JointLimits {
            lower: joint("/joint_limits/lower"),
            upper: joint("/joint_limits/upper"),
            velocity: joint("/joint_limits/velocity"),
            acceleration: joint("/joint_limits/acceleration_cap"),
            jerk: joint("/joint_limits/jerk_cap"),
            effort: joint("/joint_limits/effort_peak"),
            effort_continuous: joint("/joint_limits/effort_continuous_rms"),
        },
        drive: DriveTrain {
            gear_ratio: joint("/drive/gear_ratio"),
            screw_lead: number("/drive/ball_screw_lead_m_per_rev"),
            screw_hand: number("/drive/screw_hand_sign"),
            rotor_inertia: joint("/drive/rotor_inertia_motor_side"),
            motor_torque_limit: joint("/drive/motor_torque_limit_model"),
            motor_torque_rated: joint("/drive/motor_rated_torque"),
            motor_speed_limit: joint("/drive/motor_max_speed_rad_s"),
            viscous: joint("/drive/viscous"),
            coulomb: joint("/drive/coulomb"),
            coulomb_eps: joint("/drive/coulomb_tanh_eps"),
            encoder_counts: number("/drive/encoder_counts_per_motor_rev") as u32,
        },
        payload_max: number("/spec/payload_max"),
    };
    assert_eq!(IRB_930, arm);
}

#[test]
fn forward_kinematics() {
    for row in Table::load("kinematics.csv").rows() {
        let state = State::of(&row, &["q"]);
        let [q, ..] = &state.narrow;
        let pose = forward(&IRB_930.geometry, q);
        let planar = (POSITION + state.angles()) * U * REACH;
        // The lift and d4 are rounded, and so are their sums: 4 u of at most 0.43 m.
        let bound = Vector3::new(planar, planar, 4.0 * U * 0.43);
        let expected = Vector3::new(row.f64("x"), row.f64("y"), row.f64("z"));
        agree(
            &row,
            "position",
            Vector3::new(pose.x, pose.y, pose.z),
            expected,
            bound,
        );

        // Each angle rounded, two sums no greater than the magnitudes, the wrap 2 u pi.
        let off = turn_between(pose.yaw.into(), row.f64("yaw")).abs();
        assert!(
            off <= (3.0 * state.angles() + 2.0 * PI) * U,
            "{row}: yaw {} is off by {off:e}",
            pose.yaw
        );

        // 9.1 u and 2.5 u of the sines, each times sine and cosine of the other angle (sqrt 2 in all), 2 of the sum.
        let bound = SMatrix::repeat((19.0 + state.angles()) * U);
        agree(
            &row,
            "R",
            rotation(&Trig::new(q)),
            row.matrix::<3, 3>("R"),
            bound,
        );
    }
}

#[test]
fn differential_kinematics() {
    for row in Table::load("kinematics.csv").rows() {
        let state = State::of(&row, &["q", "qd"]);
        let [q, qd, _] = &state.narrow;
        let trig = Trig::new(q);
        let jacobian = Jacobian::new(&IRB_930.geometry, &trig);
        let element = (POSITION + state.angles()) * U * REACH;
        agree(
            &row,
            "J",
            jacobian.geometric(),
            row.matrix::<6, 4>("J"),
            SMatrix::repeat(element),
        );

        // An element's error and 3 roundings of product, sum and speed.
        let [_, speed, _] = state.wide.map(|vector| vector.abs());
        let linear = (element + 3.0 * U * REACH) * (speed.x + speed.y);
        let twist = Vector4::new(row.f64("vx"), row.f64("vy"), row.f64("vz"), row.f64("wz"));
        let bound = Vector4::new(
            linear,
            linear,
            U * speed.z,
            4.0 * U * (speed.x + speed.y + speed.w),
        );
        agree(&row, "twist", jacobian.task_velocity(qd), twist, bound);

        let [_, _, _, flange] = propagate(&link_frames(&IRB_930.geometry, &trig, q.z), qd);
        let turn = rotation(&trig);
        // Four turns out and one back: the sines once more each, 3 sums in each.
        let linear = linear + 5.0 * (3.5 + 3.0 + state.angles()) * U * REACH * (speed.x + speed.y);
        let bound = Vector3::new(linear, linear, 3.0 * U * speed.z);
        agree(
            &row,
            "propagated velocity",
            turn * flange.linear,
            twist.xyz(),
            bound,
        );
        let turning = Vector3::new(row.f64("wx"), row.f64("wy"), row.f64("wz"));
        let bound = Vector3::new(0.0, 0.0, 8.0 * U * (speed.x + speed.y + speed.w));
        agree(
            &row,
            "propagated turning",
            turn * flange.angular,
            turning,
            bound,
        );

        // Squared rates: 2 u of each speed and 2 of their sum; the elements; the difference, product and sum.
        let squares = speed.x.powi(2) + (speed.x + speed.y).powi(2);
        let bias = (2.0 * element + 8.0 * U * REACH) * squares;
        let expected: Vector4<f64> = row.vector::<6>("Jdqd").fixed_rows::<4>(0).into();
        agree(
            &row,
            "Jdot qd",
            jacobian.bias(qd),
            expected,
            Vector4::new(bias, bias, 0.0, 0.0),
        );
    }
}

/// The rows of a table of dynamics with the payload they are for.
fn check_dynamics(row: &Row<'_>, payload: &Payload) {
    let state = State::of(row, &["q", "qd", "qdd"]);
    let [q, qd, qdd] = &state.narrow;
    let [_, speed, acceleration] = &state.wide;
    let trig = Trig::new(q);
    let lagrange = Lagrange::new(&IRB_930, payload);

    // 3 u of model parameters and 2 u of speeds; the angles enter Lagrange's form once, the recursion out and back.
    let inputs = 5.0 + state.angles();
    let roundings = (LAGRANGE + inputs) * U;
    let recursion = (NEWTON_EULER + inputs + state.angles()) * U;

    let effort = magnitude::effort(&IRB_930, payload, 9.81, speed, acceleration);
    let expected = row.vector::<4>("tau");
    agree(
        row,
        "tau",
        lagrange.inverse(&trig, qd, qdd),
        expected,
        effort * roundings,
    );
    let found = newton_euler::inverse(&IRB_930, payload, q, qd, qdd);
    agree(
        row,
        "tau (Newton-Euler)",
        found,
        expected,
        effort * recursion,
    );

    let effort = magnitude::mass_matrix(&IRB_930, payload);
    let expected = row.matrix::<4, 4>("M");
    agree(
        row,
        "M",
        lagrange.mass_matrix(&trig),
        expected,
        effort * roundings,
    );
    let found = newton_euler::mass_matrix(&IRB_930, payload, q);
    agree(row, "M (Newton-Euler)", found, expected, effort * recursion);

    let rest = Vector4::zeros();
    let effort = magnitude::effort(&IRB_930, payload, 9.81, speed, &rest);
    let expected = row.vector::<4>("n");
    let gravity = lagrange.gravity();
    agree(
        row,
        "n",
        lagrange.bias(&trig, qd) + gravity,
        expected,
        effort * roundings,
    );
    let matrix = lagrange.coriolis(&trig, qd) * qd + gravity;
    agree(row, "C qd + g", matrix, expected, effort * roundings);
    let found =
        newton_euler::bias(&IRB_930, payload, q, qd) + newton_euler::gravity(&IRB_930, payload, q);
    agree(row, "n (Newton-Euler)", found, expected, effort * recursion);

    let effort = magnitude::effort(&IRB_930, payload, 9.81, &rest, &rest);
    let expected = row.vector::<4>("g");
    agree(row, "g", gravity, expected, effort * roundings);
    agree(
        row,
        "g (Newton-Euler)",
        newton_euler::gravity(&IRB_930, payload, q),
        expected,
        effort * recursion,
    );

    // Forward dynamics, judged by the efforts that its accelerations need according to the table's own M and n.
    let found = lagrange
        .forward(&trig, qd, &narrow(row.vector::<4>("tau")))
        .map(f64::from);
    let needed = row.matrix::<4, 4>("M") * found + row.vector::<4>("n");
    let magnitude = magnitude::effort(&IRB_930, payload, 9.81, speed, &found)
        + magnitude::effort(&IRB_930, payload, 9.81, speed, acceleration);
    // Elimination of the 3 x 3 block: 10 u of at most the root of the product of two diagonal elements (Higham 2002).
    let diagonal = magnitude::mass_matrix(&IRB_930, payload).diagonal();
    let root = diagonal.map(f64::sqrt);
    let sum = root.x * found.x.abs()
        + root.y * (found.x + found.y).abs()
        + root.w * (found.x + found.y - found.w).abs();
    let (arm1, arm2, tool) = (root.x * sum, root.y * sum, root.w * sum);
    let residual = Vector4::new(arm1 + arm2 + tool, arm2 + tool, 0.0, tool) * 10.0 * U;
    agree(
        row,
        "tau of qdd",
        narrow(needed),
        row.vector::<4>("tau"),
        magnitude * roundings + residual,
    );
}

#[test]
fn dynamics_without_payload() {
    for row in Table::load("dynamics.csv").rows_where("payload", "none") {
        check_dynamics(&row, &Payload::NONE);
    }
}

#[test]
fn dynamics_with_ten_kilograms() {
    let payload = Payload {
        mass: 10.0,
        com: Vector3::new(0.0, 0.0, 0.08),
        inertia: Vector3::new(1.0 / 30.0, 1.0 / 30.0, 0.05),
    };
    for row in Table::load("dynamics.csv").rows_where("payload", "p10") {
        check_dynamics(&row, &payload);
    }
}

#[test]
fn dynamics_with_an_eccentric_payload() {
    let payload = Payload {
        mass: 5.0,
        com: Vector3::new(0.05, -0.03, 0.06),
        inertia: Vector3::new(0.012, 0.01, 0.015),
    };
    for row in Table::load("dynamics_eccentric.csv").rows() {
        check_dynamics(&row, &payload);
    }
}

#[test]
fn actuation() {
    let drive = Drive::new(&IRB_930.drive);
    let lagrange = Lagrange::new(&IRB_930, &Payload::NONE);
    let k = TAU / 0.025;
    #[rustfmt::skip]
    let coupling = Matrix4::new(
        80.0, 0.0, 0.0, 0.0,
        0.0, 50.0, 0.0, 0.0,
        0.0, 0.0, k, 1.0,
        0.0, 0.0, 0.0, 20.0,
    );
    let inverse_transpose = coupling.try_inverse().expect("regular").transpose().abs();
    let rotors = Matrix4::from_diagonal(&Vector4::new(3.84e-4, 3.0e-4, 1.3e-4, 5e-5));
    let reflected = coupling.transpose() * rotors * coupling;
    let coulomb = Vector4::new(12.0, 6.0, 20.0, 0.6);

    for row in Table::load("actuation.csv").rows() {
        let state = State::of(&row, &["q", "qd", "qdd"]);
        let [q, qd, qdd] = &state.narrow;
        let [position, speed, acceleration] = &state.wide;

        // Coefficient 3 u, product, sum, input.
        let bound = coupling * position.abs() * (6.0 * U);
        agree(
            &row,
            "motor angle",
            drive.motor_angle(q),
            row.vector("phi_motor"),
            bound,
        );
        let bound = coupling * speed.abs() * (6.0 * U);
        agree(
            &row,
            "motor speed",
            drive.motor_speed(qd),
            row.vector("phid_motor"),
            bound,
        );
        let back = drive.joint_angle(&narrow(row.vector("phi_motor")));
        let mut bound = position.abs() * (6.0 * U);
        bound.z += 8.0 * U * position.w.abs() / k;
        agree(&row, "joint angle", back, *position, bound);

        let link = lagrange.inverse(&Trig::new(q), qd, qdd);
        let magnitude = magnitude::effort(&IRB_930, &Payload::NONE, 9.81, speed, acceleration);
        let link_bound = magnitude * ((LAGRANGE + 5.0 + state.angles()) * U);
        agree(&row, "tau_link", link, row.vector("tau_link"), link_bound);

        // Up to 7 u in an element (two coefficients, rotor, products), 3 for product, sum and acceleration.
        let rotor = drive.rotor_inertia() * qdd;
        let rotor_bound = reflected * acceleration.abs() * (10.0 * U);
        agree(
            &row,
            "tau_rotor",
            rotor,
            row.vector("tau_rotor"),
            rotor_bound,
        );

        // tanh 1.5e-6; its argument is off by 3 u of itself, of which at most 0.45 shows; 4 u of the result.
        let friction = drive.friction(qd);
        let expected = row.vector::<4>("tau_fric");
        let friction_bound = coulomb * (1.5e-6 + 2.0 * U) + expected.abs() * (6.0 * U);
        agree(&row, "tau_fric", friction, expected, friction_bound);

        let total = link + rotor + friction;
        let sums = (link.abs() + rotor.abs() + friction.abs()).map(f64::from) * (2.0 * U);
        let total_bound = link_bound + rotor_bound + friction_bound + sums;
        agree(
            &row,
            "tau_joint_total",
            total,
            row.vector("tau_joint_total"),
            total_bound,
        );

        let bound = inverse_transpose * (total_bound + total.map(f64::from).abs() * (6.0 * U));
        agree(
            &row,
            "tau_motor",
            drive.motor_torque(&total),
            row.vector("tau_motor"),
            bound,
        );
    }
}

/// theta2 of the exact half-angle form.
fn bend(radius: f64) -> f64 {
    let fold = A1 - A2;
    let (short, over) = ((REACH - radius).max(0.0), (radius - fold).max(0.0));
    2.0 * (short * (REACH + radius))
        .sqrt()
        .atan2((over * (radius + fold)).sqrt())
}

fn target(row: &Row<'_>) -> Pose {
    let [x, y, z, yaw] = ["x", "y", "z", "yaw"].map(|column| row.f64(column) as f32);
    Pose { x, y, z, yaw }
}

/// The two solutions of a row: elbow, columns, flag.
const SOLUTIONS: [(Elbow, &str, &str); 2] = [
    (Elbow::Positive, "a_q", "a_in_limits"),
    (Elbow::Negative, "b_q", "b_in_limits"),
];

/// The error of theta2 is that of the radius, whatever the posture: it is bounded by the bends of a radius longer and
/// shorter by that error. Next to the stretched arm this allows 1e-3 rad, where a micrometre of radius is as much; the
/// pose that the solution leads to has to be right to the micrometre all the same.
#[test]
fn inverse_kinematics() {
    for row in Table::load("ik.csv").rows() {
        let pose = target(&row);
        let (x, y) = (row.f64("x"), row.f64("y"));
        let radius = x.hypot(y);
        // Target 1 u, hypot 2 u, lengths and their sum 2 u, clamped by REACH_TOLERANCE.
        let slack = (5.0 * U + f64::from(REACH_TOLERANCE)) * REACH;

        for (elbow, columns, flag) in SOLUTIONS {
            let found = solve(&IRB_930.geometry, &pose, elbow);
            if matches!(row.text("reason"), "too_far" | "inside_hole") {
                match (row.text("reason"), found) {
                    ("too_far", Err(IkError::TooFar { .. }))
                    | ("inside_hole", Err(IkError::TooNear { .. })) => {}
                    (reason, found) => panic!("{row}: {reason}, but found {found:?}"),
                }
                continue;
            }
            let found = found.unwrap_or_else(|error| panic!("{row}: {error}"));
            let expected = row.vector::<4>(columns);

            let exact = bend(radius);
            let spread = (bend(radius - slack) - exact).max(exact - bend(radius + slack));
            // 8 u for two roots, their quotient and the arc tangent.
            let theta2 = spread + 8.0 * U * exact;
            // The angle at the shoulder follows theta2 at the rate a2 (a1 cos + a2) / r^2; two arc tangents, their
            // difference, the wrap and the target's own error add 12 u of pi.
            let theta1 = theta2 * A2 * REACH / radius.powi(2) + 12.0 * U * PI;
            // Two sums of up to 9 rad, the target's yaw, the wrap.
            let theta4 = theta1 + theta2 + (2.0 * 9.0 + 3.0 * PI) * U;
            let mut actual = found;
            for (joint, bound) in [(0, theta1), (3, theta4)] {
                // At the seam either end of (-pi, pi] will do.
                let off = turn_between(found[joint].into(), expected[joint]);
                assert!(
                    off.abs() <= bound,
                    "{row}: {columns}{} is off by {off:e}, allowed {bound:e}",
                    joint + 1
                );
                actual[joint] = expected[joint] as f32;
            }
            // What is left in theta1 and theta4 is their rounding.
            let bound = Vector4::new(U * PI, theta2, 4.0 * U * 0.43, U * PI);
            agree(&row, columns, actual, expected, bound);

            let reached = forward(&IRB_930.geometry, &found);
            let gap = (f64::from(reached.x) - x).hypot(f64::from(reached.y) - y);
            // Radius, and a shoulder angle and a forward computation on top.
            let bound = slack + (12.0 * PI + 8.0 * PI + 2.0 * POSITION) * U * REACH;
            assert!(
                gap <= bound,
                "{row}: {elbow:?} misses the target by {gap:e} m, allowed {bound:e}"
            );

            check_limits(&row, &pose, elbow, columns, flag);
        }
    }
}

/// With limits: the table's flag, and for a refusal the first axis that the table's own solution takes past its limit.
fn check_limits(row: &Row<'_>, pose: &Pose, elbow: Elbow, columns: &str, flag: &str) {
    let result = inverse(&IRB_930, pose, elbow, &Vector4::zeros());
    assert_eq!(
        result.is_ok(),
        row.flag(flag),
        "{row}: {flag}, but found {result:?}"
    );
    let Err(error) = result else { return };
    let limits = &IRB_930.limits;
    let solution = narrow(row.vector::<4>(columns));
    let passed = Axis::ALL.into_iter().find_map(|axis| {
        let (lower, upper, value) = (
            axis.of(&limits.lower),
            axis.of(&limits.upper),
            axis.of(&solution),
        );
        let limit = if value < lower { lower } else { upper };
        (value < lower || value > upper).then_some((axis, limit))
    });
    match error {
        IkError::Limit { axis, limit, .. } => {
            assert_eq!(Some((axis, limit)), passed, "{row}: {elbow:?}")
        }
        other => panic!("{row}: {other}"),
    }
}
