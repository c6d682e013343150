//! What an axis feels that the model does not explain: an obstacle, an encoder, or samples that are missing. Numbers by hand.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::control::monitor::{Felt, Monitor, MonitorLimits};
use firmware::control::readings::Readings;
use firmware::mechanics::arm::{Axis, IRB_930};
use nalgebra::Vector4;
use protocol::messages::{Cause, DriveStatus};

/// N m, N: beyond what need not be explained; rad, m.
const FORCE: Vector4<f32> = Vector4::new(900.0, 800.0, 1500.0, 50.0);
const ERROR: Vector4<f32> = Vector4::new(0.01, 0.02, 0.003, 0.04);

/// Whose verdict falls in the second sample.
fn monitor() -> Monitor {
    let limits = MonitorLimits {
        samples: 2,
        speed_factor: 1.0,
        ..MonitorLimits::DEFAULT
    };
    Monitor::new(&IRB_930, &limits, 1e-3)
}

fn readings(steps: u32, velocity: [f32; 4], torque: [f32; 4]) -> Readings {
    Readings {
        steps,
        status: DriveStatus::READY | DriveStatus::TORQUE_ON | DriveStatus::ENCODER_VALID,
        counts: [0; 4],
        velocity: velocity.into(),
        torque: torque.into(),
    }
}

/// What is felt, most of it by this axis.
fn felt_by(axis: Axis) -> Vector4<f32> {
    let mut force = FORCE;
    force[axis as usize] *= 4.0;
    force
}

/// Motors at these velocities, rad/s, in the first sample and the next, torques of these signs in that, and joints that were to move like this and
/// are to now, and do. Returns the cause and the axis that is named.
fn verdict(
    axis: Axis,
    motors: [[f32; 4]; 2],
    torque: [f32; 4],
    [before, now, found]: [[f32; 4]; 3],
) -> (Cause, Axis) {
    let mut monitor = monitor();
    let force = felt_by(axis);
    let [before, now, found] = [before, now, found].map(Vector4::from);
    // Two steps: nothing is missing.
    let first = readings(2, motors[0], [0.0; 4]);
    let numbers = [&before, &before, &force, &ERROR, &before];
    assert_eq!(monitor.felt(axis, &first, numbers), Felt::Nothing);
    let second = readings(2, motors[1], torque);
    let numbers = [&found, &before, &force, &ERROR, &now];
    let Felt::Fault(fault) = monitor.felt(axis, &second, numbers) else {
        panic!("it is felt");
    };
    let named = Axis::ALL.into_iter().find(|it| fault.axis == (*it).into());
    let named = named.expect("an axis");
    let value = if fault.cause == Cause::Collision {
        &force
    } else {
        &ERROR
    };
    assert_eq!(fault.value, named.of(value));
    (fault.cause, named)
}

const RUN: [f32; 4] = [10.0; 4];

/// Encoders that show nothing: that of the axis, and those of others that were to move with 1 % of their speed, 0.122 rad/s at the elbow.
#[test]
fn an_encoder_that_stands_is_stuck() {
    let still = [10.0, 0.0, 10.0, 10.0];
    let stuck = (Cause::StuckSensor, Axis::Elbow);
    let at = |elbow| [[0.0, elbow, 0.0, 0.0]; 3];
    for (axis, motors, elbow, expected) in [
        (Axis::Elbow, [still, still], 0.0, stuck),
        (Axis::Shoulder, [still, still], 0.13, stuck),
        (Axis::Shoulder, [still, still], -0.13, stuck),
        (
            Axis::Shoulder,
            [still, still],
            0.115,
            (Cause::Collision, Axis::Shoulder),
        ),
        // One that turns back stands for an instant only.
        (
            Axis::Elbow,
            [RUN, still],
            0.0,
            (Cause::Collision, Axis::Elbow),
        ),
        (
            Axis::Elbow,
            [still, RUN],
            0.0,
            (Cause::Collision, Axis::Elbow),
        ),
        (
            Axis::Elbow,
            [RUN, RUN],
            0.13,
            (Cause::Collision, Axis::Elbow),
        ),
    ] {
        assert_eq!(
            verdict(axis, motors, [0.0; 4], at(elbow)),
            expected,
            "{elbow} {motors:?}"
        );
    }
}

/// Three quarters as fast as it went, and on its way according to the reference: no obstacle throws it back like that.
#[test]
fn an_encoder_that_goes_back_is_reversed() {
    let reversed = (Cause::EncoderFault, Axis::Elbow);
    let obstacle = (Cause::Collision, Axis::Shoulder);
    for (before, now, found, expected) in [
        (1.0, 0.9, -0.76, reversed),
        (1.0, 0.9, -0.74, obstacle),
        (2.0, 0.1, -1.52, reversed),
        (2.0, 0.1, -1.48, obstacle),
        (0.5, 0.5, -0.38, reversed),
        (-2.0, -0.1, 1.52, reversed),
        (-2.0, -0.1, 1.48, obstacle),
        (2.0, 1.0, 1.9, obstacle),
        // The reference has turned by itself, or stopped.
        (2.0, -0.1, -1.9, obstacle),
        (2.0, 0.0, -1.9, obstacle),
    ] {
        let rates = [before, now, found].map(|elbow| [0.0, elbow, 0.0, 0.0]);
        let found = verdict(Axis::Shoulder, [RUN, RUN], [0.0; 4], rates);
        assert_eq!(found, expected, "{rates:?}");
    }
}

/// A quarter faster within some samples against its torque, and by more than half of that not as the reference: the loop drives it away.
/// Not one that stood before, or that no torque resists.
#[test]
fn an_axis_that_runs_away_from_its_torque_has_a_wrong_encoder() {
    let away = (Cause::EncoderFault, Axis::Shoulder);
    let obstacle = (Cause::Collision, Axis::Shoulder);
    for (motors, torque, now, expected) in [
        ([10.0, 13.0], -1.0, 0.8, away),
        ([10.0, 13.0], -1.0, -0.8, away),
        ([10.0, 13.0], -1.0, 3.2, away),
        ([10.0, 13.0], -1.0, 1.2, obstacle),
        ([10.0, 13.0], -1.0, 2.8, obstacle),
        ([10.0, 13.0], 1.0, 0.8, obstacle),
        ([10.0, 13.0], 0.0, 0.8, obstacle),
        ([10.0, 12.0], -1.0, 0.8, obstacle),
        ([10.0, -13.0], 1.0, 0.8, obstacle),
        ([0.0, 13.0], -1.0, 0.8, obstacle),
    ] {
        for sign in [1.0, -1.0f32] {
            let rates = [2.0, now, 2.0].map(|rate| [sign * rate, 0.0, 0.0, 0.0]);
            let turning = motors.map(|motor| [sign * motor; 4]);
            let found = verdict(Axis::Shoulder, turning, [sign * torque; 4], rates);
            assert_eq!(found, expected, "{motors:?} {torque} {now} {sign}");
        }
    }
}

/// Every axis twice as far as in the last sample, within 15 %, forwards or, where the observer begins anew, backwards; and faster than 1 %.
#[test]
fn a_sample_that_is_missing_is_counted() {
    let speed = IRB_930.limits.velocity;
    let missing = |steps, last: [f32; 4], found: [f32; 4]| {
        let [last, found] = [last, found].map(|it| Vector4::from(it).component_mul(&speed));
        let now = readings(steps, RUN, [0.0; 4]);
        let numbers = [&found, &last, &FORCE, &ERROR, &found];
        match monitor().felt(Axis::Shoulder, &now, numbers) {
            Felt::Missed => 1,
            Felt::Nothing => 0,
            Felt::Fault(fault) => panic!("{fault}"),
        }
    };
    let way = [0.06, -0.05, 0.04, 0.0];
    for (times, expected) in [
        (1.0, 0),
        (1.7, 0),
        (1.76, 1),
        (2.0, 1),
        (2.3, 1),
        (2.4, 0),
        (3.0, 0),
        (5.0, 0),
        (-2.0, 0),
    ] {
        let far = way.map(|part| part * times);
        assert_eq!(missing(1, way, far), expected, "{times}");
        assert_eq!(missing(1, far, way), expected, "{times} back");
        assert_eq!(
            missing(2, way, far),
            0,
            "{times}, and the drives have counted"
        );
    }
    // No motor is as fast as the greatest speed that can be said.
    let numbers = [2.0, 1.0].map(|times| Vector4::from(way.map(|part| part * times)));
    let [found, last] = numbers.map(|it| it.component_mul(&speed));
    let numbers = [&found, &last, &FORCE, &ERROR, &found];
    for (fastest, expected) in [(1999.9, Felt::Missed), (-2000.0, Felt::Nothing)] {
        let now = readings(1, [0.0, 0.0, fastest, 0.0], [0.0; 4]);
        assert_eq!(monitor().felt(Axis::Shoulder, &now, numbers), expected);
    }
    // Another axis on its own way: 0.2 of 2 is little, 0.5 is not.
    assert_eq!(missing(1, [0.1, 0.0, 0.0, 0.0], [0.2, 0.02, 0.0, 0.0]), 1);
    assert_eq!(missing(1, [0.1, 0.0, 0.0, 0.0], [0.2, 0.05, 0.0, 0.0]), 0);
    assert_eq!(
        missing(1, [0.0, 0.011, 0.0, 0.0], [0.0, 0.022, 0.0, 0.0]),
        1
    );
    assert_eq!(
        missing(1, [0.0, 0.009, 0.0, 0.0], [0.0, 0.018, 0.0, 0.0]),
        0
    );
}

/// Only where something begins to be felt: after that it has been judged by what came before.
#[test]
fn samples_are_missed_at_once_or_not_at_all() {
    let mut monitor = monitor();
    let rates = [0.5, 1.0].map(|rate| Vector4::new(rate, 0.0, 0.0, 0.0));
    let [slow, fast] = &rates;
    let numbers = [fast, slow, &FORCE, &ERROR, fast];
    let one = readings(1, RUN, [0.0; 4]);
    assert_eq!(monitor.felt(Axis::Shoulder, &one, numbers), Felt::Missed);
    let even = [slow, slow, &FORCE, &ERROR, slow];
    assert_eq!(monitor.felt(Axis::Shoulder, &one, even), Felt::Nothing);
    let found = monitor.felt(Axis::Shoulder, &one, numbers);
    assert!(
        matches!(found, Felt::Fault(fault) if fault.cause == Cause::Collision),
        "{found:?}"
    );
}

/// What need not be explained, to the last bit, ends what has begun to be felt.
#[test]
fn what_is_felt_has_to_go_on() {
    let mut monitor = monitor();
    let explained = IRB_930.limits.effort * MonitorLimits::DEFAULT.collision;
    let rest = Vector4::zeros();
    let numbers = [&rest, &rest, &FORCE, &ERROR, &rest];
    for _ in 0..10 {
        let axis = monitor.feels(&FORCE).expect("it is felt");
        let found = monitor.felt(axis, &readings(1, RUN, [0.0; 4]), numbers);
        assert_eq!(found, Felt::Nothing);
        assert_eq!(monitor.feels(&explained), None);
    }
}
