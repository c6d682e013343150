//! Other nodes on the bus: one that has the controller's place, and those that are to give a sign of life.

use std::collections::BTreeMap;

use protocol::codec::{decode, encode};
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, ControlWord, DriveStatus, Message, Mode, MotionRequest, Node as Name, Outcome,
    ParameterRequest, Server,
};
use protocol::table::{self, TABLE};

use crate::bench::{Bench, PERIOD};

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
