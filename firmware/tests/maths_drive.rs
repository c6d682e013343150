//! Properties of the drive train: the two directions are inverses, power is conserved, and friction only dissipates it.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::{U, acceleration, assert_close, position, speed, within};
use firmware::mechanics::arm::{DriveTrain, IRB_930};
use firmware::mechanics::dynamics::drive::Drive;
use nalgebra::{Matrix4, Vector4};
use proptest::prelude::*;

/// The IRB 930's drive train with a gear on the lift, and a screw of either hand.
fn train() -> impl Strategy<Value = DriveTrain> {
    (prop_oneof![Just(1.0f32), Just(-1.0f32)], 0.5..=4.0f32).prop_map(|(screw_hand, lift_gear)| {
        let mut train = DriveTrain {
            screw_hand,
            ..IRB_930.drive
        };
        train.gear_ratio.z = lift_gear;
        train
    })
}

fn torque() -> impl Strategy<Value = Vector4<f32>> {
    within(IRB_930.drive.motor_torque_limit)
}

fn wide(vector: &Vector4<f32>) -> Vector4<f64> {
    vector.map(f64::from)
}

/// The coupling matrix A, element by element.
fn matrix(train: &DriveTrain) -> Matrix4<f64> {
    let n = wide(&train.gear_ratio);
    let k = std::f64::consts::TAU / f64::from(train.screw_lead);
    let mut a = Matrix4::from_diagonal(&Vector4::new(n.x, n.y, n.z * k, n.w));
    a.m34 = n.z * f64::from(train.screw_hand);
    a
}

proptest! {
    #![proptest_config(common::draws::cases(512))]

    #[test]
    fn motor_side_follows_the_coupling_matrix(train in train(), q in position(), torque in torque()) {
        let (drive, a) = (Drive::new(&train), matrix(&train));
        // Three roundings in the coefficient, one per product, one for the sum.
        let bound = a.abs() * wide(&q).abs() * (5.0 * U);
        assert_close("angle", &drive.motor_angle(&q), &(a * wide(&q)), &bound);
        let bound = a.transpose().abs() * wide(&torque).abs() * (5.0 * U);
        assert_close("torque", &drive.joint_torque(&torque), &(a.transpose() * wide(&torque)), &bound);
    }

    #[test]
    fn joint_side_undoes_the_motor_side(train in train(), q in position(), torque in torque()) {
        let (drive, a) = (Drive::new(&train), matrix(&train));
        let back = drive.joint_angle(&drive.motor_angle(&q));
        let wrist = f64::from(q.w.abs());
        let mut bound = wide(&q).abs() * (4.0 * U);
        bound.z += 6.0 * U * wrist * a.m34.abs() / a.m33;
        assert_close("position", &back, &wide(&q), &bound);

        let back = drive.motor_torque(&drive.joint_torque(&torque));
        let mut bound = wide(&torque).abs() * (4.0 * U);
        bound.w += 6.0 * U * f64::from(torque.z.abs()) * a.m34.abs() / a.m44;
        assert_close("torque", &back, &wide(&torque), &bound);
    }

    /// tanh x and x clamped to +-1 differ most at x = 1, by 1 - tanh 1 = 0.2384, and by less than 2 e^-2x beyond.
    #[test]
    fn coulomb_friction_of_plans_is_that_of_laws_away_from_rest(train in train(), qd in speed()) {
        let drive = Drive::new(&train);
        let (plan, law) = (drive.coulomb_friction(&qd), drive.friction(&qd) - train.viscous.component_mul(&qd));
        for axis in 0..4 {
            let x = f64::from(qd[axis] / train.coulomb_eps[axis]).abs();
            let apart = 0.2385f64.min(2.0 * (-2.0 * x).exp() + 8e-7);
            let rounding = 4.0 * U * f64::from((train.viscous[axis] * qd[axis]).abs());
            let bound = apart * f64::from(train.coulomb[axis]) + rounding;
            let gap = f64::from(plan[axis] - law[axis]).abs();
            prop_assert!(gap <= bound, "axis {axis}: {gap} for {bound}");
        }
    }

    /// Gears conserve power: motor torque times motor speed is joint effort times joint speed.
    #[test]
    fn power_is_conserved(train in train(), qd in speed(), torque in torque()) {
        let drive = Drive::new(&train);
        let (motor_speed, joint_effort) = (wide(&drive.motor_speed(&qd)), wide(&drive.joint_torque(&torque)));
        let gap = (wide(&torque).dot(&motor_speed) - joint_effort.dot(&wide(&qd))).abs();
        let terms = wide(&torque).abs().dot(&(matrix(&train).abs() * wide(&qd).abs()));
        prop_assert!(gap <= 4.0 * U * terms, "{gap:e} W of {terms} W");
    }

    /// Rotor inertia at the joints is the rotor inertia at the motors, reflected through the gears.
    #[test]
    fn reflected_inertia_is_that_of_the_rotors(train in train(), qdd in acceleration()) {
        let drive = Drive::new(&train);
        let a = matrix(&train);
        let exact = a.transpose() * Matrix4::from_diagonal(&wide(&train.rotor_inertia)) * a;
        let inertia = drive.rotor_inertia();
        prop_assert_eq!(inertia, inertia.transpose());
        let bound = exact.abs() * wide(&qdd).abs() * (12.0 * U);
        assert_close("effort", &(inertia * qdd), &(exact * wide(&qdd)), &bound);
    }

    #[test]
    fn friction_takes_power_and_is_odd(qd in speed(), slow in 1e-4..=1.0f32) {
        let (train, drive) = (IRB_930.drive, Drive::new(&IRB_930.drive));
        let qd = qd * slow;
        let friction = drive.friction(&qd);
        prop_assert_eq!(drive.friction(&-qd), -friction);
        prop_assert!(friction.iter().zip(&qd).all(|(effort, speed)| effort * speed >= 0.0));
        let exact = Vector4::from_fn(|i, _| {
            let (speed, eps) = (f64::from(qd[i]), f64::from(train.coulomb_eps[i]));
            f64::from(train.viscous[i]) * speed + f64::from(train.coulomb[i]) * (speed / eps).tanh()
        });
        let bound = wide(&train.coulomb) * (4e-7 + 4.0 * U) + exact.abs() * (4.0 * U);
        assert_close("friction", &friction, &exact, &bound);
    }

    #[test]
    fn counts_come_back(counts in prop::array::uniform4(-(1 << 23)..(1 << 23))) {
        let drive = Drive::new(&IRB_930.drive);
        let phi = drive.motor_angle_of_counts(&counts);
        let count = std::f64::consts::TAU / f64::from(IRB_930.drive.encoder_counts);
        let exact = Vector4::from(counts.map(|n| f64::from(n) * count));
        assert_close("angle", &phi, &exact, &(exact.abs() * (3.0 * U)));
        // There and back is 4 roundings of less than 2^23 counts: 2 counts.
        let back = drive.counts_of_motor_angle(&phi);
        prop_assert!(counts.iter().zip(back).all(|(&there, back)| (there - back).abs() <= 2), "{counts:?} {back:?}");
    }
}

/// Turning the wrist alone needs motor 3 to follow, and holding a load with the lift loads motor 4.
#[test]
fn spline_couples_lift_and_wrist() {
    let drive = Drive::new(&IRB_930.drive);
    let turned = drive.motor_angle(&Vector4::new(0.0, 0.0, 0.0, 1.0));
    assert_eq!(turned, Vector4::new(0.0, 0.0, 1.0, 20.0));
    let held = drive.motor_torque(&Vector4::new(0.0, 0.0, -100.0, 0.0));
    let nut = -100.0 * 0.025 / std::f64::consts::TAU;
    let bound = Vector4::repeat(4.0 * U);
    assert_close(
        "torque",
        &held,
        &Vector4::new(0.0, 0.0, nut, -nut / 20.0),
        &bound,
    );
}
