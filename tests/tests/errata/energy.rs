//! Errata 22, 23 and 44: the energies that Lagrange's equations start from.

use nalgebra::{Matrix4, Vector2, Vector4};
use tests::{Row, Table};

use crate::arm::{Arm, State, bound_over, largest, verdict, worst};
use crate::paper::lagrange as paper;
use crate::product::{self, Dynamics};

/// Rows without payload, which the energies of the paper do not include.
fn bare(table: &Table) -> impl Iterator<Item = Row<'_>> {
    table.rows_where("payload", "none")
}

#[test]
fn erratum_22_kinetic_energy_lacks_rotation_and_the_lift() {
    let arm = Arm::bare();
    let table = Table::load("dynamics.csv");
    let product = Dynamics::new("none");
    let unit = |angle: f64| Vector2::new(-angle.sin(), angle.cos());
    let printed = |q: &Vector4<f64>, qd: &Vector4<f64>| {
        let (q12, w12) = (q.x + q.y, qd.x + qd.y);
        let elbow = unit(q.x) * (arm.a1 * qd.x);
        let flange = elbow + unit(q12) * (arm.a2 * w12);
        let [m1, m2, m3, m4] = arm.links.map(|link| link.mass);
        paper::kinetic_energy([
            (m1, unit(q.x) * (arm.lc[0] * qd.x)),
            (m2, elbow + unit(q12) * (arm.lc[1] * w12)),
            (m3, flange),
            (m4, flange),
        ])
    };
    let errors = worst(bare(&table), |row| {
        let State { q, qd, .. } = State::of(&row);
        let energy = |m: Matrix4<f64>| 0.5 * qd.dot(&(m * qd));
        let expected = energy(row.matrix("M"));
        (
            printed(&q, &qd) - expected,
            energy(product.mass_matrix(&q)) - expected,
        )
    });
    // Theory: I w^2 / 2 of arm 2 is missing, 0.5 kg m^2 at 10 rad/s, and of arm 1 and the lift. Rounding: that of M qd,
    // which is the torque for the accelerations qd from rest, times the speeds.
    let energy_bound = bound_over(bare(&table), |row| {
        let state = State::of(&row);
        let impulse = State {
            qdd: state.qd,
            qd: Vector4::zeros(),
            ..state
        };
        product::torque_bound(&arm, &impulse) * state.qd.lp_norm(1)
    });
    verdict(22, "kinetic energy", "J", errors, 25.0, energy_bound);

    let lift = Vector4::z();
    let errors = worst(bare(&table), |row| {
        let State { q, .. } = State::of(&row);
        let mass = row.f64("M33");
        (
            2.0 * printed(&q, &lift) - mass,
            product.mass_matrix(&q)[(2, 2)] - mass,
        )
    });
    // Theory: the lift weighs nothing as printed.
    let lifted = arm.lifted_mass();
    verdict(
        22,
        "mass of the lift",
        "kg",
        errors,
        lifted * (1.0 - 1e-12),
        product::MASS_ROUNDINGS * lifted,
    );
}

#[test]
fn erratum_23_potential_energy_is_m_g_z() {
    let arm = Arm::bare();
    let table = Table::load("dynamics.csv");
    let product = Dynamics::new("none");
    let printed = |q: &Vector4<f64>| {
        let (s1, s12) = (q.x.sin(), (q.x + q.y).sin());
        let flange = arm.a1 * s1 + arm.a2 * s12;
        let [m1, m2, m3, m4] = arm.links.map(|link| link.mass);
        paper::potential_energy(
            [
                (m1, arm.lc[0] * s1),
                (m2, arm.a1 * s1 + arm.lc[1] * s12),
                (m3, flange),
                (m4, flange),
            ],
            arm.g,
        )
    };
    let step = 1e-6;
    let errors = worst(bare(&table), |row| {
        let State { q, .. } = State::of(&row);
        let gradient = Vector4::from_fn(|i, _| {
            let mut shift = Vector4::zeros();
            shift[i] = step;
            (printed(&(q + shift)) - printed(&(q - shift))) / (2.0 * step)
        });
        let expected: Vector4<f64> = row.vector("g");
        (
            largest(&(gradient - expected)),
            largest(&(product.gravity() - expected)),
        )
    });
    // Theory: as printed the lift feels no weight, and arm 2 loads the shoulder.
    let weight = arm.lifted_mass() * arm.g;
    verdict(
        23,
        "gradient of the potential",
        "N m, N",
        errors,
        weight,
        product::MASS_ROUNDINGS * weight,
    );
}

#[test]
fn erratum_44_the_lagrangian_is_a_difference() {
    let arm = Arm::bare();
    let table = Table::load("dynamics.csv");
    let product = Dynamics::new("none");
    let errors = worst(bare(&table), |row| {
        let expected: Vector4<f64> = row.vector("tau");
        let gravity: Vector4<f64> = row.vector("g");
        // With L = K + P, d/dt dL/dqd - dL/dq keeps K's part and turns the sign of P's.
        let of_kinetic_energy = expected - gravity;
        (
            (of_kinetic_energy - gravity - expected).z,
            (product.inverse(&State::of(&row)) - expected).z,
        )
    });
    // Theory: twice the weight. 1e-9 is for rounding the difference of torques of 2000 N m.
    let wrong_by = 2.0 * arm.lifted_mass() * arm.g * (1.0 - 1e-9);
    verdict(
        44,
        "tau3 from L = K.E. + P.E.",
        "N",
        errors,
        wrong_by,
        product::torque_bound_over(&arm, &table, "none"),
    );
}
