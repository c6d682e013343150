//! What the node sends unprompted, and how much it does in one call.

use firmware::control::phase::{Phase, Probe};
use protocol::codec::encode;
use protocol::messages::{
    Cause, Emergency, Message, Mode, MotionRequest, Nmt, NmtCommand, Node as Name, Posture,
    ResetReason, State,
};

use crate::bench::{Bench, PERIOD, SILENCE, estop};

#[test]
fn state_and_heartbeat_come_at_their_rates() {
    let mut bench = Bench::enabled();
    let sent = bench.run(1000);
    let states: Vec<State> = sent
        .iter()
        .filter_map(|m| match m {
            Message::State(state) => Some(*state),
            _ => None,
        })
        .collect();
    assert_eq!(states.len(), 50);
    assert!(
        states
            .iter()
            .all(|s| s.mode == Mode::Enabled && s.queue == 0)
    );
    let beats = sent
        .iter()
        .filter(|m| matches!(m, Message::Heartbeat(..)))
        .count();
    assert_eq!(beats, 10);
}

#[test]
fn every_heartbeat_says_why_the_node_was_started() {
    let reasons: Vec<_> = Bench::enabled()
        .run(1000)
        .iter()
        .filter_map(|message| match message {
            Message::Heartbeat(Name::Controller, heartbeat) => Some(heartbeat.reset),
            _ => None,
        })
        .collect();
    assert_eq!(reasons, [ResetReason::Watchdog; 10]);
}

#[test]
fn the_state_holds_the_longest_tick() {
    let mut bench = Bench::new();
    for cycles in [3000, 170_000, 5] {
        bench.node.note_tick(cycles);
    }
    let worst = bench.run(20).iter().find_map(|message| match message {
        Message::State(state) => Some(state.worst_tick),
        _ => None,
    });
    assert_eq!(worst, Some(170_000));
}

#[test]
fn a_node_asked_to_reset_says_so_and_nothing_more() {
    for (node, command, asked) in [
        (0, NmtCommand::ResetNode, true),
        (Name::Controller.code(), NmtCommand::ResetNode, true),
        (Name::Drives.code(), NmtCommand::ResetNode, false),
        (0, NmtCommand::ResetCommunication, false),
        (0, NmtCommand::Stop, false),
    ] {
        let mut bench = Bench::enabled();
        let nmt = Message::Nmt(Nmt { command, node });
        bench.wire.to_node.push_back(encode(&nmt, 0).unwrap());
        bench.now += SILENCE;
        let sent = bench.poll();
        assert_eq!(bench.node.reset_asked(), asked, "{command} {node}");
        assert_eq!(sent.is_empty(), asked, "{command} {node}: {sent:?}");
    }
}

/// A probe that records its calls.
#[derive(Default)]
struct Marks(Vec<Phase>);

impl Probe for Marks {
    fn end(&mut self, phase: Phase) {
        self.0.push(phase);
    }
}

#[test]
fn every_phase_of_a_sample_is_marked_once_and_in_order() {
    let mut bench = Bench::enabled();
    let frame = bench.next_feedback();
    let mut marks = Marks::default();
    bench.now += PERIOD.duration();
    bench
        .node
        .poll_with(bench.now, Some(&frame), &mut bench.wire, &mut marks);
    let mut expected = Phase::ALL.to_vec();
    // The time that other frames would have taken.
    expected.insert(Phase::ALL.len() - 1, Phase::Decode);
    assert_eq!(marks.0, expected);

    let mut marks = Marks::default();
    bench
        .node
        .poll_with(bench.now, None, &mut bench.wire, &mut marks);
    assert_eq!(marks.0, [Phase::Decode, Phase::Report]);
}

/// CiA 301: an emergency is sent once for every error, however long the bus has no room for it.
#[test]
fn a_fault_is_told_once_there_is_room_for_it() {
    let mut bench = Bench::enabled();
    bench.wire.full = true;
    bench.wire.to_node.push_back(estop());
    assert_eq!(bench.run(50), []);
    assert_eq!(bench.mode(), Mode::EStop);
    bench.wire.full = false;
    let sent = bench.step();
    let first: Vec<_> = sent.iter().take(3).collect();
    assert!(
        matches!(
            first[..],
            [
                Message::Command(_),
                Message::Emergency(
                    Name::Controller,
                    Emergency {
                        cause: Cause::EStop,
                        ..
                    }
                ),
                Message::State(State {
                    cause: Cause::EStop,
                    ..
                }),
            ]
        ),
        "{sent:?}"
    );
    let again = |message: &Message| matches!(message, Message::Emergency(..));
    assert!(!bench.run(50).iter().any(again));
}

/// Nor does one hide another: whoever hears that the arm stops has to hear that its brake closes instead.
#[test]
fn every_fault_that_changes_the_state_is_told() {
    for is_full in [false, true] {
        let mut bench = Bench::moving();
        bench.wire.full = is_full;
        bench.node.bus_off();
        bench.node.bus_off();
        bench.wire.to_node.push_back(estop());
        let mut sent = bench.run(3);
        bench.wire.full = false;
        sent.extend(bench.run(10));
        let told: Vec<_> = sent
            .iter()
            .filter_map(|message| match message {
                Message::Emergency(_, emergency) => Some(emergency.cause),
                _ => None,
            })
            .collect();
        // Stop, brake, emergency stop.
        assert_eq!(
            told,
            [Cause::BusOff, Cause::BusOff, Cause::EStop],
            "{is_full}"
        );
    }
}

/// A jump so slow that an arm standing still does not trip the monitor.
fn jump() -> MotionRequest {
    MotionRequest::Jump {
        target: [0.6, 0.2, -0.25, 0.0],
        top: -0.2,
        clearance: 0.01,
        speed: 1e-3,
        posture: Posture::NEAREST,
        zone: 0.0,
    }
}

/// No call both plans and reports; reports wait for at most ten samples.
#[test]
fn planning_and_reports_take_turns() {
    let mut bench = Bench::enabled();
    let mut planned = 0;
    for _ in 0..4 {
        let frame = bench.motion(jump());
        bench.wire.to_node.push_back(frame);
    }
    let mut silent = 0;
    for _ in 0..300 {
        let planning = bench.node.controller().is_planning();
        let rests = (bench.sample + 1).is_multiple_of(10);
        let sent = bench.step();
        let reports = sent
            .iter()
            .filter(|message| !matches!(message, Message::Command(_)))
            .count();
        if planning && !rests {
            assert_eq!(reports, 0, "sample {}: {sent:?}", bench.sample);
            planned += 1;
        }
        let state = sent
            .iter()
            .any(|message| matches!(message, Message::State(_)));
        silent = if state { 0 } else { silent + 1 };
        assert!(silent <= 30, "a state every 20 ms, or 10 later");
    }
    assert!(planned > 100);
}

/// A stop refuses four moves at once. What is left of its answers when the next one is planned waits, if it is no more than two.
#[test]
fn up_to_two_answers_wait_for_planning() {
    let mut bench = Bench::enabled();
    // The first sample after a pause of planning.
    while !bench.sample.is_multiple_of(10) {
        bench.step();
    }
    let stop = MotionRequest::Stop;
    for request in [jump(), jump(), jump(), jump(), stop, jump()] {
        let frame = bench.motion(request);
        bench.wire.to_node.push_back(frame);
    }
    let answers: Vec<_> = (0..12)
        .map(|_| {
            let sent = bench.step();
            let answers = sent
                .iter()
                .filter(|message| matches!(message, Message::MotionReply(_)));
            answers.count()
        })
        .collect();
    // With the stop, with the next move and with the sample; then in the pause.
    assert_eq!(answers, [3, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0]);
    assert_eq!(bench.node.controller().answers_waiting(), 1);
    assert!(bench.node.controller().is_planning());
}
