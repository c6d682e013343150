//! Control words after a fault: which stop, and how it proceeds.

use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use protocol::codec::encode;
use protocol::messages::{
    Cause, Command, ControlWord, DriveStatus, FaultAxis, Message, Mode, MotionRequest, Outcome,
};

use crate::bench::{Bench, PERIOD, by_itself, estop, is_off};
use crate::faults::states;

const OFF: ControlWord = ControlWord::EMPTY;
const BRAKE: ControlWord = ControlWord::TORQUE_ENABLE;
const ESTOP_BRAKE: ControlWord = ControlWord::TORQUE_ENABLE.with(ControlWord::ESTOP, true);
const ESTOP_STOPPING: ControlWord = ESTOP_BRAKE
    .with(ControlWord::BRAKE_RELEASE, true)
    .with(ControlWord::QUICK_STOP, true);

/// Words without repetitions.
fn course(words: &[ControlWord]) -> Vec<ControlWord> {
    let mut course = words.to_vec();
    course.dedup();
    course
}

/// A loop must not be closed through a lost or wrong encoder, not even to stop.
#[test]
fn a_bad_encoder_takes_brake_and_torque_off_in_the_same_command() {
    let lost = |bench: &mut Bench| bench.status = DriveStatus::READY;
    let jumped = |bench: &mut Bench| jump(bench, 2);
    for harm in [lost, jumped] {
        for mut bench in [Bench::enabled(), Bench::moving()] {
            harm(&mut bench);
            let command = bench.command();
            assert!(is_off(&command), "{command:?}");
            let fault = *bench.node.controller().fault();
            assert_eq!(fault.cause, Cause::EncoderFault);
            // The same while the arm stops or its brake closes.
            let mut bench = Bench::moving();
            bench.wire.to_node.push_back(estop());
            assert_eq!(bench.command().control, ESTOP_STOPPING);
            harm(&mut bench);
            assert_eq!(bench.command().control, ControlWord::ESTOP);
        }
    }
    let mut bench = Bench::moving();
    jump(&mut bench, 0);
    let sent = bench.step();
    let state = states(&sent)[0];
    assert_eq!(state.fault_axis, FaultAxis::Shoulder);
    assert!(state.fault_value.abs() > 0.7, "{}", state.fault());
}

/// Lets the encoder of a motor jump: by 0.79 rad or 0.25 m, more than the axis can move in any gap.
fn jump(bench: &mut Bench, motor: usize) {
    bench.follows = false;
    bench.position[motor] += 10 * 131_072;
}

/// The brake needs its time, and the lift would fall meanwhile: its motor holds it, for as long as the brake does not close.
#[test]
fn the_lift_is_held_where_an_axis_of_the_arm_must_be_without_torque() {
    let carried = 1.95 * 9.81 / (std::f32::consts::TAU / 0.025);
    for (motor, stuck) in [(0, false), (1, false), (1, true)] {
        let mut bench = Bench::enabled();
        bench.status = bench.status.with(DriveStatus::BRAKE_RELEASED, stuck);
        jump(&mut bench, motor);
        let mut held = 0;
        loop {
            let command = bench.command();
            if command.control == OFF || held == 500 {
                break;
            }
            assert_eq!(command.control, BRAKE);
            assert_eq!((command.torque[0], command.torque[1]), (0.0, 0.0));
            assert!(
                (command.torque[2] + carried).abs() < 0.05 * carried,
                "{command:?}"
            );
            held += 1;
        }
        assert_eq!(bench.node.controller().cause(), Cause::EncoderFault);
        if stuck {
            assert_eq!(held, 500);
            // Its own encoder is another matter.
            jump(&mut bench, 2);
            bench.run(5);
            assert!(is_off(&bench.command()));
        } else {
            assert!((59..=61).contains(&held), "{held}");
        }
    }
}

/// One that moves by less than 0.2 m/s is held where it is; a faster one cannot be stopped there, and follows the path of its stop.
#[test]
fn a_slow_lift_is_held_where_it_is_when_the_arm_fails() {
    for (speed, is_held) in [(0.15, true), (0.25, false)] {
        for target in [0.02, 0.28] {
            let mut bench = Bench::with(by_itself());
            bench.enable();
            bench.follows = true;
            let target = [0.2, 1.5, target, 0.3];
            let stroke = bench.motion(MotionRequest::MoveJoint {
                target,
                speed: 0.2,
                zone: 0.0,
            });
            bench.wire.to_node.push_back(stroke);
            let lift = |bench: &Bench| bench.node.controller().reference().qd.z.abs();
            let reached = (0..1000).find(|_| {
                bench.step();
                lift(&bench) >= speed
            });
            assert!(reached.is_some() && lift(&bench) < speed + 0.04);
            let before = *bench.node.controller().reference();
            jump(&mut bench, 1);
            bench.run(30);
            assert_eq!(bench.node.controller().cause(), Cause::EncoderFault);
            let way = bench.node.controller().reference().q.z - before.q.z;
            assert_eq!(way == 0.0, is_held, "{way} m");
            assert!(way * before.qd.z >= 0.0, "{way} m");
        }
    }
}

/// The faulty drive may be the one of the lift: then only the brake holds it.
#[test]
fn a_drive_in_fault_closes_the_brake_first() {
    let mut bench = Bench::moving();
    bench.status = bench.status | DriveStatus::FAULT;
    let words = bench.words(200);
    assert_eq!(course(&words), [BRAKE, OFF]);
    let closing = words.iter().filter(|word| **word == BRAKE).count();
    // The brake takes 30 ms to close.
    assert!((30..=61).contains(&closing), "{closing} samples");
}

#[test]
fn a_fault_while_stopping_goes_straight_to_the_brake() {
    let drive_fault = |bench: &mut Bench| bench.status = bench.status | DriveStatus::FAULT;
    let lost_feedback = |bench: &mut Bench| (0..6).for_each(|_| bench.lose());
    for harm in [drive_fault, lost_feedback] {
        let mut bench = Bench::moving();
        bench.wire.to_node.push_back(estop());
        assert_eq!(bench.command().control, ESTOP_STOPPING);
        harm(&mut bench);
        let words = bench.words(200);
        assert_eq!(course(&words), [ESTOP_BRAKE, ControlWord::ESTOP]);
        assert_eq!(
            bench.node.controller().cause(),
            Cause::EStop,
            "the first cause stays"
        );
    }
}

/// A brake that stays open does not hold the lift: torque does, for as long as it takes.
#[test]
fn torque_holds_the_lift_until_the_brake_has_closed() {
    let switched_off = |bench: &mut Bench| {
        assert_eq!(
            bench.request(MotionRequest::Disable),
            Some(Outcome::Accepted)
        );
    };
    let drive_fault = |bench: &mut Bench| {
        bench.status = bench.status | DriveStatus::FAULT;
        bench.step();
    };
    for close in [switched_off, drive_fault] {
        let mut bench = Bench::enabled();
        bench.status = bench.status | DriveStatus::BRAKE_RELEASED;
        close(&mut bench);
        assert_eq!(course(&bench.words(500)), [BRAKE]);
        assert_eq!(bench.node.controller().cause(), Cause::DriveFault);
        bench.status = bench.status.with(DriveStatus::BRAKE_RELEASED, false);
        assert_eq!(course(&bench.words(100)), [OFF]);
        assert_eq!(bench.mode(), Mode::Fault);
    }
}

/// An emergency stop keeps its cause: that the brake does not close is told all the same, once.
#[test]
fn a_brake_that_does_not_close_after_an_emergency_stop_is_told() {
    let mut bench = Bench::enabled();
    bench.status = bench.status | DriveStatus::BRAKE_RELEASED;
    bench.wire.to_node.push_back(estop());
    let sent = bench.run(1000);
    let told = sent.iter().filter(
        |message| matches!(message, Message::Emergency(_, it) if it.cause == Cause::DriveFault),
    );
    assert_eq!(told.count(), 1);
}

/// A stop that the arm does not follow closes the brake; if it does not follow even then, its torque goes off.
#[test]
fn a_stop_that_is_not_followed_ends_at_the_brake() {
    let mut bench = Bench::moving();
    bench.wire.to_node.push_back(estop());
    bench.step();
    bench.follows = false;
    // Slow, and not still, as a stuck encoder would be.
    bench.velocity = [1.0; 4];
    let commands: Vec<_> = (0..200).map(|_| bench.command()).collect();
    let words: Vec<_> = commands.iter().map(|command| command.control).collect();
    let expected = [ESTOP_STOPPING, ESTOP_BRAKE, ControlWord::ESTOP];
    assert_eq!(course(&words), expected);
    let closing = commands
        .iter()
        .filter(|command| command.control == ESTOP_BRAKE);
    let pushing = closing.filter(|command| command.torque[0] != 0.0).count();
    assert_eq!(pushing, 3, "until the third sample in a row");
}

/// No loop is closed through an encoder that does not move: the arm's torque goes off without the time of the brake.
#[test]
fn a_stop_through_a_stuck_encoder_ends_without_torque() {
    let mut bench = Bench::moving();
    bench.wire.to_node.push_back(estop());
    bench.step();
    bench.follows = false;
    bench.velocity = [0.0; 4];
    let commands: Vec<_> = (0..100).map(|_| bench.command()).collect();
    let words: Vec<_> = commands.iter().map(|command| command.control).collect();
    assert_eq!(
        course(&words),
        [ESTOP_STOPPING, ESTOP_BRAKE, ControlWord::ESTOP]
    );
    let stopped = words.iter().position(|word| *word == ESTOP_BRAKE).unwrap();
    let arm = commands[stopped..]
        .iter()
        .map(|it| (it.torque[0], it.torque[1]));
    assert!(arm.into_iter().all(|torque| torque == (0.0, 0.0)));
}

/// An undisturbed stop comes to rest on the path before the brake closes.
#[test]
fn a_stop_that_is_followed_ends_at_rest() {
    let mut bench = Bench::moving();
    bench.wire.to_node.push_back(estop());
    let mut closing = 0;
    (0..1000)
        .find(|_| bench.command().control != ESTOP_STOPPING)
        .expect("the arm comes to rest");
    let here = bench.node.controller().reference().q;
    while bench.command().control == ESTOP_BRAKE {
        assert_eq!(bench.node.controller().reference().q, here);
        closing += 1;
        assert!(closing <= 61, "the brake has its time");
    }
    assert!(closing >= 30, "{closing} samples");
    assert_eq!(bench.command().control, ControlWord::ESTOP);
}

#[test]
fn a_law_without_a_finite_torque_takes_brake_and_torque_off() {
    let mut config = Config::new(IRB_930, PERIOD);
    config.setup.selection.gains.bandwidth = f32::NAN;
    let mut bench = Bench::with(config);
    bench.hello(protocol::table::HASH);
    bench.run(2);
    bench.request(MotionRequest::Stop);
    let frame = bench.motion(MotionRequest::Enable);
    bench.wire.to_node.push_back(frame);
    for _ in 0..3 {
        assert!(is_off(&bench.command()));
    }
    assert_eq!(bench.node.controller().cause(), Cause::BadValue);
}

/// Between the request to switch on and the first command with torque nothing is on: what would end torque keeps it from coming on.
#[test]
fn torque_that_has_not_come_on_does_not_come_on_for_a_stop() {
    type Harm = fn(&mut Bench);
    let harms: [(Mode, Cause, Harm); 5] = [
        (Mode::Ready, Cause::None, |bench| {
            let frame = bench.motion(MotionRequest::Disable);
            bench.wire.to_node.push_back(frame);
        }),
        (Mode::EStop, Cause::EStop, |bench| {
            bench.wire.to_node.push_back(estop());
        }),
        (Mode::Fault, Cause::DuplicateNode, |bench| {
            let command = Command {
                sample: 0,
                control: OFF,
                torque: [0.0; 4],
            };
            let frame = encode(&Message::Command(command), 0).unwrap();
            bench.wire.to_node.push_back(frame);
        }),
        (Mode::Fault, Cause::DriveFault, |bench| {
            bench.status = bench.status | DriveStatus::FAULT;
        }),
        (Mode::Fault, Cause::EncoderFault, |bench| {
            bench.status = DriveStatus::READY;
        }),
    ];
    for (mode, cause, harm) in harms {
        let mut bench = Bench::asked_to_enable().0;
        harm(&mut bench);
        for _ in 0..200 {
            assert!(is_off(&bench.command()), "{cause}");
            let found = (bench.mode(), bench.node.controller().cause());
            assert_eq!(found, (mode, cause));
        }
        if mode != Mode::Ready {
            continue;
        }
        // The torque of the time before does not count.
        bench.request(MotionRequest::Enable);
        bench.run(100);
        bench.request(MotionRequest::Disable);
        let enable = bench.motion(MotionRequest::Enable);
        bench.wire.to_node.push_back(enable);
        harm(&mut bench);
        assert!(is_off(&bench.command()));
        assert_eq!(bench.mode(), mode);
    }
}
