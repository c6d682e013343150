//! What follows where an axis needs more torque than there is.

use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use nalgebra::Vector4;
use protocol::messages::{Cause, FaultAxis, LimitFlags, Message, Mode, MotionRequest, Outcome};
use protocol::time::Period;

use crate::bench::{Bench, PERIOD, by_itself};
use crate::faults::states;
use crate::manual::here;

/// An arm that falls behind, or gets ahead, of its reference a little more in every sample, until a torque is cut: a move is slowed down by
/// the square root of what is missing, which is little. At once where the arm is to be faster; a braking one would need even more
/// torque for that, so only what comes after it is slower.
#[test]
fn a_move_that_needs_a_little_too_much_torque_is_a_little_slower() {
    // It turns in negative direction.
    for (side, at_once) in [(1.0, true), (-1.0, false)] {
        let mut bench = Bench::moving();
        let limit = IRB_930.drive.motor_torque_limit.x;
        let mut is_cut = false;
        for _ in 0..200 {
            bench.off.x += side * 5e-5;
            if bench.command().torque[0].abs() >= limit {
                is_cut = true;
                break;
            }
            assert_eq!(bench.node.controller().pace(), 1.0, "{side}");
        }
        assert!(is_cut && bench.mode() == Mode::Moving, "{side}");
        for _ in 0..20 {
            bench.off.x *= 0.8;
            bench.step();
        }
        let slow = 0.95..0.99;
        let now = bench.node.controller().pace();
        assert_eq!(
            (slow.contains(&now), now == 1.0),
            (at_once, !at_once),
            "{side}: {now}"
        );
        bench.run(1000);
        assert_eq!(
            (bench.mode(), bench.node.controller().cause()),
            (Mode::Enabled, Cause::None)
        );
        let then = bench.node.controller().pace();
        assert!(slow.contains(&then), "{side}: {then}");
    }
}

/// One that stands would start, which it may do later: whatever it lacks, the move of the others goes on at its pace.
#[test]
fn an_axis_that_stands_slows_down_no_move_under_way() {
    for side in [1.0, -1.0] {
        let mut bench = Bench::with(by_itself());
        bench.enable();
        bench.follows = true;
        // From where it is to the last bit, so that the others stand.
        let mut target: [f32; 4] = here(&bench).into();
        target[3] = 3.0;
        let wrist = MotionRequest::MoveJoint {
            target,
            speed: 0.2,
            zone: 0.0,
        };
        assert_eq!(bench.request(wrist), Some(Outcome::Accepted));
        assert_eq!(bench.mode(), Mode::Moving);
        let limit = IRB_930.drive.motor_torque_limit.x;
        while bench.command().torque[0].abs() < limit && bench.off.x.abs() < 0.1 {
            bench.off.x += side * 2e-4;
        }
        assert_eq!(bench.node.controller().reference().qd.x, 0.0);
        bench.off.x = 0.0;
        bench.run(20);
        let controller = bench.node.controller();
        assert_eq!((controller.mode(), controller.pace()), (Mode::Moving, 1.0));
        bench.run(1000);
        let controller = bench.node.controller();
        assert_eq!(
            (controller.mode(), controller.cause()),
            (Mode::Enabled, Cause::None)
        );
        assert!(
            (0.9..0.99).contains(&controller.pace()),
            "{}",
            controller.pace()
        );
    }
}

/// Nor does an arm that is pushed where it holds slow down what it is to do after that.
#[test]
fn an_arm_at_rest_slows_down_nothing() {
    let mut bench = Bench::enabled();
    bench.shove(0.01);
    assert_eq!(
        bench.command().torque[1],
        -IRB_930.drive.motor_torque_limit.y
    );
    bench.shove(-0.01);
    bench.run(100);
    let controller = bench.node.controller();
    assert_eq!((controller.mode(), controller.pace()), (Mode::Enabled, 1.0));
}

/// An axis at its torque limit whose encoder does not move: 2.2 ms and two samples at the least where it is more than 5 % of its
/// following error off, eight times that where it is not.
#[test]
fn an_encoder_that_does_not_move_under_full_torque_is_stuck() {
    for (following, rate, off, samples) in [
        (1.0, 250.0, 0.2f32, 2),
        (0.05, 500.0, 0.04, 2),
        (0.05, 1000.0, 0.01, 3),
        (0.05, 2000.0, 0.01, 5),
        (1.0, 500.0, 0.04, 16),
        (1.0, 1000.0, 0.01, 18),
        (1.0, 2000.0, 0.01, 36),
    ] {
        let mut config = Config::new(IRB_930, Period::of_rate(rate));
        config.setup.monitor.following_error = Vector4::repeat(following);
        config.setup.monitor.collision = f32::MAX;
        let mut bench = Bench::with(config);
        bench.enable();
        assert_eq!(bench.mode(), Mode::Enabled);
        bench.shove(off.into());
        bench.torque[1] = -2100;
        for sample in 1..=samples {
            assert_eq!(bench.mode(), Mode::Enabled, "{following} {rate}: {sample}");
            bench.step();
        }
        let fault = *bench.node.controller().fault();
        assert_eq!(
            (fault.cause, fault.axis),
            (Cause::StuckSensor, FaultAxis::Elbow),
            "{following} {rate}: {fault}"
        );
        assert!(
            (fault.value + off).abs() < 1e-5 && (fault.limit - 0.05 * following).abs() < 1e-6,
            "{fault:?}"
        );
    }
}

/// Drives that miss their commands go on with an older one: an axis that stands under that does as it was told.
#[test]
fn an_axis_that_holds_with_an_older_torque_is_not_stuck() {
    // Of 2,516 thousandths of the rated torque; 680 hold 22 kg at the lift.
    for (held, expected) in [
        (680, Cause::None),
        (1900, Cause::None),
        (2100, Cause::StuckSensor),
    ] {
        let mut bench = Bench::with(by_itself());
        bench.enable();
        bench.shove(0.01);
        bench.torque[1] = -held;
        bench.run(20);
        let fault = *bench.node.controller().fault();
        assert_eq!(fault.cause, expected, "{held}: {fault}");
    }
}

/// Where the brake holds it, it is not stuck.
#[test]
fn an_encoder_that_does_not_move_under_the_brake_is_sound() {
    let mut bench = Bench::enabled();
    let disable = bench.motion(MotionRequest::Disable);
    bench.wire.to_node.push_back(disable);
    bench.step();
    bench.shove(0.01);
    let mut samples = 0;
    while bench.mode() == Mode::Disabling && samples < 1000 {
        bench.step();
        samples += 1;
    }
    assert!((30..300).contains(&samples), "{samples}");
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Ready, Cause::None)
    );
}

/// Long before the mean over some looks would show it.
#[test]
fn a_torque_from_limit_to_limit_and_back_is_chatter_at_the_fifth_turn() {
    let mut bench = Bench::enabled();
    // Not an encoder that stands.
    bench.velocity[1] = 5.0;
    let limit = IRB_930.drive.motor_torque_limit.y;
    bench.shove(0.01);
    let mut sides = 0;
    while bench.command().torque[1].abs() >= limit && sides < 20 {
        sides += 1;
        bench.shove(if sides % 2 == 0 { 0.02 } else { -0.02 });
    }
    let fault = *bench.node.controller().fault();
    assert_eq!(
        (fault.cause, fault.axis, fault.value, fault.limit),
        (Cause::Chatter, FaultAxis::Elbow, 400.0, 80.0),
        "{fault}"
    );
    assert_eq!(sides, 5);
}

/// The torque that the elbow may have for ever warms it up to all of it. From 90 % on moves are slower, and the state says so.
#[test]
fn a_warm_motor_is_reported() {
    let mut config = Config::new(IRB_930, PERIOD);
    config.setup.thermal_time = 0.5;
    let mut bench = Bench::with(config);
    bench.enable();
    let last = |sent: &[Message]| *states(sent).last().unwrap();
    assert_eq!(last(&bench.run(100)).limits, LimitFlags::EMPTY);
    let (limits, drive) = (&IRB_930.limits, &IRB_930.drive);
    let wanted = limits.effort_continuous.y / drive.gear_ratio.y;
    bench.shove(1e-3);
    let found = bench.command().torque[1].abs();
    bench.shove(1e-3 * f64::from(wanted / found - 1.0));
    assert!((bench.command().torque[1].abs() - wanted).abs() < 0.01 * wanted);
    // Half of the time constant, and four.
    let warm = last(&bench.run(250));
    assert_eq!((warm.limits, warm.pace), (LimitFlags::EMPTY, 100));
    let hot = last(&bench.run(1750));
    assert_eq!(hot.limits, LimitFlags::WARM);
    assert!((30..50).contains(&hot.pace), "{}", hot.pace);
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Enabled, Cause::None)
    );
}

/// Full torque for 200 ms of an axis that hardly moves, below a tenth of its speed. One that moves is on its way.
#[test]
fn full_torque_is_too_much_where_an_axis_hardly_moves() {
    for (share, expected) in [
        (0.01, Cause::OverTorque),
        (0.09, Cause::OverTorque),
        (0.11, Cause::None),
        (0.5, Cause::None),
    ] {
        let mut bench = Bench::with(by_itself());
        bench.enable();
        let full = IRB_930
            .limits
            .velocity
            .component_mul(&IRB_930.drive.gear_ratio);
        // The shoulder, whose torque is at its limit as well, is on its way.
        (bench.velocity[0], bench.velocity[1]) = (0.2 * full.x, share * full.y);
        bench.shove(0.007);
        bench.run(199);
        let early = bench.node.controller().fault();
        assert_eq!(bench.mode(), Mode::Enabled, "{share}: {early}");
        bench.run(10);
        let fault = *bench.node.controller().fault();
        assert_eq!(fault.cause, expected, "{share}: {fault}");
    }
}
