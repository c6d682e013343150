//! Efforts, and the motor torques that produce them.

use super::*;

/// Checks a row of a table of dynamics with its payload.
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

    // Forward dynamics, judged by the efforts of its accelerations according to the table's own M and n.
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

        // tanh 4e-7; the relative error of its argument is 3 u, of which at most 0.45 passes on; 4 u of the result.
        let friction = drive.friction(qd);
        let expected = row.vector::<4>("tau_fric");
        let friction_bound = coulomb * (4e-7 + 2.0 * U) + expected.abs() * (6.0 * U);
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
