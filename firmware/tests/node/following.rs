//! Where an arm has to be, sample by sample, and what carries it.

use firmware::mechanics::arm::IRB_930;
use firmware::mechanics::dynamics::drive::Drive;
use nalgebra::Vector4;
use protocol::messages::{Cause, Mode, MotionRequest, Outcome};

use crate::bench::{Bench, by_itself};
use crate::manual::here;

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
    let turn = MotionRequest::MoveJoint { target, speed: 0.3 };
    assert_eq!(bench.request(turn), Some(Outcome::Accepted));
    for _ in 0..1000 {
        if bench.node.controller().reference().qdd.x == 0.0 {
            break;
        }
        bench.step();
    }
    let qd = bench.node.controller().reference().qd;
    assert!(qd.x < -2.0, "{qd}");
    bench.follows = false;
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
    let per_newton = 0.025 / std::f32::consts::TAU;
    for load in [0.0, 40.0, -30.0] {
        let mut bench = Bench::enabled();
        // Besides the 1.95 kg of lift and shaft.
        let torque = -(1.95 * 9.81 + load) * per_newton;
        bench.torque[2] = (torque / 1.27 * 1e3).round() as i16;
        bench.run(500);
        let found = bench.command().torque[2];
        // Half a thousandth.
        assert!((found - torque).abs() < 0.5e-3 * 1.27, "{found} {torque}");
    }
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
