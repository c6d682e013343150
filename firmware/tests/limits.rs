//! What is cut and what trips, on the limit and beside it: the monitor of the axes and the limits of the torque, by themselves.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::control::limits::cut;
use firmware::control::monitor::{Monitor, MonitorLimits};
use firmware::control::readings::Readings;
use firmware::mechanics::arm::{ArmModel, IRB_930};
use firmware::mechanics::dynamics::drive::Drive;
use nalgebra::Vector4;
use protocol::messages::{Cause, DriveStatus, Fault, FaultAxis, LimitFlags};

const ZERO: Vector4<f32> = Vector4::new(0.0, 0.0, 0.0, 0.0);

/// An arm whose joints bear these efforts, and its motors these torques. Gears of 80 and 50 at the first two axes, without loss
/// in what follows.
fn arm(joint: [f32; 4], motor: [f32; 4]) -> ArmModel {
    let mut arm = IRB_930;
    arm.limits.effort = joint.into();
    arm.drive.motor_torque_limit = motor.into();
    arm
}

const MUCH: f32 = 1e6;

/// Either limit cuts alone, and says how much was cut: at the joint where that was it, else at the motor.
#[test]
fn torque_is_cut_by_the_joint_or_by_the_motor() {
    let drive = Drive::new(&IRB_930.drive);
    let wanted = Vector4::new(100.0, -100.0, 0.0, 0.0);
    let full = drive.motor_torque(&wanted);
    let cases = [
        // Exactly on both limits: nothing is cut.
        (
            arm([100.0, 100.0, MUCH, MUCH], [full.x, -full.y, MUCH, MUCH]),
            full,
            ZERO,
            LimitFlags::EMPTY,
        ),
        // The joint of the shoulder bears a quarter less.
        (
            arm([75.0, MUCH, MUCH, MUCH], [MUCH; 4]),
            Vector4::new(0.75 * full.x, full.y, 0.0, 0.0),
            Vector4::new(25.0, 0.0, 0.0, 0.0),
            LimitFlags::TORQUE_SHOULDER,
        ),
        // The motor of the elbow gives half.
        (
            arm([MUCH; 4], [MUCH, -0.5 * full.y, MUCH, MUCH]),
            Vector4::new(full.x, 0.5 * full.y, 0.0, 0.0),
            Vector4::new(0.0, 0.5 * full.y, 0.0, 0.0),
            LimitFlags::TORQUE_ELBOW,
        ),
        // Both at the elbow: what the joint does not bear is what counts.
        (
            arm([MUCH, 80.0, MUCH, MUCH], [MUCH, -0.5 * full.y, MUCH, MUCH]),
            Vector4::new(full.x, 0.5 * full.y, 0.0, 0.0),
            Vector4::new(0.0, -20.0, 0.0, 0.0),
            LimitFlags::TORQUE_ELBOW,
        ),
    ];
    for (case, (arm, motor, excess, flags)) in cases.iter().enumerate() {
        let limited = cut(arm, &drive, &wanted);
        // Each is rounded once or twice.
        let near = |a: &Vector4<f32>, b: &Vector4<f32>| {
            a.iter()
                .zip(b.iter())
                .all(|(a, b)| (a - b).abs() <= 2.0 * f32::EPSILON * b.abs())
        };
        assert!(near(&limited.motor_torque, motor), "{case}: {limited:?}");
        assert!(near(&limited.excess, excess), "{case}: {limited:?}");
        assert_eq!(limited.flags, *flags, "{case}");
    }
}

/// What no limit can hold stays what it is, for the controller to find.
#[test]
fn no_number_is_cut_to_one() {
    let drive = Drive::new(&IRB_930.drive);
    let limited = cut(&IRB_930, &drive, &Vector4::repeat(f32::NAN));
    assert!(limited.motor_torque.iter().all(|torque| torque.is_nan()));
}

/// A monitor of the built-in arm at 1 kHz, with its defaults: following error 0.05 rad, 0.05 rad, 10 mm and so on.
fn monitor() -> Monitor {
    Monitor::new(&IRB_930, &MonitorLimits::DEFAULT, 1e-3)
}

fn readings(velocity: Vector4<f32>, torque: Vector4<f32>) -> Readings {
    Readings {
        steps: 1,
        status: DriveStatus::READY | DriveStatus::TORQUE_ON | DriveStatus::ENCODER_VALID,
        counts: [0; 4],
        velocity,
        torque,
    }
}

/// A joint in the middle of its range.
fn middle() -> Vector4<f32> {
    0.5 * (IRB_930.limits.lower + IRB_930.limits.upper)
}

#[test]
fn a_limit_is_kept_where_it_is_reached() {
    let limits = MonitorLimits::DEFAULT;
    let moving = readings(Vector4::repeat(10.0), ZERO);
    let speed = IRB_930.limits.velocity * limits.speed_factor;
    let reach = 0.5 * (IRB_930.limits.upper - IRB_930.limits.lower) + limits.range_margin;
    let mut monitor = monitor();
    for _ in 0..10 {
        // The sum may be rounded to one beyond the limit; the difference is what counts.
        let furthest = (middle() + reach).zip_zip_map(&middle(), &reach, |sum, middle, reach| {
            if sum - middle <= reach {
                sum
            } else {
                sum.next_down()
            }
        });
        let error = limits.following_error;
        assert_eq!(
            monitor.check(&moving, &furthest, &ZERO, [&error, &error], || ZERO),
            None
        );
        assert_eq!(
            monitor.check(&moving, &middle(), &speed, [&error, &error], || speed),
            None
        );
    }
}

/// An axis beyond its range that is as fast as it may be: not its speed is wrong.
#[test]
fn a_limit_that_is_reached_is_not_blamed() {
    let mut monitor = monitor();
    let (mut at, mut qd) = (middle(), ZERO);
    at.z = 1.0;
    qd.z = IRB_930.limits.velocity.z * MonitorLimits::DEFAULT.speed_factor;
    let moving = readings(Vector4::repeat(10.0), ZERO);
    let faults = [(); 3].map(|()| monitor.check(&moving, &at, &qd, [&ZERO, &ZERO], || qd));
    let [None, None, Some(fault)] = faults else {
        panic!("{faults:?}");
    };
    assert_eq!(fault.cause, Cause::SoftLimit);
}

/// Both ends of the lift, whose range is not symmetric about 0: 0 to 0.3 m.
#[test]
fn the_end_of_the_range_that_was_passed_is_named() {
    let margin = MonitorLimits::DEFAULT.range_margin.z;
    for (q, limit) in [
        (-margin - 0.01, -margin),
        (0.3 + margin + 0.01, 0.3 + margin),
    ] {
        let mut monitor = monitor();
        let mut at = middle();
        at.z = q;
        let still = readings(ZERO, ZERO);
        let faults: Vec<_> = (0..3)
            .map(|_| monitor.check(&still, &at, &ZERO, [&ZERO, &ZERO], || ZERO))
            .collect();
        let [None, None, Some(fault)] = faults[..] else {
            panic!("{faults:?}");
        };
        assert_eq!(
            (fault.cause, fault.axis),
            (Cause::SoftLimit, FaultAxis::Lift)
        );
        assert!(
            (fault.limit - limit).abs() < 1e-6 && fault.value == q,
            "{fault:?}"
        );
    }
}

/// The elbow, 0.1 rad from its reference, in three samples with these velocities of its motor; its joint moves at `qd`, and its motor
/// gives 1 N m.
fn why(velocities: [f32; 3], qd: f32, error: f32) -> Fault {
    let mut monitor = monitor();
    let (qd, error) = (
        Vector4::new(0.0, qd, 0.0, 0.0),
        Vector4::new(0.0, error, 0.0, 0.0),
    );
    let faults = velocities.map(|velocity| {
        let velocity = Vector4::new(0.0, velocity, 0.0, 0.0);
        let readings = readings(velocity, Vector4::new(0.0, 1.0, 0.0, 0.0));
        monitor.check(&readings, &middle(), &qd, [&error, &error], || qd)
    });
    let [None, None, Some(fault)] = faults else {
        panic!("{faults:?}");
    };
    assert_eq!((fault.axis, fault.value), (FaultAxis::Elbow, error.y));
    fault
}

/// An encoder that runs backwards is one that moves away, faster than at first, against its torque: all of it.
#[test]
fn what_keeps_an_axis_from_following() {
    for (velocities, qd, error, cause) in [
        ([-10.0, -20.0, -30.0], -0.6, 0.1, Cause::EncoderFault),
        // Towards its reference.
        ([-10.0, -20.0, -30.0], -0.6, -0.1, Cause::FollowingError),
        // Neither: the joint stands, although its motor moves.
        ([-10.0, -20.0, -30.0], 0.0, 0.1, Cause::FollowingError),
        // No faster than in the first of the three, but faster than in the second.
        ([-30.0, -20.0, -25.0], -0.6, 0.1, Cause::FollowingError),
        // With its torque.
        ([10.0, 20.0, 30.0], 0.6, -0.1, Cause::FollowingError),
        // It does not move.
        ([0.5, 0.5, 0.5], 0.6, -0.1, Cause::StuckSensor),
    ] {
        let found = why(velocities, qd, error).cause;
        assert_eq!(found, cause, "{velocities:?} {qd} {error}");
    }
}
