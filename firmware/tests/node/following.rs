//! Where an arm has to be, sample by sample, and what carries it.

use firmware::mechanics::arm::IRB_930;
use firmware::mechanics::dynamics::drive::Drive;
use nalgebra::Vector4;
use protocol::messages::{Cause, ControlWord, Mode, MotionRequest, Outcome};

use crate::bench::{Bench, by_itself, estop};
use crate::manual::here;

/// Of the motor of the lift, whose screw rises by 25 mm in a turn, N m.
const PER_NEWTON: f32 = 0.025 / std::f32::consts::TAU;

/// Ahead of its reference or behind, by a third of what it moves in a sample.
#[test]
fn an_arm_is_compared_with_where_it_is_to_be_by_now() {
    for (off, expected) in [
        (0.9e-3, Cause::None),
        (-0.9e-3, Cause::None),
        (1.1e-3, Cause::FollowingError),
        (-1.1e-3, Cause::FollowingError),
    ] {
        let mut config = by_itself();
        config.setup.monitor.following_error = Vector4::repeat(1e-3);
        let mut bench = Bench::moving_with(config);
        bench.off.x = off;
        bench.run(3);
        let fault = *bench.node.controller().fault();
        assert_eq!(fault.cause, expected, "{off}: {fault}");
    }
}

/// Drives that leave out a sample and do not count it: the arm is found twice as far on, and its reference follows it there.
#[test]
fn samples_that_nobody_has_counted_are_caught_up() {
    let mut config = by_itself();
    config.setup.monitor.collision = 1.0;
    let mut bench = Bench::with(config);
    bench.enable();
    bench.follows = true;
    let mut target: [f32; 4] = here(&bench).into();
    target[0] -= 2.0;
    let turn = MotionRequest::MoveJoint {
        target,
        speed: 0.3,
        zone: 0.0,
    };
    assert_eq!(bench.request(turn), Some(Outcome::Accepted));
    for _ in 0..1000 {
        if bench.node.controller().reference().qdd.x == 0.0 {
            break;
        }
        bench.step();
    }
    let qd = bench.node.controller().reference().qd;
    assert!(qd.x < -2.0, "{qd}");
    (bench.follows, bench.flickers) = (false, false);
    let drive = Drive::new(&IRB_930.drive);
    let mut place = here(&bench);
    for (times, behind) in [(1.0, 0.0), (2.0, 1.0), (1.0, 0.0), (1.0, 0.0)] {
        place += qd * (1e-3 * times);
        bench.put(&place);
        bench.velocity = drive.motor_angle(&(qd * times)).into();
        bench.step();
        let controller = bench.node.controller();
        assert_eq!(
            (controller.mode(), controller.cause()),
            (Mode::Moving, Cause::None)
        );
        let error = controller.following_error() + qd * (1e-3 * behind);
        assert!(error.amax() < 1e-6, "{error}");
    }
}

/// What holds the lift with a load that nobody has announced, in thousandths of the rated 1.27 N m: the observer finds the load, and the law
/// asks for the same.
#[test]
fn torques_are_reported_in_thousandths_of_the_rated_ones() {
    for load in [0.0, 40.0, -30.0] {
        let mut bench = Bench::enabled();
        // Besides the 1.95 kg of lift and shaft.
        let torque = -(1.95 * 9.81 + load) * PER_NEWTON;
        bench.torque[2] = (torque / 1.27 * 1e3).round() as i16;
        bench.run(500);
        let found = bench.command().torque[2];
        // Half a thousandth.
        assert!((found - torque).abs() < 0.5e-3 * 1.27, "{found} {torque}");
    }
}

/// A mass that nobody has announced, by its weight and its inertia on strokes of the lift: a mean with a time constant of one second, in which the time of
/// a sample counts as much as it is heavier. What is without torque is not weighed, and not forgotten.
#[test]
fn what_the_lift_carries_is_weighed() {
    let mass = 10.0;
    let mut bench = Bench::with(by_itself());
    let rated = IRB_930.drive.motor_torque_rated;
    // At rest it carries itself.
    bench.torque[2] = (-1.95 * 9.81 * PER_NEWTON / rated.z * 1e3) as i16;
    bench.enable();
    bench.follows = true;
    let mut heights = [0.28, 0.02].into_iter().cycle();
    for sample in 1..=5000 {
        if bench.node.controller().queued() == 0 {
            let mut target: [f32; 4] = here(&bench).into();
            target[2] = heights.next().unwrap();
            let frame = bench.motion(MotionRequest::MoveJoint {
                target,
                speed: 0.5,
                zone: 0.0,
            });
            bench.wire.to_node.push_back(frame);
        }
        let mut torque = Vector4::from(bench.command().torque);
        let controller = bench.node.controller();
        let lift = controller.reference();
        torque.z -= mass * (9.81 - lift.qdd.z) * PER_NEWTON;
        bench.torque = torque
            .component_div(&rated)
            .map(|share| (share * 1e3).round() as i16)
            .into();
        let heavier = sample as f32 * 1e-3 - lift.qd.z / 9.81;
        let expected = mass * (1.0 - (-heavier).exp());
        let found = controller.burden();
        // The observer lags, and not every sample is weighed.
        assert!(
            (found - expected).abs() < 0.03 * mass,
            "{sample}: {found} {expected} kg"
        );
    }
    bench.wire.to_node.push_back(estop());
    bench.run(1000);
    assert_eq!(bench.command().control, ControlWord::ESTOP);
    let found = bench.node.controller().burden();
    bench.run(1000);
    assert_eq!(bench.node.controller().burden(), found);
}

/// One whose encoder is wrong is driven away by its loop, faster and faster; one that something takes away from its reference is not.
#[test]
fn an_axis_that_leaves_its_reference_against_its_torque_and_faster_has_a_wrong_encoder() {
    for (torque, faster, expected) in [
        (500, 0.0, Cause::FollowingError),
        (500, 1.0, Cause::EncoderFault),
        (-500, 1.0, Cause::FollowingError),
        (0, 1.0, Cause::FollowingError),
    ] {
        for side in [1.0, -1.0] {
            let mut config = by_itself();
            config.setup.monitor.following_error = Vector4::repeat(0.01);
            let mut bench = Bench::with(config);
            bench.enable();
            bench.torque[1] = -torque * side as i16;
            bench.velocity[1] = 10.0 * side;
            bench.shove(0.011 * f64::from(side));
            for _ in 0..3 {
                assert_eq!(bench.mode(), Mode::Enabled);
                bench.step();
                bench.velocity[1] += faster * side;
            }
            let fault = *bench.node.controller().fault();
            assert_eq!(fault.cause, expected, "{torque} {faster} {side}: {fault}");
        }
    }
}
