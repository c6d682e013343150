//! Errata 24, 25, 27 to 29 and 49: the joint torques of eq. 40-43 against those of the arm.

use nalgebra::Vector4;
use tests::{Row, Table};

use crate::arm::{Arm, State, bound_over, largest, verdict, worst};
use crate::paper::lagrange as paper;
use crate::product::{self, Dynamics};

/// Parameters of the arm in eq. 40-43. Table 1 has no a3: the length of link 3 is zero.
pub(crate) fn given(arm: &Arm) -> paper::Given {
    paper::Given {
        m: [arm.links[0].mass, arm.links[1].mass, arm.links[2].mass],
        a: [arm.a1, arm.a2, 0.0],
        g: arm.g,
    }
}

/// Eq. 40-43 evaluated at a state.
pub(crate) fn as_printed(given: &paper::Given, state: &State) -> Vector4<f64> {
    let rates = state.qd.xy();
    paper::eq_40_to_43(given, &state.q, &rates, &rates)
}

fn at_rest(state: &State) -> State {
    State {
        qd: Vector4::zeros(),
        qdd: Vector4::zeros(),
        ..*state
    }
}

/// The arm without payload, to which eq. 40-43 come closest, in f64 and as the controller has it, and its table.
pub(crate) fn empty_flange() -> (Arm, Table, Dynamics) {
    (
        Arm::bare(),
        Table::load("dynamics.csv"),
        Dynamics::new("none"),
    )
}

/// The rows without payload.
pub(crate) fn bare(table: &Table) -> impl Iterator<Item = Row<'_>> {
    table.rows_where("payload", "none")
}

#[test]
fn erratum_24_velocities_stand_where_accelerations_belong() {
    let (arm, table, product) = empty_flange();
    let errors = worst(bare(&table), |row| {
        let state = State::of(&row);
        let expected: Vector4<f64> = row.vector("tau");
        (
            largest(&(as_printed(&given(&arm), &state) - expected)),
            largest(&(product.inverse(&state) - expected)),
        )
    });
    // Order of magnitude: torques reach 2000 N m, and as printed none of it depends on acceleration.
    verdict(
        24,
        "torque, eq. 40-43",
        "N m, N",
        errors,
        500.0,
        product::torque_bound_over(&arm, &table, "none"),
    );

    // Theory: with time in half-seconds, rates double, accelerations and gravity quadruple, and so must torque.
    let hasty = Dynamics::with_gravity(4.0 * arm.g);
    let errors = worst(bare(&table), |row| {
        let state = State::of(&row);
        let faster = State {
            qd: state.qd * 2.0,
            qdd: state.qdd * 4.0,
            ..state
        };
        let heavy = paper::Given {
            g: 4.0 * arm.g,
            ..given(&arm)
        };
        (
            largest(&(as_printed(&heavy, &faster) - as_printed(&given(&arm), &state) * 4.0)),
            largest(&(hasty.inverse(&faster) - product.inverse(&state) * 4.0)),
        )
    });
    // A term a1^2 m1 thd alone is off by twice its value, 50 N m at full speed.
    verdict(
        24,
        "torque after doubling the unit of frequency",
        "N m, N",
        errors,
        50.0,
        8.0 * product::torque_bound_over(&arm, &table, "none"),
    );
}

#[test]
fn erratum_25_gravity_does_not_act_on_the_horizontal_joints() {
    let (arm, table, product) = empty_flange();
    let errors = worst(bare(&table), |row| {
        let rest = at_rest(&State::of(&row));
        let expected: Vector4<f64> = row.vector("g");
        (
            largest(&(as_printed(&given(&arm), &rest) - expected).xy()),
            largest(&(product.inverse(&rest) - expected).xy()),
        )
    });
    // Theory: eq. 40 puts 3 a2 m2 g and more on the shoulder; at these states at least one a2 m2 g. The true value is
    // zero, and the controller has no term to round.
    verdict(
        25,
        "tau1, tau2 at rest",
        "N m",
        errors,
        arm.a2 * arm.links[1].mass * arm.g,
        0.0,
    );
}

#[test]
fn erratum_27_there_is_no_third_link_length() {
    let (arm, table, product) = empty_flange();
    let errors = worst(bare(&table), |row| {
        let state = State::of(&row);
        let expected = row.f64("tau4");
        (
            as_printed(&given(&arm), &state).w - expected,
            product.inverse(&state).w - expected,
        )
    });
    let largest = bound_over(bare(&table), |row| row.f64("tau4"));
    // Theory: every term of eq. 43 has the factor a3, so with a3 = 0 of Table 1 the wrist takes no torque at all.
    verdict(
        27,
        "tau4 with a3 = 0",
        "N m",
        errors,
        largest,
        product::wrist_bound(&arm, &table, "none"),
    );
}

#[test]
fn erratum_28_the_lift_takes_a_force() {
    let (arm, table, product) = empty_flange();
    let weight = arm.lifted_mass() * arm.g;
    let errors = worst(bare(&table), |row| {
        let rest = at_rest(&State::of(&row));
        let expected = row.f64("g3");
        (
            as_printed(&given(&arm), &rest).z - expected,
            product.inverse(&rest).z - expected,
        )
    });
    // Theory: -a2 m2 g cos(theta1 + theta2) for -(m3 + m4) g; over all angles they differ by the sum of the two.
    let moment = arm.a2 * arm.links[1].mass * arm.g;
    verdict(
        28,
        "tau3 at rest",
        "N",
        errors,
        0.9 * (moment + weight),
        product::MASS_ROUNDINGS * weight,
    );

    // Theory: weight does not depend on the length of the arms; a moment is proportional to it.
    let longer = paper::Given {
        a: [2.0 * arm.a1, 2.0 * arm.a2, 0.0],
        ..given(&arm)
    };
    let stretched = Dynamics::stretched(2.0);
    let errors = worst(bare(&table), |row| {
        let rest = at_rest(&State::of(&row));
        (
            as_printed(&longer, &rest).z - as_printed(&given(&arm), &rest).z,
            stretched.inverse(&rest).z - product.inverse(&rest).z,
        )
    });
    verdict(
        28,
        "tau3 at rest after doubling the arms",
        "N",
        errors,
        0.9 * moment,
        0.0,
    );
}

#[test]
fn erratum_29_the_wrist_feels_inertia_and_no_gravity() {
    let arm = Arm::with_payload("p10");
    let table = Table::load("dynamics.csv");
    let product = Dynamics::new("p10");
    let a3 = 0.1;
    let with_a3 = paper::Given {
        a: [arm.a1, arm.a2, a3],
        ..given(&arm)
    };
    let errors = worst(table.rows_where("payload", "p10"), |row| {
        let rest = at_rest(&State::of(&row));
        let expected = row.f64("g4");
        (
            as_printed(&with_a3, &rest).w - expected,
            product.inverse(&rest).w - expected,
        )
    });
    // Theory: a3 m3 g cos(theta1 + theta2) at rest; the true value is zero.
    verdict(
        29,
        "tau4 at rest with an a3 of 0.1 m",
        "N m",
        errors,
        0.9 * a3 * arm.links[2].mass * arm.g,
        0.0,
    );

    // The correct equation instead: (I4 + Ip) (thdd4 - thdd1 - thdd2).
    let errors = worst(table.rows_where("payload", "p10"), |row| {
        let state = State::of(&row);
        let expected = row.f64("tau4");
        let inertia = arm.links[3].inertia[(2, 2)];
        let closed = inertia * (state.qdd.w - state.qdd.x - state.qdd.y);
        assert!(
            (closed - expected).abs() <= 1e-12 * expected.abs().max(1.0),
            "{row}"
        );
        (
            as_printed(&with_a3, &state).w - expected,
            product.inverse(&state).w - expected,
        )
    });
    // Theory: 0.05 kg m^2 at hundreds of rad/s^2.
    verdict(
        29,
        "tau4 of a 10 kg payload",
        "N m",
        errors,
        10.0,
        product::wrist_bound(&arm, &table, "p10"),
    );
}

#[test]
fn erratum_49_shaft_and_payload_are_missing() {
    let table = Table::load("dynamics.csv");
    let (empty, loaded) = (Dynamics::new("none"), Dynamics::new("p10"));
    let pairs = bare(&table).zip(table.rows_where("payload", "p10"));
    let errors = worst(pairs, |(without, with)| {
        assert_eq!(
            without.text("id"),
            with.text("id"),
            "the table pairs its states"
        );
        let expected: Vector4<f64> = with.vector::<4>("tau") - without.vector::<4>("tau");
        let state = State::of(&with);
        // Eq. 40-43 have no symbol for it: their result does not change.
        (
            largest(&expected),
            largest(&(loaded.inverse(&state) - empty.inverse(&state) - expected)),
        )
    });
    let arm = Arm::with_payload("p10");
    let bound = product::torque_bound_over(&arm, &table, "p10");
    // Theory: at least the weight of 10 kg.
    verdict(
        49,
        "torque for a payload of 10 kg",
        "N m, N",
        errors,
        98.1,
        2.0 * bound,
    );
}
