//! Bus-off of the nodes of a run, with and without recovery: the arm stops, somebody says so, and it can go on afterwards.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Message, Mode, MotionRequest, Node};
use protocol::time::{Duration, Instant};
use sim::controller::InProcess;
use sim::live::Live;
use sim::observer::{Observer, Truth};
use sim::operator::Order;
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use trace::ErrorFrame;

/// Classes of `linux/can/error.h`.
const BUS_OFF: u32 = 0x40;
const RESTARTED: u32 = 0x100;

/// What is seen of a run.
#[derive(Default)]
struct Seen {
    /// Times of bus-off and of recovery, by the code of the node.
    off: Vec<(f64, u8)>,
    back: Vec<(f64, u8)>,
    causes: Vec<Cause>,
    frames: Vec<(Instant, CanFrame)>,
    last: Option<Truth>,
    moved: f64,
}

impl Observer for Seen {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        if let Ok(received) = codec::decode(frame)
            && let Message::Emergency(_, emergency) = received.message
            && emergency.cause != Cause::None
        {
            self.causes.push(emergency.cause);
        }
        self.frames.push((time, *frame));
        Ok(())
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, _: Duration) -> io::Result<()> {
        let entry = (time.seconds(), error.data()[5]);
        if error.class & BUS_OFF != 0 {
            self.off.push(entry);
        }
        if error.class & RESTARTED != 0 {
            self.back.push(entry);
        }
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let speeds = truth.plant.qd.iter().map(|qd| qd.abs());
        self.moved = self.moved.max(speeds.fold(0.0, f64::max));
        self.last = Some(*truth);
        Ok(())
    }
}

impl Seen {
    fn mode(&self) -> Mode {
        self.last.unwrap().mind.mode
    }

    fn speed(&self) -> f64 {
        let qd = self.last.unwrap().plant.qd;
        qd.iter().fold(0.0, |most, qd| qd.abs().max(most))
    }
}

fn config(faults: &[&str]) -> RunConfig {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    scenario.faults = faults.iter().map(|text| text.parse().unwrap()).collect();
    RunConfig::new(scenario)
}

fn begin(config: &RunConfig) -> Live<'static> {
    Live::new(config, |config| Ok(InProcess::new(config))).unwrap()
}

/// Lets a run live until then; what it answers.
fn live(run: &mut Live<'_>, seen: &mut Seen, until: f64) -> Vec<String> {
    let mut said = Vec::new();
    while run.now().seconds() < until {
        run.step(&mut (), seen).unwrap();
        said.extend(run.answers().into_iter().map(|answer| answer.text));
    }
    said
}

/// Nothing moves by itself; a fault reset, and the whole scenario runs through.
fn goes_on(run: &mut Live<'_>, seen: &mut Seen) {
    let now = run.now().seconds();
    seen.moved = 0.0;
    live(run, seen, now + 0.3);
    assert!(seen.moved < 1e-2, "{}", seen.moved);
    assert_eq!(seen.mode(), Mode::Fault);
    run.order(Order::Request(MotionRequest::FaultReset));
    let said = live(run, seen, now + 0.6);
    assert_eq!(seen.mode(), Mode::Ready, "{said:?} {:?}", seen.causes);
    run.order(Order::Scenario);
    let said = live(run, seen, now + 3.0);
    assert!(
        said.iter()
            .any(|text| text.starts_with("scenario: completed")),
        "{said:?}"
    );
}

/// Thirty-two failed attempts, 128 times 11 bits, and the node is back, whichever it is.
#[test]
fn a_burst_of_errors_stops_the_arm_and_a_reset_lets_it_go_on() {
    for (message, node) in [("command", Node::Controller), ("feedback", Node::Drives)] {
        for kind in ["bit", "stuff", "form", "crc"] {
            let fault = format!("{message}:{kind}-error@0.4s..0.409s");
            let (mut run, mut seen) = (begin(&config(&[&fault])), Seen::default());
            live(&mut run, &mut seen, 2.5);
            assert!(
                !seen.off.is_empty() && seen.off.iter().all(|(_, code)| *code == node.code()),
                "{fault}: {:?}",
                seen.off
            );
            let (off, back) = (seen.off.last().unwrap().0, seen.back.last().unwrap().0);
            // At least the recessive bits, and no longer than if every millisecond had six frames in it.
            assert!(
                (0.001_408..0.003).contains(&(back - off)),
                "{fault}: {off} {back}"
            );
            assert!(!seen.causes.is_empty(), "{fault}");
            if node == Node::Controller {
                assert_eq!(seen.causes[0], Cause::BusOff, "{fault}");
            }
            assert!(seen.speed() < 1e-3, "{fault} {}", seen.speed());
            goes_on(&mut run, &mut seen);
        }
    }
}

/// Whatever destroys its frames for a second: it comes back at once three times, then after a quarter of a second each, so that the others
/// have their bus, and it is there when the second is over.
#[test]
fn a_controller_whose_every_frame_fails_leaves_the_bus_to_the_others() {
    let fault = "command:bit-error@0.4s..1.4s";
    let (mut run, mut seen) = (begin(&config(&[fault])), Seen::default());
    live(&mut run, &mut seen, 2.5);
    let times = |entries: &[(f64, u8)]| entries.iter().map(|(time, _)| *time).collect::<Vec<_>>();
    let (off, back) = (times(&seen.off), times(&seen.back));
    assert_eq!(off.len(), back.len(), "{off:?} {back:?}");
    let away = off.iter().zip(&back).map(|(off, back)| back - off);
    for (number, away) in away.enumerate() {
        let expected = if number < 3 { 0.0 } else { 0.25 };
        let recessive = away - expected;
        assert!(
            (0.001_408..0.003).contains(&recessive),
            "{number}: {off:?} {back:?}"
        );
    }
    // Three within some 20 ms, and then no more than four in the second.
    assert!((5..=7).contains(&off.len()), "{off:?}");
    assert!(off[2] - off[0] < 0.02, "{off:?}");
    // Feedback is sent as if there were nobody else.
    let feedback = |(time, frame): &&(Instant, CanFrame)| {
        protocol::table::FEEDBACK.identifies(frame) && (0.45..1.35).contains(&time.seconds())
    };
    assert_eq!(seen.frames.iter().filter(feedback).count(), 900);
    assert_eq!(seen.causes[0], Cause::BusOff);
    goes_on(&mut run, &mut seen);
}

/// Without its acknowledgement nobody goes bus-off.
#[test]
fn a_missing_acknowledgement_takes_nobody_off_the_bus() {
    let mut seen = Seen::default();
    in_process(&config(&["command:ack-error@0.4s..0.5s"]), &mut seen).unwrap();
    assert_eq!(seen.off, []);
}

/// The drives brake by themselves, the controller stops for want of feedback, nobody hears of it: until somebody restarts its CAN
/// controller, at 2.5 s.
#[test]
fn a_controller_that_never_recovers_is_safe_and_can_be_brought_back() {
    let faults = [
        "controller:no-recovery@0s..2.5s",
        "command:bit-error@0.4s..0.406s",
    ];
    let (mut run, mut seen) = (begin(&config(&faults)), Seen::default());
    let said = live(&mut run, &mut seen, 2.5);
    assert_eq!(seen.off.len(), 1);
    assert!(seen.back.is_empty() && seen.causes.is_empty());
    let off = seen.off[0].0;
    let silent = |(time, frame): &&(Instant, CanFrame)| {
        time.seconds() > off
            && protocol::table::of_frame(frame).unwrap().sender == Some(Node::Controller)
    };
    assert_eq!(seen.frames.iter().filter(silent).count(), 0);
    assert_eq!((seen.mode(), seen.speed() < 1e-3), (Mode::Fault, true));
    assert!(
        said.iter()
            .any(|text| text.contains("the controller has been silent since 0.38")),
        "{said:?}"
    );
    live(&mut run, &mut seen, 2.6);
    assert_eq!(seen.back.len(), 1);
    assert!(
        (2.501_408..2.503).contains(&seen.back[0].0),
        "{:?}",
        seen.back
    );
    goes_on(&mut run, &mut seen);
}

/// What a single error costs is a retransmission: nobody notices.
#[test]
fn single_errors_cost_time_and_nothing_else() {
    for kind in ["bit", "stuff", "form", "crc", "ack"] {
        let faults = [
            format!("command:{kind}-error=0.1@0s"),
            format!("feedback:{kind}-error=0.1@0s"),
        ];
        let faults: Vec<&str> = faults.iter().map(String::as_str).collect();
        let mut seen = Seen::default();
        let summary = in_process(&config(&faults), &mut seen).unwrap();
        assert!(
            summary.completed && seen.causes.is_empty(),
            "{kind}: {:?}",
            summary.error
        );
        assert!(summary.bus_errors > 50, "{kind}: {}", summary.bus_errors);
        assert_eq!((summary.frames_lost, seen.off.len()), (0, 0), "{kind}");
        let calm = in_process(&config(&[]), &mut ()).unwrap();
        assert_eq!(calm.bus_errors, 0);
        assert!(summary.bus_load > calm.bus_load, "{kind}");
    }
}

/// A drive that reads every frame wrong goes error passive, then hears nothing more and brakes; the others go on talking.
#[test]
fn a_node_that_misreads_ends_alone() {
    let mut seen = Seen::default();
    let summary = in_process(&config(&["drives:misread@0.4s"]), &mut seen).unwrap();
    assert!(
        summary.stopped && seen.off.is_empty(),
        "{:?} {:?}",
        summary.error,
        seen.off
    );
}
