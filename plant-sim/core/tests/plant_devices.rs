//! Devices of the arm: brake, end stops, motors, encoders, payloads.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use nalgebra::Vector4;
use proptest::prelude::*;
use sim::model::{Payload, RobotModel};
use sim::plant::arm::Arm;
use sim::plant::brake::Brake;
use sim::plant::encoder::Encoder;
use sim::plant::{Energy, Plant, stop};
use std::f64::consts::TAU;

const MS: u64 = 1_000_000;
const START: [f64; 4] = [0.3, 0.8, 0.05, -1.0];
const HEAVIEST: Payload = Payload {
    mass: 22.0,
    com: [0.0, 0.0, 0.1],
    inertia: [0.2, 0.2, 0.3],
};

fn frictionless() -> RobotModel {
    let mut model = RobotModel::irb_930_22_105();
    (model.drive.viscous, model.drive.coulomb) = ([0.0; 4], [0.0; 4]);
    model
}

fn released(model: &RobotModel, q: [f64; 4]) -> Plant {
    let mut plant = Plant::new(model, q);
    plant.set_brake(false);
    plant.set_torque_enabled(true);
    plant.advance_to(Brake::RELEASE_NS);
    plant
}

fn run(plant: &mut Plant, ns: u64) {
    plant.advance_to(plant.now() + ns);
}

#[test]
fn a_closed_brake_holds_the_heaviest_payload_to_the_last_bit() {
    let mut plant = Plant::new(&RobotModel::irb_930_22_105(), START);
    plant.attach(HEAVIEST);
    run(&mut plant, 2_000 * MS);
    assert_eq!(plant.q(), START);
}

#[test]
fn a_closed_brake_holds_against_the_motor() {
    let mut plant = Plant::new(&RobotModel::irb_930_22_105(), START);
    plant.attach(HEAVIEST);
    plant.set_torque_enabled(true);
    plant.set_motor_torque([0.0, 0.0, 3.42, 0.0]);
    run(&mut plant, 500 * MS);
    assert_eq!(plant.q()[2], START[2]);
}

#[test]
fn an_overloaded_brake_slips_and_grips_again() {
    let mut plant = Plant::new(&RobotModel::irb_930_22_105(), START);
    // 860 N from the motor and 589 N of weight exceed 1.5 x 860 N.
    plant.attach(Payload {
        mass: 58.0,
        ..HEAVIEST
    });
    plant.set_torque_enabled(true);
    plant.set_motor_torque([0.0, 0.0, 3.42, 0.0]);
    run(&mut plant, 20 * MS);
    assert!(plant.qd()[2] > 0.0 && !plant.brake().is_sticking());
    plant.set_torque_enabled(false);
    run(&mut plant, 100 * MS);
    assert!(plant.brake().is_sticking());
    let rest = plant.q()[2];
    run(&mut plant, 100 * MS);
    assert_eq!(plant.q()[2], rest);
}

#[test]
fn the_brake_takes_its_time() {
    let mut plant = Plant::new(&frictionless(), START);
    plant.set_brake(false);
    plant.advance_to(Brake::RELEASE_NS - 1);
    assert!(plant.brake().is_sticking());
    plant.advance_to(Brake::RELEASE_NS);
    assert!(!plant.brake().is_closed());
    plant.set_brake(true);
    run(&mut plant, Brake::ENGAGE_NS - 1);
    assert!(!plant.brake().is_closed() && plant.qd()[2] > 0.0);
    run(&mut plant, 1);
    assert!(plant.brake().is_closed());
}

#[test]
fn a_command_taken_back_leaves_the_brake_closed() {
    let mut plant = Plant::new(&frictionless(), START);
    plant.set_brake(false);
    run(&mut plant, MS);
    plant.set_brake(true);
    run(&mut plant, 500 * MS);
    assert_eq!(plant.q(), START);
}

#[test]
fn the_brake_stops_a_falling_load_where_dry_friction_says() {
    let mut model = frictionless();
    model.drive.rotor_inertia[2] = 0.0;
    let mass = model.links[2].mass + model.links[3].mass + HEAVIEST.mass;
    let mut plant = released(&model, START);
    plant.attach(HEAVIEST);
    plant.set_brake(true);
    run(&mut plant, Brake::ENGAGE_NS);
    let (speed, place) = (plant.qd()[2], plant.q()[2]);
    let braking = plant.brake().capacity() / mass - 9.81;
    run(&mut plant, 100 * MS);
    assert!(plant.brake().is_sticking());
    // Below 10 mm/s the brake's law softens, and the last step of 0.25 ms is coarse.
    let slack = 1e-2 * 1e-2 / braking + braking * 250e-6_f64.powi(2);
    assert!((plant.q()[2] - place - 0.5 * speed * speed / braking).abs() < slack);
}

#[test]
fn an_end_stop_throws_back_three_tenths_of_the_speed() {
    // Lift alone on a spring and damper with damping ratio 0.5: contact ends when the force does, at omega_d t =
    // 2 pi / 3, with exp(-zeta / sqrt(1 - zeta^2) 2 pi / 3) of the speed. The deepest point is at omega_d t = pi / 3.
    let mut model = frictionless();
    model.gravity = 0.0;
    model.drive.rotor_inertia[2] = 0.0;
    let decay = |phase: f64| (-phase / 3.0_f64.sqrt()).exp();
    let mut plant = released(&model, [0.0, 0.5, 0.29, 0.0]);
    plant.set_max_step(10_000);
    plant.set_speed([0.0, 0.0, 1.0, 0.0]);
    let (mut deepest, mut energy) = (0.0_f64, f64::MAX);
    for _ in 0..4_000 {
        run(&mut plant, 10_000);
        deepest = deepest.max(plant.q()[2] - 0.3);
        let e = plant.energy();
        // Order 3 at 0.004 rad per step; the kink where contact begins costs one step's share.
        assert!(
            e.kinetic + e.elastic < energy + 1e-6,
            "a stop only dissipates energy"
        );
        energy = e.kinetic + e.elastic;
    }
    // Contact begins within a step, which shifts phases by at most 400 x 10 us = 0.004 rad.
    assert!(
        (deepest * 400.0 - decay(TAU / 6.0)).abs() < 0.004,
        "{deepest}"
    );
    assert!(
        (plant.qd()[2] + decay(TAU / 3.0)).abs() < 0.004,
        "{:?}",
        plant.qd()
    );
}

/// With its mass far out, beside a first link that is light, the arm meets its stops with a thirtieth of its inertia.
#[test]
fn end_stops_hold_an_arm_whose_mass_is_far_out() {
    let mut model = RobotModel::irb_930_22_105();
    model.links[0].mass = 2.0;
    model.links[1].com[0] = 5.2;
    assert!((10_000..Plant::MAX_STEP_NS).contains(&stop::resolvable_step(&model)));
    let torque = model.drive.motor_torque_limit;
    for [shoulder, elbow] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
        let mut plant = released(&model, START);
        plant.set_motor_torque([shoulder * torque[0], elbow * torque[1], 0.0, 0.0]);
        let (mut balance, mut most) = (0.0_f64, 0.0_f64);
        let of = |e: Energy| e.kinetic + e.potential + e.elastic + e.lost - e.motor_work;
        let begin = of(plant.energy());
        for _ in 0..6_000 {
            run(&mut plant, MS);
            for (axis, q) in plant.q().into_iter().enumerate() {
                let beyond = (q - model.limits.upper[axis]).max(model.limits.lower[axis] - q);
                // NaN is not below.
                assert!(beyond < 0.1, "axis {axis} is {beyond} beyond its limit");
            }
            most = most.max(plant.energy().kinetic);
            balance = balance.max((of(plant.energy()) - begin).abs());
        }
        // A step of one time constant of the damper has an error of 1/24 of its loss.
        assert!(balance < 0.1 * most, "{balance} of {most} J");
    }
}

#[test]
fn end_stops_hold_every_axis_at_full_torque() {
    let model = RobotModel::irb_930_22_105();
    for axis in 0..4 {
        for sign in [1.0, -1.0] {
            let mut plant = released(&model, START);
            let mut torque = [0.0; 4];
            torque[axis] = sign * model.drive.motor_torque_limit[axis];
            if axis == 3 {
                // The nut follows, otherwise the shaft would screw itself.
                let lift = plant
                    .drive()
                    .motor_torque(&Vector4::new(0.0, 0.0, 0.0, 20.0 * sign));
                torque = lift.into();
            }
            plant.set_motor_torque(torque);
            let top = model.drive.motor_speed_limit[axis] * 1.05
                / plant.drive().to_motor(&Vector4::ith(axis, 1.0))[axis];
            for _ in 0..1_000 {
                run(&mut plant, MS);
                let beyond = (plant.q()[axis] - model.limits.upper[axis])
                    .max(model.limits.lower[axis] - plant.q()[axis]);
                assert!(beyond < top / 400.0, "axis {axis}: {beyond}");
            }
            let limit = if sign > 0.0 {
                model.limits.upper[axis]
            } else {
                model.limits.lower[axis]
            };
            assert!(
                (plant.q()[axis] - limit).abs() < top / 400.0,
                "axis {axis} did not arrive: {:?}",
                plant.q()
            );
        }
    }
}

#[test]
fn a_motor_runs_no_faster_than_its_taper() {
    let mut model = frictionless();
    (model.limits.lower[0], model.limits.upper[0]) = (-1e3, 1e3);
    let mut plant = released(&model, START);
    plant.set_motor_torque([8.0, 0.0, 0.0, 0.0]);
    // The elbow is held by inertia alone; 64 rad/s2 and more reach 628 rad/s at the motor within 200 ms.
    run(&mut plant, 400 * MS);
    let speed = plant.drive().to_motor(&plant.qd().into())[0];
    assert!(
        speed > 628.3 * 0.9 && speed < 628.3 * 1.05 + 1e-9,
        "{speed}"
    );
}

#[test]
fn saturation_is_told_and_nonsense_is_zero() {
    let mut plant = released(&RobotModel::irb_930_22_105(), START);
    assert_eq!(
        plant.set_motor_torque([8.0, -9.0, f64::NAN, f64::NEG_INFINITY]),
        [false, true, true, true]
    );
    assert_eq!(plant.motor_torque(), [8.0, -8.0, 0.0, -1.5]);
    plant.set_torque_enabled(false);
    assert_eq!(plant.motor_torque(), [0.0; 4]);
    plant.set_torque_enabled(true);
    // Beyond the taper a motor brakes at full torque and does not drive.
    plant.set_speed([628.3 * 1.06 / 80.0, 0.0, 0.0, 0.0]);
    assert_eq!(
        plant.set_motor_torque([1.0, 0.0, 0.0, 0.0]),
        [true, false, false, false]
    );
    assert_eq!(plant.motor_torque()[0], 0.0);
    assert_eq!(plant.set_motor_torque([-8.0, 0.0, 0.0, 0.0]), [false; 4]);
}

#[test]
fn a_sample_holds_the_mean_torque_since_the_last() {
    let mut plant = released(&RobotModel::irb_930_22_105(), START);
    plant.latch();
    plant.set_motor_torque([1.0, 0.0, -0.2, 0.0]);
    run(&mut plant, MS / 4);
    plant.set_motor_torque([3.0, 0.0, -0.2, 0.0]);
    run(&mut plant, 3 * MS / 4);
    let mean = Vector4::from(plant.latch().motor_torque);
    assert!(
        (mean - Vector4::new(2.5, 0.0, -0.2, 0.0)).amax() < 1e-12,
        "{mean}"
    );
    assert_eq!(
        plant.latch().motor_torque,
        [3.0, 0.0, -0.2, 0.0],
        "no time has passed: the present torque"
    );
}

#[test]
fn payloads_come_and_go() {
    let model = RobotModel::irb_930_22_105();
    let mut plant = Plant::new(&model, START);
    plant.attach(HEAVIEST);
    assert_eq!(plant.arm(), &Arm::new(&model, Some(&HEAVIEST)));
    let mass = |plant: &Plant| plant.arm().mass_matrix(&plant.arm().at(&START.into()))[(2, 2)];
    let loaded = mass(&plant);
    plant.release();
    assert_eq!(plant.arm(), &Arm::new(&model, None));
    assert!((loaded - mass(&plant) - 22.0).abs() < 1e-14 * loaded);
}

#[test]
fn turning_the_wrist_alone_screws_the_shaft() {
    // With motor 3 standing still, a turn of axis 4 moves the lift by one lead: the coupling of the spline shaft.
    let plant = Plant::new(&RobotModel::irb_930_22_105(), START);
    let q = plant
        .drive()
        .to_joint(&Vector4::new(0.0, 0.0, 0.0, 20.0 * TAU));
    assert!((q - Vector4::new(0.0, 0.0, -0.025, TAU)).amax() < 1e-15);
}

#[test]
fn an_encoder_wraps_as_its_register_does() {
    let encoder = Encoder::new(131_072);
    assert_eq!(encoder.counts(16_384.0 * TAU), i32::MIN);
    assert_eq!(encoder.counts(-16_384.0 * TAU), i32::MIN);
    assert_eq!(encoder.counts(16_383.0 * TAU), i32::MAX - 131_071);
}

proptest! {
    #[test]
    fn an_encoder_is_off_by_half_a_count(angle in -1e4..1e4f64, counts in 1u32..1_000_000) {
        let encoder = Encoder::new(counts);
        prop_assume!(angle.abs() / TAU * f64::from(counts) < f64::from(i32::MAX));
        let error = encoder.angle(encoder.counts(angle)) - angle;
        prop_assert!(error.abs() <= 0.5 * TAU / f64::from(counts) + 4.0 * f64::EPSILON * angle.abs());
        prop_assert_eq!(encoder.counts(encoder.angle(encoder.counts(angle))), encoder.counts(angle));
    }
}
