//! What the judge of campaigns demands is what is promised: of an arm at this rate, in this state, with these faults together.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::Message;
use protocol::time::Instant;
use sim::campaign::judge::Judge;
use sim::campaign::trial;
use sim::campaign::verdict::{Requirement, Verdict};
use sim::controller::InProcess;
use sim::peer::{Outbox, Peer, PeerError};
use sim::scenario::{Change, Scenario, built_in};
use sim::setup::RunConfig;
use sim::world::World;

fn config(name: &str, changes: &[&str], faults: &[&str]) -> RunConfig {
    let changes: Vec<Change> = changes.iter().map(|it| it.parse().unwrap()).collect();
    let mut scenario = Scenario::parse_with(built_in(name).unwrap(), name, &changes).unwrap();
    scenario.faults = faults.iter().map(|text| text.parse().unwrap()).collect();
    RunConfig::new(scenario)
}

fn judge(name: &str, changes: &[&str], faults: &[&str]) -> Verdict {
    let config = config(name, changes, faults);
    let connect = |config| Ok(InProcess::new(config));
    trial::run(&config, connect, &mut ()).unwrap().0
}

/// A gap is bridged that takes no longer than 5 ms: one frame may be lost where two samples take as long, from 400 Hz on, two from 600 Hz on,
/// and none below. What is not promised is no false alarm, and what is has to be kept.
#[test]
fn lost_feedback_is_survived_as_far_as_a_gap_is_bridged() {
    for (rate, lost, survived) in [
        (250.0, 1, false),
        (399.0, 1, true),
        (400.0, 1, true),
        (400.0, 2, false),
        (500.0, 1, true),
        (500.0, 2, false),
        (600.0, 2, true),
        (1000.0, 4, true),
        (1000.0, 5, false),
        (2000.0, 9, true),
        (2000.0, 10, false),
    ] {
        let window = |from: u32| format!("feedback:loss@{from}samples..{}samples", from + lost);
        let rate_hz = format!("rate_hz={rate}");
        for begin_s in [0.4, 0.45] {
            let fault = window((begin_s * rate) as u32);
            let verdict = judge("gate", &["cycles=1", &rate_hz], &[&fault]);
            assert_eq!(verdict.survived, survived, "{rate} Hz, {fault}");
            assert!(verdict.missed.is_empty(), "{rate} Hz, {fault}: {verdict:?}");
        }
    }
}

/// Before an arm is ready it need not become so, and one without torque has nothing to stop. Each of these was found in a campaign.
#[test]
fn an_arm_without_torque_is_held_to_what_it_promises() {
    for fault in [
        // Not ready yet, or never.
        "drives:silent@0ms..150ms",
        "bus:dominant@0ms..60ms",
        "feedback:corrupt@5ms",
        // Ready, and asked for torque meanwhile.
        "command:replay=4@19.6ms..169.6ms",
        "drives:misread@4.2ms..154.2ms",
        "feedback:form-error@21ms..81ms",
        "controller:babbling@25.9ms..85.9ms",
        "controller:slow=0.002@9.1ms..159.1ms",
        "drives:dead@16.8ms..17.8ms",
        "command:bad-value@12.6ms..162.6ms",
        "feedback:replay=8@11.9ms..161.9ms",
        // Hearts that were not heard before.
        "operator:silent@30.8ms",
        "operatorheartbeat:loss@20.3ms",
    ] {
        for rate in ["rate_hz=500", "rate_hz=1000"] {
            let verdict = judge("gate", &["cycles=1", rate], &[fault]);
            assert!(verdict.missed.is_empty(), "{rate} {fault}: {verdict:?}");
        }
    }
}

/// A controller that never says that an arm is not sound, nor shows it in its State.
struct Mute(InProcess);

impl Peer for Mute {
    fn wake(&self) -> Option<Instant> {
        self.0.wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let mut said = Outbox::new();
        self.0.poll(now, received, world, &mut said)?;
        let is_told = |frame: &CanFrame| match codec::decode(frame).unwrap().message {
            Message::Emergency(..) => true,
            Message::State(state) => state.cause != protocol::messages::Cause::None,
            _ => false,
        };
        out.extend(said.into_iter().filter(|(_, frame)| !is_told(frame)));
        Ok(())
    }
}

/// The arm is ready from 20 ms to 26 ms, when it is asked for torque.
#[test]
fn an_arm_that_is_ready_tells_what_switches_it_off() {
    for (fault, has_to_be_told) in [
        ("motor:lift:dip@21ms", true),
        ("encoder:elbow:jump=0.5@21ms", true),
        ("feedback:bad-value@21ms", true),
        ("drives:silent@21ms", true),
        ("command:loss@21ms..40ms", false),
        ("operator:silent@21ms", false),
    ] {
        let config = config("gate", &["cycles=1"], &[fault]);
        let (told, ..) = trial::run(&config, |it| Ok(InProcess::new(it)), &mut ()).unwrap();
        assert!(told.missed.is_empty(), "{fault}: {told:?}");
        let (mute, ..) = trial::run(&config, |it| Ok(Mute(InProcess::new(it))), &mut ()).unwrap();
        let missed = mute.missed.contains(&Requirement::Detected);
        assert_eq!(missed, has_to_be_told, "{fault}: {mute:?}");
    }
}

/// What a controller has latched is in its memory alone, and one that needs a second for a sample says so after six of them.
#[test]
fn a_stop_outlives_no_power_supply() {
    for fault in [
        "controller:dead@505.2ms",
        "controller:dead@518.5ms..718.5ms",
        "controller:dead@538.1ms..598.1ms",
        "controller:slow=0.15@500ms..560ms",
        "controller:slow=0.2@328.1ms..388.1ms",
        "controller:slow=1@487ms",
    ] {
        for changes in [
            &[][..],
            &["operation=manual"],
            &["cycle=[{ dwell = 0.2 }, { estop = 0.1 }]"],
        ] {
            let verdict = judge("estop-descent", changes, &[fault]);
            assert!(
                verdict.missed.is_empty(),
                "{fault}, {changes:?}: {verdict:?}"
            );
        }
    }
}

/// One fault that hides another: neither is missed, and the verdict names the one that it shows nothing of.
#[test]
fn a_hidden_fault_is_neither_missed_nor_shown() {
    for (faults, unseen) in [
        // The second comes when the first has stopped the arm.
        (
            vec!["encoder:elbow:jump=0.5@0.4s", "drives:silent@0.6s"],
            vec![1],
        ),
        // What is lost cannot be damaged, and who hears nothing sees no dip.
        (vec!["feedback:corrupt@0.4s", "drives:silent@0.4s"], vec![0]),
        (
            vec![
                "motor:elbow:dip@0.6588s..0.6608s",
                "feedback:loss@0.6588s..0.6608s",
            ],
            vec![],
        ),
        // A brake that stays open while another fault takes the torque that would hold the lift.
        (
            vec!["brake:slow=0.5@0.3158s", "motor:wrist:runaway@0.3158s"],
            vec![0],
        ),
        (vec!["drives:silent@0.4s"], vec![]),
        (
            vec!["drives:silent@0.4s", "controllerparameterrequest:loss@0.3s"],
            vec![1],
        ),
    ] {
        let verdict = judge("gate", &["cycles=1"], &faults);
        assert!(verdict.missed.is_empty(), "{faults:?}: {verdict:?}");
        let names: Vec<&str> = unseen.iter().map(|number| faults[*number]).collect();
        assert_eq!(verdict.unseen, names, "{faults:?}: {verdict:?}");
    }
}

/// Nobody asks for parameters in a cycle, and no frame meets a fault of 1 of 10^9.
#[test]
fn a_fault_without_anything_to_act_on_shows_nothing() {
    for (fault, never) in [
        ("controllerparameterrequest:loss@0.3s", true),
        ("controllerparameterrequest:crc-error@0.3s", true),
        ("estop:delay=0.01@0.3s", true),
        ("feedback:loss=0.000000001@0.3s", true),
        ("feedback:bit-error=0.000000001@0.3s", true),
        ("operatorheartbeat:loss@0.32s..0.33s", true),
        ("feedback:loss@0.3s..0.302s", false),
        ("feedback:bit-error@0.3s..0.302s", false),
        ("controller:misread@0.3s..0.302s", false),
        ("motion:loss@0.1s..0.11s", true),
        ("state:forged@0.3s..0.302s", false),
        ("motor:lift:weak=0.99@0.3s", false),
        ("clock:drift=0.0001@0.3s", false),
    ] {
        let verdict = judge("gate", &["cycles=1"], &[fault]);
        assert_eq!(verdict.never_acted, never, "{fault}: {verdict:?}");
        assert!(!verdict.never_began, "{fault}");
        assert!(verdict.missed.is_empty(), "{fault}: {verdict:?}");
    }
}

/// In manual operation the judge looks at the true tool, whatever the encoders show: one that is faster than 250 mm/s has to be told in four
/// samples, and one that goes on at full speed gets faster than any fault would make it before the arm is stopped.
#[test]
fn manual_operation_is_judged_by_the_true_tool() {
    let manual = ["cycles=1", "operation=manual"];
    for faults in [
        &[][..],
        &["motor:shoulder:runaway@1s"],
        &["motor:lift:runaway@0.4s"],
    ] {
        let verdict = judge("gate", &manual, faults);
        assert!(verdict.missed.is_empty(), "{faults:?}: {verdict:?}");
    }
    // A run in automatic operation, by a judge who takes it for one in manual operation.
    let (fast, slow) = (
        config("gate", &["cycles=1"], &[]),
        config("gate", &manual, &[]),
    );
    let connect = |it| Ok(InProcess::new(it));
    let (verdict, ..) = trial::run_before(Judge::new(&slow), &fast, connect, &mut ()).unwrap();
    for requirement in [Requirement::Reported, Requirement::Slow] {
        assert!(verdict.missed.contains(&requirement), "{verdict:?}");
    }
}
