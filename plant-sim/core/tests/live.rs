//! A run that goes on: it is the run of its scenario until somebody asks for something, and then it does that over the bus.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "../../../firmware/tests/common/draws.rs"]
mod draws;
#[path = "common/live.rs"]
mod live;

use std::io;

use live::live;
use proptest::prelude::*;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Mode, MotionRequest, Posture};
use protocol::time::{Duration, Instant};
use sim::controller::InProcess;
use sim::live::Live;
use sim::observer::{Observer, Truth};
use sim::operator::{Answer, Order};
use sim::record::TraceLog;
use sim::run::in_process;
use sim::scenario::{PayloadSpec, Scenario};
use sim::setup::RunConfig;

/// A scenario of one cycle.
fn config() -> RunConfig {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    RunConfig::new(scenario)
}

/// What is seen from outside: the trace, requests, and where the arm is.
struct Seen {
    trace: TraceLog<Vec<u8>>,
    requests: Vec<MotionRequest>,
    stops: usize,
    truth: Option<Truth>,
}

impl Seen {
    fn new() -> Self {
        Self {
            trace: TraceLog::new(Vec::new()),
            requests: Vec::new(),
            stops: 0,
            truth: None,
        }
    }

    fn mode(&self) -> Mode {
        self.truth.unwrap().mind.mode
    }
}

impl Observer for Seen {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        match codec::decode(frame).unwrap().message {
            Message::Motion(motion) => self.requests.push(motion.request),
            Message::EStop(_) => self.stops += 1,
            _ => {}
        }
        self.trace.frame(time, frame)
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.truth = Some(*truth);
        Ok(())
    }
}

fn begin(config: &RunConfig) -> Live<'static> {
    Live::new(config, |config| Ok(InProcess::new(config))).unwrap()
}

/// A run after its scenario, the axes under torque.
fn standing() -> (Live<'static>, Seen) {
    let (mut run, mut seen) = (begin(&config()), Seen::new());
    let answers = live(&mut run, &mut seen, 3.0);
    assert_eq!(answers.last().unwrap().text, "scenario: completed");
    assert!(!run.is_scripted());
    assert_eq!(seen.mode(), Mode::Enabled);
    seen.requests.clear();
    (run, seen)
}

/// The trace of `seconds` of a live run, with what `meddle` does before each sample.
fn trace(config: &RunConfig, seconds: f64, mut meddle: impl FnMut(&mut Live<'_>)) -> Vec<u8> {
    let (mut run, mut seen) = (begin(config), Seen::new());
    let until = run.now() + Duration::from_seconds(seconds);
    while run.now() < until {
        meddle(&mut run);
        run.step(&mut (), &mut seen).unwrap();
    }
    seen.trace.finish().unwrap().0
}

#[test]
fn untouched_it_is_the_run_of_its_scenario_up_to_its_last_request() {
    let mut log = TraceLog::new(Vec::new());
    in_process(&config(), &mut log).unwrap();
    let run = log.finish().unwrap().0;
    let live = trace(&config(), 5.0, |_| ());
    let same = run
        .iter()
        .zip(&live)
        .take_while(|(one, other)| one == other)
        .count();
    let rest = String::from_utf8(run[same..].to_vec()).unwrap();
    // The last request of a run, which a live one does not make, and the few samples until torque is off.
    let after: Vec<&str> = rest.lines().skip(1).collect();
    assert!(
        after.len() < 1000 && same > run.len() / 2,
        "{} lines differ",
        after.len()
    );
    let parts = String::from_utf8(run[..same].to_vec()).unwrap();
    let whole = parts.rsplit_once('\n').unwrap().0.lines().count();
    let next = String::from_utf8(run)
        .unwrap()
        .lines()
        .nth(whole)
        .unwrap()
        .to_owned();
    assert!(next.contains(" 2C0#"), "the first difference is {next}");
}

#[test]
fn a_fault_planted_at_a_time_is_the_fault_of_a_scenario() {
    for text in [
        "encoder:elbow:stuck@0.4s..0.5s",
        "command:loss=0.3@0.35s",
        "drives:silent@0.5s",
    ] {
        let mut planned = config();
        planned.scenario.faults.push(text.parse().unwrap());
        let expected = trace(&planned, 1.0, |_| ());
        let fault = text.parse().unwrap();
        let mut left = Some(fault);
        let planted = trace(&config(), 1.0, |run| {
            if run.now().seconds() >= 0.3
                && let Some(fault) = left.take()
            {
                run.plant(&fault);
            }
        });
        assert!(expected == planted, "{text}");
        assert!(
            expected != trace(&config(), 1.0, |_| ()),
            "{text} does nothing"
        );
    }
}

#[test]
fn what_is_asked_for_goes_over_the_bus_and_is_done() {
    let (mut run, mut seen) = standing();
    let target = [0.5_f32, 0.2, -0.25, 0.3];
    let line = MotionRequest::MoveLine {
        target,
        speed: 0.5,
        posture: Posture::NEAREST,
        tool_speed: 0.0,
        zone: 0.0,
    };
    run.order(Order::Request(line));
    let answers = live(&mut run, &mut seen, 3.0);
    assert_eq!(answers.len(), 1);
    assert_eq!(answers[0].text, "move-line: accepted");
    assert_eq!(seen.requests, [line]);
    let tool = seen.truth.unwrap().plant.tool;
    for (actual, target) in tool.into_iter().zip(target) {
        assert!((actual - f64::from(target)).abs() < 1e-4, "{tool:?}");
    }
    assert_eq!(seen.mode(), Mode::Enabled);
}

#[test]
fn a_stop_follows_a_move_at_once_and_ends_the_scenario() {
    let (mut run, mut seen) = (begin(&config()), Seen::new());
    live(&mut run, &mut seen, 0.4);
    assert!(run.is_scripted());
    assert_eq!(seen.mode(), Mode::Moving);
    run.order(Order::Request(MotionRequest::Stop));
    let answers = live(&mut run, &mut seen, 1.0);
    assert_eq!(answers[0].text, "stop: accepted");
    assert!(!run.is_scripted());
    assert_eq!(seen.mode(), Mode::Enabled);
    let stood = seen.truth.unwrap().plant.q;
    live(&mut run, &mut seen, 1.0);
    let stands = seen.truth.unwrap().plant.q;
    assert!(
        stood
            .iter()
            .zip(stands)
            .all(|(one, other)| (one - other).abs() < 1e-5)
    );
    // From where it stands the scenario runs again.
    run.order(Order::Scenario);
    let answers = live(&mut run, &mut seen, 3.0);
    let texts: Vec<&str> = answers.iter().map(|answer| answer.text.as_str()).collect();
    assert_eq!(texts, ["scenario: begun", "scenario: completed"]);
}

#[test]
fn a_scenario_goes_on_at_another_speed() {
    let (mut run, mut seen) = (begin(&config()), Seen::new());
    let pace = |pace| Order::Request(MotionRequest::SetOverride { pace });
    let texts = |answers: Vec<Answer>| -> Vec<String> {
        answers.into_iter().map(|answer| answer.text).collect()
    };
    live(&mut run, &mut seen, 0.4);
    run.order(pace(0.0));
    let answers = live(&mut run, &mut seen, 2.0);
    assert_eq!(texts(answers), ["set-override: accepted"]);
    assert!(run.is_scripted());
    let held = seen.truth.unwrap().plant.q;
    // Longer than any move takes at full speed.
    assert!(live(&mut run, &mut seen, 60.0).is_empty());
    let stands = seen.truth.unwrap().plant.q;
    let moved = held
        .iter()
        .zip(stands)
        .map(|(one, other)| (one - other).abs());
    assert!(moved.fold(0.0, f64::max) < 1e-5, "{held:?} {stands:?}");
    assert_eq!(seen.mode(), Mode::Moving);
    run.order(pace(0.5));
    let answers = live(&mut run, &mut seen, 4.0);
    assert_eq!(
        texts(answers),
        ["set-override: accepted", "scenario: completed"]
    );
}

#[test]
fn an_emergency_stop_is_acknowledged_and_the_scenario_begins_anew() {
    let (mut run, mut seen) = standing();
    run.order(Order::EmergencyStop);
    live(&mut run, &mut seen, 0.5);
    assert_eq!((seen.stops, seen.mode()), (1, Mode::EStop));
    run.order(Order::Scenario);
    let answers = live(&mut run, &mut seen, 0.1);
    assert!(
        !answers[0].good && answers[0].text.contains("in state estop"),
        "{answers:?}"
    );
    run.order(Order::Request(MotionRequest::FaultReset));
    live(&mut run, &mut seen, 0.5);
    assert_eq!(seen.mode(), Mode::Ready);
    run.order(Order::Scenario);
    let answers = live(&mut run, &mut seen, 3.0);
    assert_eq!(answers.last().unwrap().text, "scenario: completed");
}

#[test]
fn a_payload_is_carried_when_the_controller_has_accepted_it() {
    let (mut run, mut seen) = standing();
    let weight = |seen: &Seen| -seen.truth.unwrap().plant.tau[2];
    live(&mut run, &mut seen, 0.3);
    let before = weight(&seen);
    run.order(Order::Carry(PayloadSpec::compact(10.0)));
    live(&mut run, &mut seen, 1.5);
    let carried = weight(&seen) - before;
    // The scenario itself carries 2 kg.
    assert!((carried - 8.0 * 9.81).abs() < 2.0, "{carried} N");
    run.order(Order::Carry(PayloadSpec::compact(40.0)));
    let answers = live(&mut run, &mut seen, 0.5);
    assert!(
        answers[0].text.starts_with("set-payload refused: "),
        "{answers:?}"
    );
    assert!(
        (weight(&seen) - before - carried).abs() < 10.0,
        "it carries what was refused"
    );
}

#[test]
fn a_failed_scenario_does_not_end_the_run() {
    let mut config = config();
    config
        .scenario
        .faults
        .push("encoder:elbow:stuck@0.4s".parse().unwrap());
    let (mut run, mut seen) = (begin(&config), Seen::new());
    let answers = live(&mut run, &mut seen, 2.0);
    assert!(
        answers[0].text.starts_with("scenario ended: "),
        "{answers:?}"
    );
    assert!(!run.is_scripted());
    assert_eq!(seen.mode(), Mode::Fault);
}

/// Orders that a person may give, in any order and at any time.
fn orders() -> impl Strategy<Value = Order> {
    let target = [-1.2_f32..1.2, -1.2..1.2, -0.6..0.3, -4.0..4.0];
    let posture = Posture::NEAREST;
    prop_oneof![
        Just(Order::Scenario),
        Just(Order::EmergencyStop),
        (0.0..60.0).prop_map(|mass| Order::Carry(PayloadSpec::compact(mass))),
        prop::sample::select(vec![
            MotionRequest::Enable,
            MotionRequest::Disable,
            MotionRequest::FaultReset,
            MotionRequest::Stop,
        ])
        .prop_map(Order::Request),
        (target.clone(), -0.1_f32..1.2).prop_map(move |(target, speed)| Order::Request(
            MotionRequest::MoveLine {
                target,
                speed,
                posture,
                tool_speed: 0.0,
                zone: 0.0
            }
        )),
        (0.0_f32..1.2).prop_map(|pace| Order::Request(MotionRequest::SetOverride { pace })),
        (target, -0.1_f32..1.2).prop_map(|(target, speed)| Order::Request(
            MotionRequest::MoveJoint {
                target,
                speed,
                zone: 0.0
            }
        )),
    ]
}

proptest! {
    #![proptest_config(draws::cases(24))]

    /// Whatever is asked for and whenever, every order has an answer.
    #[test]
    fn every_order_is_answered(asked in prop::collection::vec((orders(), 1_u32..300), 1..8)) {
        let (mut run, mut seen) = (begin(&config()), Seen::new());
        let mut answers = Vec::new();
        for (order, samples) in &asked {
            run.order(*order);
            answers.extend(live(&mut run, &mut seen, f64::from(*samples) * 1e-3));
        }
        // A line at a tenth of a percent of full speed holds up those after it for long; a stop answers them.
        for _ in 0..2 {
            run.order(Order::Request(MotionRequest::Stop));
            answers.extend(live(&mut run, &mut seen, 2.0));
        }
        let own = |answer: &&Answer| !["scenario: completed", "scenario ended"].iter().any(|text| answer.text.starts_with(text));
        let own: Vec<&str> = answers.iter().filter(own).map(|answer| answer.text.as_str()).collect();
        prop_assert!(own.len() >= asked.len() + 2, "{:?} for {:?}", own, asked);
    }
}
