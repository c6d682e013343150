//! Other nodes on the bus: one that has the controller's place, and those that are to give a sign of life.

use std::collections::BTreeMap;

use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use protocol::codec::{decode, encode};
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, ControlWord, DriveStatus, Message, Mode, MotionRequest, Node as Name, Outcome,
    ParameterRequest, Server,
};
use protocol::table::{self, TABLE};
use protocol::time::{Duration, Period};

use crate::bench::{Bench, PERIOD, SILENCE, heartbeat};

/// One frame of every message that the controller alone sends, by name: what a second controller on the bus sends.
fn frames_of_a_controller() -> BTreeMap<&'static str, CanFrame> {
    let mut other = Bench::new();
    let mut frames = Vec::new();
    let mut run = |bench: &mut Bench, samples: usize| {
        for _ in 0..samples {
            bench.now += PERIOD.duration();
            let frame = bench.next_feedback();
            bench.node.poll(bench.now, Some(&frame), &mut bench.wire);
            frames.append(&mut bench.wire.from_node);
        }
    };
    let hello = encode(
        &Message::ParameterRequest(Server::Controller, ParameterRequest::Hello(table::HELLO)),
        0,
    );
    let stop = other.motion(MotionRequest::Stop);
    for frame in [hello.unwrap(), stop] {
        other.node.poll(other.now, Some(&frame), &mut other.wire);
    }
    run(&mut other, 5);
    let enable = other.motion(MotionRequest::Enable);
    other.node.poll(other.now, Some(&enable), &mut other.wire);
    run(&mut other, 150);
    other.status = other.status | DriveStatus::FAULT;
    run(&mut other, 5);
    // The one that no controller sends by itself.
    let request = Message::ParameterRequest(Server::Drives, ParameterRequest::Get { index: 0 });
    frames.push(encode(&request, 0).unwrap());
    frames
        .into_iter()
        .map(|frame| (table::of_frame(&frame).unwrap().name, frame))
        .collect()
}

#[test]
fn whoever_sends_what_only_the_controller_sends_stops_the_arm() {
    let frames = frames_of_a_controller();
    let own = TABLE
        .iter()
        .filter(|info| info.sender == Some(Name::Controller));
    assert_eq!(frames.len(), own.count(), "{:?}", frames.keys());
    for (name, frame) in frames {
        let mut bench = Bench::moving();
        bench.wire.to_node.push_back(frame);
        bench.step();
        let controller = bench.node.controller();
        let told = (bench.mode(), controller.cause(), controller.fault().value);
        let id = f32::from(table::of_frame(&frame).unwrap().id);
        assert_eq!(
            told,
            (Mode::FaultReaction, Cause::DuplicateNode, id),
            "{name}"
        );
        // It goes on: the arm stops under control all the same, and stays off until a reset.
        let mut words = Vec::new();
        for _ in 0..500 {
            bench.wire.to_node.push_back(frame);
            words.push(bench.command().control);
        }
        let stop =
            ControlWord::TORQUE_ENABLE | ControlWord::BRAKE_RELEASE | ControlWord::QUICK_STOP;
        let closing = ControlWord::TORQUE_ENABLE;
        words.dedup();
        assert_eq!(words, [stop, closing, ControlWord::EMPTY], "{name}");
        assert_eq!(bench.mode(), Mode::Fault, "{name}");
        assert_eq!(
            bench.request(MotionRequest::FaultReset),
            Some(Outcome::Accepted),
            "{name}"
        );
        assert_eq!(bench.mode(), Mode::Ready, "{name}");
    }
}

/// A foreign node without the right protection is bad input like any other.
#[test]
fn what_only_looks_like_a_frame_of_the_controller_is_dropped() {
    for (name, frame) in frames_of_a_controller() {
        let info = table::of_frame(&frame).unwrap();
        if info.protection.is_none() {
            continue;
        }
        let mut bytes = frame.data().to_vec();
        bytes[0] ^= 1;
        let bad = if frame.is_fd() {
            CanFrame::fd(frame.id(), &bytes, true)
        } else {
            CanFrame::classical(frame.id(), &bytes)
        };
        let bad = bad.unwrap();
        assert!(decode(&bad).is_err());
        let mut bench = Bench::enabled();
        bench.wire.to_node.push_back(bad);
        bench.run(3);
        assert_eq!(
            (bench.mode(), bench.node.received().crc),
            (Mode::Enabled, 1),
            "{name}"
        );
    }
}

/// As CiA 301 has it: a node that was never heard is not waited for, one that was is waited for as long as torque is on.
#[test]
fn a_heartbeat_is_waited_for_once_it_was_heard() {
    for (name, cause, state) in [
        (Name::Operator, Cause::OperatorSilent, Mode::FaultReaction),
        (Name::Drives, Cause::PeerSilent, Mode::Fault),
    ] {
        let mut bench = Bench::enabled();
        bench.run(1000);
        assert_eq!(bench.mode(), Mode::Enabled, "never heard");
        for counter in 0..20 {
            bench
                .wire
                .to_node
                .push_back(heartbeat(name, Mode::Ready, counter % 16));
            bench.run(100);
        }
        assert_eq!(bench.mode(), Mode::Enabled, "{name} beats");
        bench.run(150);
        assert_eq!(bench.mode(), Mode::Enabled, "{name}: 250 ms since");
        // Looked at every tenth sample.
        bench.run(11);
        let found = (bench.mode(), bench.node.controller().cause());
        assert_eq!(found, (state, cause));
        // What was lost is not waited for any longer.
        bench.run(300);
        assert_eq!(
            bench.request(MotionRequest::FaultReset),
            Some(Outcome::Accepted)
        );
        bench.request(MotionRequest::Enable);
        bench.run(1000);
        assert_eq!(bench.mode(), Mode::Enabled, "{name}");
    }
}

/// Who switches off before leaving may come back at any time, with a counter that begins anew.
#[test]
fn who_leaves_without_torque_is_not_missed() {
    let mut bench = Bench::enabled();
    let beat = |bench: &mut Bench, counter| {
        let frame = heartbeat(Name::Operator, Mode::Ready, counter);
        bench.wire.to_node.push_back(frame);
        bench.run(100);
    };
    (0..12).for_each(|counter| beat(&mut bench, counter));
    bench.request(MotionRequest::Disable);
    bench.run(1000);
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Ready, Cause::None)
    );
    bench.request(MotionRequest::Enable);
    bench.run(300);
    (0..4).for_each(|counter| beat(&mut bench, counter));
    assert_eq!(bench.mode(), Mode::Enabled);
    assert_eq!(bench.node.received().stale, 0, "a new beginning");
}

/// One that is repeated, or was recorded, keeps nobody alive.
#[test]
fn an_old_heartbeat_is_none() {
    let mut bench = Bench::enabled();
    for _ in 0..4 {
        let frame = heartbeat(Name::Operator, Mode::Ready, 7);
        bench.wire.to_node.push_back(frame);
        bench.run(66);
    }
    assert_eq!(bench.node.controller().cause(), Cause::OperatorSilent);
}

/// Runs a bench with torque on for a second at most, and returns for how many samples.
fn run_until_it_stops(bench: &mut Bench) -> u32 {
    let mut samples = 0;
    while bench.mode() == Mode::Enabled && samples < 1000 {
        bench.step();
        samples += 1;
    }
    samples
}

#[test]
fn the_time_without_a_heartbeat_is_a_parameter() {
    for timeout in [0.15, 0.5] {
        let mut config = Config::new(IRB_930, PERIOD);
        config.setup.heartbeat_timeout = timeout;
        let mut bench = Bench::with(config);
        bench.enable();
        let frame = heartbeat(Name::Operator, Mode::Ready, 0);
        bench.wire.to_node.push_back(frame);
        bench.step();
        let samples = run_until_it_stops(&mut bench);
        let late = f64::from(samples) * 1e-3 - f64::from(timeout);
        assert!((-2.5e-3..12e-3).contains(&late), "{samples} {timeout}");
    }
}

/// Silence is more than 250 ms without a heartbeat. It is looked for in every tenth sample: whichever sample the last one came in, the first look
/// after that finds it.
#[test]
fn a_heartbeat_may_be_as_old_as_the_limit_and_no_older() {
    let age = |phase| {
        let mut bench = Bench::enabled();
        bench.run(phase);
        let frame = heartbeat(Name::Operator, Mode::Ready, 0);
        bench.wire.to_node.push_back(frame);
        let heard = bench.sample - 1;
        run_until_it_stops(&mut bench);
        let fault = *bench.node.controller().fault();
        let age = bench.sample - 1 - heard;
        assert_eq!((fault.cause, fault.limit), (Cause::OperatorSilent, 250.0));
        assert!((fault.value - age as f32).abs() < 1e-3, "{fault}");
        age
    };
    let mut ages: Vec<_> = (0..10).map(age).collect();
    ages.sort_unstable();
    assert_eq!(ages, (251..=260).collect::<Vec<_>>());
}

/// Feedback as old as the limit, and a little older: the fault says in ms for how long.
#[test]
fn feedback_may_be_as_old_as_the_limit_and_no_older() {
    for (micros, is_silent) in [
        (99_999, false),
        (100_000, false),
        (100_001, true),
        (350_000, true),
    ] {
        let mut bench = Bench::enabled();
        bench.now += Duration::from_micros(micros);
        bench.poll();
        let fault = *bench.node.controller().fault();
        let expected = if is_silent {
            Cause::PeerSilent
        } else {
            Cause::None
        };
        assert_eq!(fault.cause, expected, "{micros}");
        if is_silent {
            let ms = micros as f32 * 1e-3;
            assert!(
                (fault.value - ms).abs() < 1e-4 * ms && fault.limit == 100.0,
                "{fault}"
            );
        }
    }
}

/// Drives that have missed commands go on with the next one, from where the arm has coasted to: that has to be a fault.
#[test]
fn drives_that_switch_off_by_themselves_are_a_fault() {
    let mut bench = Bench::moving();
    bench.obeys = false;
    bench.step();
    bench.obeys = true;
    let words = bench.words(200);
    assert_eq!(
        words.first(),
        Some(&ControlWord::TORQUE_ENABLE),
        "the brake closes at once"
    );
    assert_eq!(bench.node.controller().cause(), Cause::DriveFault);
    assert_eq!(bench.mode(), Mode::Fault);
    let status = "drive fault: drive status ready brake-released encoder-valid";
    assert_eq!(bench.node.controller().fault().to_string(), status);
}

/// Nobody else says so, and the next word of a controller that is switching off would bring their torque back.
#[test]
fn drives_that_switch_off_before_they_are_told_to_are_a_fault() {
    let mut bench = Bench::enabled();
    let frame = bench.motion(MotionRequest::Disable);
    bench.wire.to_node.push_back(frame);
    bench.step();
    assert_eq!(bench.mode(), Mode::Disabling);
    bench.obeys = false;
    bench.run(2);
    assert_eq!(bench.node.controller().cause(), Cause::DriveFault);
}

/// Where feedback is lost, the drives have let go, or nothing is heard any more; frames that nobody feels are bad input.
#[test]
fn a_flooded_bus_is_named_where_it_is_felt() {
    for (lost, off, silent, otherwise) in [
        (0, false, false, Cause::None),
        (1, false, false, Cause::None),
        (6, false, false, Cause::FeedbackLost),
        (0, true, false, Cause::DriveFault),
        (0, false, true, Cause::PeerSilent),
    ] {
        // In 100 ms other devices may send more.
        let enough = if silent { 301 } else { 32 };
        for frames in [enough - 1, enough] {
            let mut bench = Bench::enabled();
            for _ in 0..10 {
                bench.babble(31);
                bench.step();
            }
            (0..lost).for_each(|_| bench.lose());
            bench.babble(frames);
            bench.poll();
            bench.obeys = !off;
            if silent {
                bench.now += SILENCE;
                bench.poll();
            } else {
                bench.step();
            }
            let is_felt = frames == enough && (lost, off, silent) != (0, false, false);
            let expected = if is_felt { Cause::Babbling } else { otherwise };
            let what = (lost, off, silent, frames);
            assert_eq!(bench.node.controller().cause(), expected, "{what:?}");
            let mode = match (expected, silent) {
                (Cause::None, _) => Mode::Enabled,
                (_, true) => Mode::Fault,
                _ => Mode::FaultReaction,
            };
            assert_eq!(bench.mode(), mode, "{what:?}");
        }
    }
}

/// Drives let go for want of commands after some samples, whose feedback waits for the end of the flood and says nothing of it.
#[test]
fn a_flood_is_named_after_feedback_that_has_waited_for_its_end() {
    for (waited, expected) in [
        (1, Cause::Babbling),
        (7, Cause::Babbling),
        (8, Cause::DriveFault),
    ] {
        let mut bench = Bench::enabled();
        bench.babble(32);
        bench.poll();
        (0..waited).for_each(|_| drop(bench.step()));
        assert_eq!(bench.mode(), Mode::Enabled);
        bench.obeys = false;
        bench.step();
        assert_eq!(bench.node.controller().cause(), expected, "{waited}");
    }
}

/// While the brake opens the drives may not be on yet; and in the 10 ms of a sample other devices may send as much.
#[test]
fn other_traffic_is_no_flood() {
    let (mut bench, _) = Bench::asked_to_enable();
    bench.obeys = false;
    for _ in 0..20 {
        bench.babble(40);
        bench.step();
    }
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Enabling, Cause::None)
    );

    for (frames, expected) in [(59, Cause::FeedbackLost), (60, Cause::Babbling)] {
        let mut slow = Bench::with(Config::new(IRB_930, Period::of_rate(100.0)));
        slow.enable();
        slow.lose();
        slow.babble(frames);
        slow.step();
        assert_eq!(slow.node.controller().cause(), expected, "{frames}");
    }
}
