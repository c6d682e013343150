//! Signs of life of the nodes, and one that has the place of another: what the controller of the bench does about them.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/gate.rs"]
mod gate;
#[path = "common/record.rs"]
mod record;

use gate::{cause, gate};
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Message, Mode, Node};
use protocol::table;
use record::run_of;
use sim::scenario::Scenario;

/// Nobody else sends those, and no node receives its own: the arm stops under control.
#[test]
fn a_forged_frame_of_the_controller_stops_the_arm() {
    for message in ["command", "state", "controllerheartbeat"] {
        let (summary, record) = gate(&format!("{message}:forged@400.5ms"));
        assert!(!summary.completed && summary.at_rest, "{message}");
        assert_eq!(cause(&record), Cause::DuplicateNode, "{message}");
    }
}

/// Ten a second, each behind what its sample has sent: by their own counters none is lost, and no command is later for them.
#[test]
fn drives_and_operator_give_signs_of_life() {
    let (summary, record) = gate("payload:dropped@100s");
    let length = record.truths.last().unwrap().plant.t;
    for (info, node) in [
        (&table::DRIVES_HEARTBEAT, Node::Drives),
        (&table::OPERATOR_HEARTBEAT, Node::Operator),
    ] {
        let beats = record
            .frames
            .iter()
            .filter(|(_, frame)| info.identifies(frame));
        let beats: Vec<_> = beats
            .map(|(_, frame)| codec::decode(frame).unwrap())
            .collect();
        assert!((beats.len() as f64 - length * 10.0).abs() <= 1.0, "{node}");
        for (k, beat) in beats.iter().enumerate() {
            assert_eq!(beat.counter, Some((k % 16) as u8), "{node}");
        }
    }
    assert!(summary.completed, "{:?}", summary.error);
}

/// Nobody watches over the arm, and 250 ms after the last sign of life it stops, on its path. A shorter silence is none.
#[test]
fn a_silent_operator_stops_the_arm() {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 3;
    for fault in ["operator:silent@0.4s", "operatorheartbeat:loss@0.4s"] {
        let (summary, record) = run_of(scenario.clone(), &[fault], 5);
        assert!(!summary.completed && summary.at_rest, "{fault}");
        assert_eq!(cause(&record), Cause::OperatorSilent, "{fault}");
        let told = record.frames.iter().find_map(|(time, frame)| {
            let emergency = table::CONTROLLER_EMERGENCY.identifies(frame);
            emergency.then_some(time.seconds())
        });
        // The last one was sent at 350 ms and its sample's three fifths.
        let late = told.unwrap() - 0.3506;
        assert!((0.249..0.264).contains(&late), "{fault}: {late}");
    }
    let (summary, record) = run_of(scenario.clone(), &["operatorheartbeat:loss@0.4s..0.5s"], 5);
    assert!(summary.completed, "{:?}", summary.error);
    assert_eq!(cause(&record), Cause::None);
    let (summary, record) = run_of(scenario, &["drivesheartbeat:loss@0.4s"], 5);
    assert!(!summary.completed && summary.at_rest);
    assert_eq!(cause(&record), Cause::PeerSilent);
}

/// The node's frames wait behind those that it sends without end; the drives let go as if it were silent.
#[test]
fn a_babbling_node_stops_the_arm() {
    for node in ["drives", "controller", "operator"] {
        let (summary, record) = gate(&format!("{node}:babbling@0.4s"));
        assert!(!summary.completed && summary.at_rest, "{node}");
        let off = record
            .truths
            .iter()
            .find(|it| it.plant.t > 0.4 && it.plant.tau == [0.0; 4])
            .unwrap();
        // Five samples without a command, and the two around them.
        assert!(off.plant.t < 0.4 + 0.0085, "{node}: {}", off.plant.t);
        let (short, _) = gate(&format!("{node}:babbling@0.4s..0.402s"));
        assert!(short.completed, "{node}: {:?}", short.error);
        // The feedback that has waited for the end of the flood is from before the drives let go.
        let (summary, record) = gate(&format!("{node}:babbling@0.4s..0.42s"));
        assert!(!summary.completed && summary.at_rest, "{node}");
        let named = if node == "controller" {
            Cause::DriveFault // It does not hear itself.
        } else {
            Cause::Babbling
        };
        assert_eq!(cause(&record), named, "{node}");
    }
}

/// Its time goes on by itself then: drives whose feedback cannot be read are silent.
#[test]
fn bad_feedback_without_end_does_not_silence_the_controller() {
    for fault in ["feedback:corrupt@0.32s", "feedback:bad-value@0.32s"] {
        let (summary, record) = gate(fault);
        assert!(!summary.completed, "{fault}");
        let beats = record.frames.iter().filter(|(time, frame)| {
            time.seconds() > 0.52 && table::CONTROLLER_HEARTBEAT.identifies(frame)
        });
        assert!(beats.count() > 2, "{fault}");
        let told = summary
            .faults
            .iter()
            .any(|it| it.cause == Cause::PeerSilent.name());
        // Without torque there is no more to tell.
        let is_off = summary.faults[0].cause == Cause::BadValue.name();
        assert!(told || is_off, "{fault}: {:?}", summary.faults);
    }
}

/// Without power there is no torque and no brake; with it the node starts where every run starts, and nothing moves by itself.
#[test]
fn a_node_without_power_starts_anew() {
    let (summary, record) = gate("drives:dead@0.4s..0.5s");
    assert!(!summary.completed && summary.at_rest);
    let sample = |frame: &CanFrame| match codec::decode(frame).ok()?.message {
        Message::Feedback(feedback) => Some(feedback.sample),
        _ => None,
    };
    let after = record
        .frames
        .iter()
        .filter(|(time, _)| time.seconds() > 0.4005);
    let first = after
        .clone()
        .find_map(|(time, frame)| Some((time.seconds(), sample(frame)?)));
    let (time, number) = first.unwrap();
    assert!(
        (0.5..0.502).contains(&time) && number <= 1,
        "{time} {number}"
    );
    // Back while the controller still counts on them, they are not switched on by its stop.
    let (summary, record) = gate("drives:dead@0.4s..0.45s");
    assert!(!summary.completed && summary.at_rest);
    let after = record.truths.iter().filter(|it| it.plant.t > 0.4015);
    assert!(after.clone().count() > 100);
    for it in after {
        assert_eq!(it.plant.tau, [0.0; 4], "{}", it.plant.t);
    }

    let (summary, record) = gate("controller:dead@0.45s..0.55s");
    assert!(!summary.completed && summary.at_rest);
    assert!(summary.error.unwrap().contains("started anew"));
    let modes: Vec<Mode> = record
        .truths
        .iter()
        .filter(|it| it.plant.t > 0.56)
        .map(|it| it.mind.mode)
        .collect();
    assert!(
        modes
            .iter()
            .all(|mode| matches!(mode, Mode::PreOperational | Mode::Ready)),
        "{modes:?}"
    );
    // The rig looks at the end of each of the 20 samples, the truth at their beginning.
    let moved = record
        .truths
        .iter()
        .rev()
        .take(19)
        .all(|it| it.plant.qd.iter().all(|qd| qd.abs() < 1e-3));
    assert!(moved);
}
