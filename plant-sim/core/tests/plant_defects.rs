//! Broken parts of the robot against closed forms.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use sim::model::{Payload, RobotModel};
use sim::plant::Plant;
use sim::plant::brake::Brake;
use sim::plant::defect::{BrakeDefect, EncoderDefect, LoadDefect, MotorDefect};

const MS: u64 = 1_000_000;

fn plant() -> Plant {
    Plant::new(&RobotModel::irb_930_22_105(), [0.2, 0.8, 0.1, 0.0])
}

/// First order: at constant speed v the reading is behind by v T (1 - exp(-t / T)). The shoulder coasts; friction slows it, so its
/// way is taken from the true readings, and a discrete convolution with the exponential, a thousand times finer, is the oracle.
#[test]
fn a_slow_encoder_follows_with_its_time_constant() {
    let constant = 0.02;
    let mut plant = plant();
    plant.set_speed([3.0, 0.0, 0.0, 0.0]);
    plant.break_encoder(0, EncoderDefect::Slow(constant), 0, true);
    let mut exact = f64::from(plant.encoder_counts()[0]);
    let mut before = exact;
    for sample in 1..=100_u64 {
        plant.advance_to(sample * MS);
        let right = f64::from(plant.encoder_counts()[0]);
        let steps = 1000;
        for step in 0..steps {
            let at = before + (right - before) * (f64::from(step) + 0.5) / f64::from(steps);
            exact += (at - exact) * (1e-3 / f64::from(steps) / constant);
        }
        before = right;
        let reading = f64::from(plant.latch().counts[0]);
        // Half a count, and the error of the sum.
        assert!(
            (reading - exact).abs() < 0.5 + 1e-4 * (right - exact).abs() + 1.0,
            "{sample}: {reading} {exact}"
        );
    }
    // Repaired, it is right at once.
    plant.break_encoder(0, EncoderDefect::Slow(constant), 0, false);
    assert_eq!(plant.latch().counts, plant.encoder_counts());
    plant.break_encoder(0, EncoderDefect::Slow(0.0), 0, true);
    plant.advance_to(110 * MS);
    assert_eq!(plant.latch().counts, plant.encoder_counts());
}

/// It opens later by the time that is said, and closes later.
#[test]
fn a_slow_brake_takes_longer() {
    let mut plant = plant();
    plant.break_brake(BrakeDefect::Slow(0.2), true);
    plant.set_brake(false);
    let due = Brake::RELEASE_NS + 200 * MS;
    plant.advance_to(due - 1);
    assert!(plant.brake().is_closed());
    plant.advance_to(due);
    assert!(!plant.brake().is_closed());
    plant.set_brake(true);
    plant.advance_to(due + Brake::ENGAGE_NS + 200 * MS - 1);
    assert!(!plant.brake().is_closed());
    plant.advance_to(due + Brake::ENGAGE_NS + 200 * MS);
    assert!(plant.brake().is_closed());
}

/// Free fall: the lift goes down with its weight over its mass and that of its rotor, less the friction, which is that of the model.
#[test]
fn a_brake_that_is_stuck_open_lets_the_lift_fall() {
    let mut model = RobotModel::irb_930_22_105();
    model.drive.coulomb = [0.0; 4];
    model.drive.viscous = [0.0; 4];
    let mut plant = Plant::new(&model, [0.2, 0.8, 0.1, 0.0]);
    plant.break_brake(BrakeDefect::StuckOpen, true);
    plant.set_brake(true);
    plant.advance_to(100 * MS);
    let mass = model.links[2].mass + model.links[3].mass;
    let rotor = plant.drive().rotor_inertia();
    // Its nut turns the shaft as well: the other axes give way. Without that coupling the wrist would stand.
    let fall = plant.q()[2] - 0.1;
    let free = 0.5 * mass * model.gravity / (mass + rotor[(2, 2)]) * 0.01;
    assert!(
        fall >= free * 0.999 && fall < 0.5 * model.gravity * 0.01,
        "{fall} {free}"
    );
    // Repaired, it does what it was told.
    plant.break_brake(BrakeDefect::StuckOpen, false);
    plant.advance_to(300 * MS);
    assert!(plant.brake().is_closed() && plant.brake().is_sticking());
}

#[test]
fn a_brake_that_is_stuck_closed_holds() {
    let mut plant = plant();
    plant.set_brake(false);
    plant.advance_to(60 * MS);
    plant.break_brake(BrakeDefect::StuckClosed, true);
    plant.set_brake(false);
    plant.advance_to(200 * MS);
    assert!(plant.brake().is_sticking());
    plant.break_brake(BrakeDefect::StuckClosed, false);
    plant.advance_to(260 * MS);
    assert!(!plant.brake().is_closed());
}

/// The weight at the lift grows by the mass times g, and is what it was afterwards.
#[test]
fn a_heavier_payload_weighs_more() {
    let payload = Payload {
        mass: 2.0,
        com: [0.01, 0.0, 0.05],
        inertia: [0.008, 0.008, 0.01],
    };
    let weight = |plant: &Plant| plant.arm().gravity(&plant.arm().at(&plant.q().into()))[2];
    for carried in [None, Some(payload)] {
        let mut plant = plant();
        carried
            .into_iter()
            .for_each(|payload| plant.attach(payload));
        let before = weight(&plant);
        plant.disturb_load(LoadDefect::Heavier(3.0), true);
        let g = RobotModel::irb_930_22_105().gravity;
        assert!((before - weight(&plant) - 3.0 * g).abs() < 1e-9);
        assert_eq!(
            plant.payload().copied(),
            carried,
            "what was meant is the same"
        );
        plant.disturb_load(LoadDefect::Heavier(3.0), false);
        assert_eq!(weight(&plant), before);
    }
}

/// The energy balance closes with that of the spring, which is half of its stiffness times the square of the way.
#[test]
fn a_spring_takes_up_the_energy_of_the_arm() {
    let mut plant = plant();
    plant.set_brake(false);
    plant.advance_to(60 * MS);
    plant.set_speed([1.0, -2.0, 0.3, 0.0]);
    plant.disturb_load(LoadDefect::Caught(20_000.0), true);
    let pose = plant.pose();
    let sum = |plant: &Plant| {
        let energy = plant.energy();
        energy.kinetic + energy.potential + energy.elastic - energy.motor_work + energy.lost
    };
    let (before, kinetic) = (sum(&plant), plant.energy().kinetic);
    let mut most: f64 = 0.0;
    for sample in 61..160 {
        plant.advance_to(sample * MS);
        let now = plant.pose();
        let way = (now.x - pose.x).powi(2) + (now.y - pose.y).powi(2) + (now.z - pose.z).powi(2);
        assert!((plant.energy().elastic - 0.5 * 20_000.0 * way).abs() < 1e-9);
        assert!(
            (sum(&plant) - before).abs() < 2e-3 * kinetic,
            "{sample}: {} {before}",
            sum(&plant)
        );
        most = most.max(plant.energy().elastic);
    }
    assert!(most > 0.1 * kinetic, "{most} of {kinetic}");
}

/// The nut of the ball screw sits on the shaft that the wrist turns: by virtual work the wrist has the torque of both motors, each of which
/// keeps to its limit.
#[test]
fn a_runaway_motor_keeps_to_its_limit_and_the_wrist_has_two() {
    let model = RobotModel::irb_930_22_105();
    let mut plant = plant();
    let limit = model.drive.motor_torque_limit;
    plant.set_torque_enabled(true);
    plant.set_motor_torque([0.0, 0.0, 2.0 * limit[2], 0.0]);
    plant.break_motor(3, MotorDefect::Runaway, true);
    assert_eq!(plant.motor_torque(), [0.0, 0.0, limit[2], limit[3]]);
    let wrist = plant.joint_effort()[3];
    let own = limit[3] * model.drive.gear_ratio[3];
    let nut = limit[2] * model.drive.gear_ratio[2] * model.drive.screw_hand;
    assert!((own - model.limits.effort[3]).abs() < 1e-12);
    assert!((wrist - own - nut).abs() < 1e-12, "{wrist} {own} {nut}");
    assert!(wrist > 1.1 * model.limits.effort[3], "{wrist}");
}

/// Whatever is broken in the same place is broken together, and each part of it ends by itself.
#[test]
fn defects_of_the_same_part_add_up() {
    let mut plant = plant();
    plant.set_speed([3.0, 0.0, 0.0, 0.0]);
    let stuck = plant.encoder_counts()[0];
    plant.break_encoder(0, EncoderDefect::Stuck, 0, true);
    plant.break_encoder(0, EncoderDefect::Jump(0.5), 0, true);
    plant.break_encoder(0, EncoderDefect::BitLost(0), 0, true);
    plant.advance_to(20 * MS);
    let drive = RobotModel::irb_930_22_105().drive;
    let turns = 0.5 * drive.gear_ratio[0] / std::f64::consts::TAU;
    let off = (turns * f64::from(drive.encoder_counts)).round() as i32;
    assert_eq!(plant.latch().counts[0], (stuck + off) & !1);
    plant.break_encoder(0, EncoderDefect::Jump(0.5), 0, false);
    assert_eq!(plant.latch().counts[0], stuck & !1);
    plant.break_encoder(0, EncoderDefect::Stuck, 0, false);
    assert_eq!(plant.latch().counts[0], plant.encoder_counts()[0] & !1);

    plant.set_torque_enabled(true);
    plant.break_motor(1, MotorDefect::Runaway, true);
    plant.break_motor(1, MotorDefect::Weak(0.5), true);
    let peak = drive.motor_torque_limit[1];
    assert_eq!(plant.motor_torque()[1], 0.5 * peak);
    plant.break_motor(1, MotorDefect::Dip, true);
    plant.break_motor(1, MotorDefect::Runaway, false);
    assert!(plant.has_dip());
    plant.break_motor(1, MotorDefect::Dip, false);
    assert!(!plant.has_dip());
    plant.set_motor_torque([0.0, 0.1 * peak, 0.0, 0.0]);
    assert_eq!(plant.motor_torque()[1], 0.1 * peak * 0.5);

    let weight = |plant: &Plant| plant.arm().gravity(&plant.arm().at(&plant.q().into()))[2];
    let (before, g) = (weight(&plant), RobotModel::irb_930_22_105().gravity);
    for kg in [3.0, 4.0] {
        plant.disturb_load(LoadDefect::Heavier(kg), true);
    }
    assert!((before - weight(&plant) - 7.0 * g).abs() < 1e-9);
    plant.disturb_load(LoadDefect::Heavier(3.0), false);
    assert!((before - weight(&plant) - 4.0 * g).abs() < 1e-9);
}

/// A brake that is stuck open stays so while it is slow as well, and after that.
#[test]
fn a_brake_is_stuck_as_long_as_one_defect_says_so() {
    let mut plant = plant();
    plant.break_brake(BrakeDefect::StuckOpen, true);
    plant.break_brake(BrakeDefect::Slow(0.1), true);
    plant.set_brake(true);
    plant.advance_to(500 * MS);
    assert!(!plant.brake().is_closed());
    plant.break_brake(BrakeDefect::StuckClosed, true);
    assert!(plant.brake().is_closed());
    plant.break_brake(BrakeDefect::StuckClosed, false);
    assert!(!plant.brake().is_closed());
    plant.break_brake(BrakeDefect::StuckOpen, false);
    let due = 500 * MS + Brake::ENGAGE_NS + 100 * MS;
    plant.advance_to(due - 1);
    assert!(!plant.brake().is_closed());
    plant.advance_to(due);
    assert!(plant.brake().is_closed());
}
