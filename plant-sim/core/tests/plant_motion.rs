//! The plant over time, against conservation laws and closed forms.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use nalgebra::Vector4;
use sim::model::{Payload, RobotModel};
use sim::plant::Plant;
use sim::plant::brake::Brake;

const MS: u64 = 1_000_000;
const START: [f64; 4] = [0.3, 0.8, 0.02, -1.0];
const ECCENTRIC: Payload = Payload {
    mass: 5.0,
    com: [0.05, -0.03, 0.06],
    inertia: [0.012, 0.01, 0.015],
};

fn frictionless() -> RobotModel {
    let mut model = RobotModel::irb_930_22_105();
    (model.drive.viscous, model.drive.coulomb) = ([0.0; 4], [0.0; 4]);
    model
}

/// A robot whose lift is a lone mass: no rotor couples it to axis 4.
fn lone_lift(model: RobotModel) -> RobotModel {
    let mut model = model;
    model.drive.rotor_inertia[2] = 0.0;
    model
}

/// Mass moved by the lift, kg.
fn lift_mass(model: &RobotModel) -> f64 {
    model.links[2].mass + model.links[3].mass
}

/// A robot at rest at `q` with its brake just opened and its motors on; its time is [`Brake::RELEASE_NS`].
fn released(model: &RobotModel, q: [f64; 4]) -> Plant {
    let mut plant = Plant::new(model, q);
    plant.set_brake(false);
    plant.set_torque_enabled(true);
    plant.advance_to(Brake::RELEASE_NS);
    assert_eq!(plant.q(), q, "nothing moves a braked arm");
    plant
}

fn run(plant: &mut Plant, ns: u64) {
    plant.advance_to(plant.now() + ns);
}

/// In free motion: all axes moving, an eccentric payload, no torque.
fn thrown(model: &RobotModel) -> Plant {
    let mut plant = released(model, START);
    plant.attach(ECCENTRIC);
    plant.set_speed([3.0, -5.0, 0.2, 10.0]);
    plant
}

/// Relative error allowed for the default step in `seconds` of [`thrown`]: order 3, fastest motion is the rotation of
/// the payload relative to the arm at less than 20 rad/s, and the error constants are below one.
fn step_error(seconds: f64) -> f64 {
    let rate = 20.0;
    (rate * Plant::MAX_STEP_NS as f64 * 1e-9).powi(3) * rate * seconds
}

#[test]
fn energy_is_kept_without_friction() {
    let mut plant = thrown(&frictionless());
    let total = |plant: &Plant| plant.energy().kinetic + plant.energy().potential;
    let (before, kinetic) = (total(&plant), plant.energy().kinetic);
    run(&mut plant, 200 * MS);
    let drift = (total(&plant) - before).abs() / kinetic;
    assert!(drift < step_error(0.2), "{drift:e}");
    assert_eq!((plant.energy().motor_work, plant.energy().lost), (0.0, 0.0));
}

#[test]
fn momentum_about_axis_1_is_kept_without_friction() {
    // No torque acts about axis 1, and turning the whole robot changes nothing: theta1 is cyclic.
    let momentum = |plant: &Plant| {
        let mass = plant.arm().mass_matrix(&plant.arm().at(&plant.q().into()))
            + plant.drive().rotor_inertia();
        (mass * Vector4::from(plant.qd()))[0]
    };
    let mut plant = thrown(&frictionless());
    let before = momentum(&plant);
    run(&mut plant, 200 * MS);
    let drift = (momentum(&plant) / before - 1.0).abs();
    assert!(drift < step_error(0.2), "{drift:e}");
}

/// State after 100 ms at a given step, of this robot with or without friction.
fn state_after(model: &RobotModel, step: u64) -> nalgebra::SVector<f64, 8> {
    let mut plant = thrown(model);
    plant.set_max_step(step);
    run(&mut plant, 100 * MS);
    nalgebra::SVector::from_iterator(plant.q().into_iter().chain(plant.qd()))
}

#[test]
fn integration_is_of_order_three_with_and_without_friction() {
    for model in [frictionless(), RobotModel::irb_930_22_105()] {
        let exact = state_after(&model, 10_000);
        let error = |step| (state_after(&model, step) - exact).norm();
        for step in [500_000, 250_000] {
            // Half the step, an eighth of the error; half an order either way for the next term of the series.
            let ratio = error(step) / error(step / 2);
            assert!((5.7..11.3).contains(&ratio), "{step} ns: {ratio}");
        }
    }
}

#[test]
fn a_free_lift_falls_with_g() {
    let mut plant = released(&lone_lift(frictionless()), [0.0, 0.5, 0.01, 0.0]);
    run(&mut plant, 150 * MS);
    // The method is exact on parabolas: 600 steps of rounding.
    assert!((plant.q()[2] - (0.01 + 0.5 * 9.81 * 0.15_f64.powi(2))).abs() < 600.0 * f64::EPSILON);
    assert!((plant.qd()[2] - 9.81 * 0.15).abs() < 600.0 * f64::EPSILON * 2.0);
}

#[test]
fn a_damped_lift_approaches_its_terminal_speed() {
    let mut model = lone_lift(frictionless());
    model.drive.viscous[2] = 40.0;
    let (mass, rate) = (lift_mass(&model), 40.0 / lift_mass(&model));
    let mut plant = released(&model, [0.0, 0.5, 0.01, 0.0]);
    run(&mut plant, 200 * MS);
    let terminal = mass * 9.81 / 40.0;
    let speed = terminal * (1.0 - (-rate * 0.2).exp());
    // The error of each step is less than (rate h)^4 of the deviation from the terminal speed.
    let bound = 800.0 * (rate * 250e-6).powi(4) * terminal;
    assert!(
        (plant.qd()[2] - speed).abs() < bound,
        "{:e}, bound {bound:e}",
        plant.qd()[2] - speed
    );
}

#[test]
fn energy_is_accounted_for_in_rough_use() {
    // All axes driven back and forth at full torque, through friction, into the end stops, including the brake.
    let imbalance = |step: u64| {
        let mut plant = released(&RobotModel::irb_930_22_105(), START);
        plant.attach(ECCENTRIC);
        plant.set_max_step(step);
        let balance = |plant: &Plant| {
            let e = plant.energy();
            e.kinetic + e.potential + e.elastic - e.motor_work + e.lost
        };
        let before = balance(&plant);
        for k in 0..40 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            plant.set_motor_torque([8.0 * sign, -8.0 * sign, 2.0 * sign, 0.5]);
            plant.set_brake(k % 8 == 5);
            run(&mut plant, 50 * MS);
        }
        ((balance(&plant) - before) / plant.energy().lost).abs()
    };
    // Where a force has a kink - a reversal, a stop, the brake - a step is only of order 1. A kink in every
    // 50 ms costs at most one step's share of the energy, and halving the step four times must at least halve it twice.
    let (coarse, fine) = (imbalance(250_000), imbalance(15_625));
    assert!(coarse < 0.25 / 50.0, "{coarse:e}");
    assert!(fine < coarse / 4.0, "{coarse:e} {fine:e}");
}

#[test]
fn friction_stops_an_axis_where_coulomb_says_and_keeps_it_there() {
    // From the model's own 1 mm/s to a law ten thousand times steeper: 1e8 1/s, hopeless for an explicit method.
    for eps in [1e-3, 1e-5, 1e-7] {
        let mut model = lone_lift(frictionless());
        model.gravity = 0.0;
        (model.drive.coulomb[2], model.drive.coulomb_eps[2]) = (20.0, eps);
        let deceleration = 20.0 / lift_mass(&model);
        let mut plant = released(&model, [0.0, 0.5, 0.01, 0.0]);
        plant.set_speed([0.0, 0.0, 1.0, 0.0]);
        run(&mut plant, 500 * MS);
        // The end of the motion is within one step, and is delayed by the time in which tanh builds up.
        let distance = 0.5 / deceleration;
        let error = (plant.q()[2] - 0.01 - distance).abs();
        assert!(
            error < 2.0 * deceleration * 250e-6_f64.powi(2) + eps * 0.5,
            "{eps}: {error:e}"
        );
        assert!(
            plant.qd()[2].abs() < eps * 1e-3,
            "{eps}: {:e}",
            plant.qd()[2]
        );
    }
}

#[test]
fn steep_friction_carries_a_load_without_chatter() {
    let mut model = lone_lift(frictionless());
    (model.drive.coulomb[2], model.drive.coulomb_eps[2]) = (25.0, 1e-5);
    let load = lift_mass(&model) * 9.81 / 25.0;
    let mut plant = released(&model, START);
    run(&mut plant, 10 * MS);
    for _ in 0..100 {
        run(&mut plant, MS);
        // The law itself lets a loaded axis creep at tanh(v / eps) = load / level, and there must be no more than that.
        let creep = 1e-5 * load.atanh();
        assert!(
            (plant.qd()[2] - creep).abs() < 1e-3 * creep,
            "{:e} {creep:e}",
            plant.qd()[2]
        );
    }
}

#[test]
fn chopping_time_at_the_step_changes_nothing() {
    let mut whole = thrown(&RobotModel::irb_930_22_105());
    let mut chopped = whole.clone();
    run(&mut whole, 200 * Plant::MAX_STEP_NS);
    for _ in 0..200 {
        run(&mut chopped, Plant::MAX_STEP_NS);
    }
    assert_eq!(
        (whole.q(), whole.qd(), whole.energy()),
        (chopped.q(), chopped.qd(), chopped.energy())
    );
    whole.advance_to(whole.now() - MS);
    assert_eq!(whole.q(), chopped.q(), "time does not run backwards");
}
