//! A row of the fault table that is missing from a controller is found by a campaign that nobody has aimed at it: cases drawn from all those
//! that come with the program.
//!
//! A controller without a row is a sound one that finds the cause, says nothing and changes nothing: whatever it commanded last goes on.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::control::controller::Config;
use firmware::control::fault::REACTIONS;
use protocol::codec::{self, Encoder};
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Command, ControlWord, Message};
use protocol::time::{Duration, Instant};
use sim::campaign::case::{Case, Crossing, Situation};
use sim::campaign::trial;
use sim::campaign::verdict::Verdict;
use sim::controller::InProcess;
use sim::peer::{Outbox, Peer, PeerError};
use sim::scenario::{Change, Scenario, built_in};
use sim::setup::RunConfig;
use sim::world::World;

/// A controller without the row of a cause.
struct Without {
    controller: InProcess,
    row: Option<Cause>,
    encoder: Encoder,
    /// The last command of an arm that is not being stopped.
    last: Option<Command>,
    /// It has found the cause, and ignores it.
    blind: bool,
}

impl Without {
    fn new(config: Config, row: Option<Cause>) -> Self {
        Self {
            controller: InProcess::new(config),
            row,
            encoder: Encoder::default(),
            last: None,
            blind: false,
        }
    }

    /// What it says instead of this.
    fn say(&mut self, message: Message) -> Option<Message> {
        match message {
            Message::Command(command) if self.blind => {
                let last = self.last.unwrap_or(command);
                let sample = command.sample;
                Some(Message::Command(Command { sample, ..last }))
            }
            Message::Command(command) => {
                let stops = command.control.contains(ControlWord::QUICK_STOP);
                self.last = (!stops).then_some(command).or(self.last);
                Some(message)
            }
            Message::Emergency(..) if self.blind => None,
            _ => Some(message),
        }
    }
}

impl Peer for Without {
    fn wake(&self) -> Option<Instant> {
        self.controller.wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let mut said = Outbox::new();
        self.controller.poll(now, received, world, &mut said)?;
        let decoded = |frame: &CanFrame| codec::decode(frame).unwrap().message;
        let told = said.iter().find_map(|(_, frame)| match decoded(frame) {
            Message::Emergency(_, told) if told.cause != Cause::None => Some(told.cause),
            _ => None,
        });
        self.blind |= told.is_some() && told == self.row;
        for (time, frame) in said {
            if let Some(message) = self.say(decoded(&frame)) {
                out.push((time, self.encoder.encode(&message).unwrap()));
            }
        }
        Ok(())
    }

    fn bus_off(&mut self, now: Instant) -> Result<Duration, PeerError> {
        Ok(self.controller.bus_off(now))
    }

    fn took(&mut self, time: Duration) -> Result<(), PeerError> {
        self.controller.took(time);
        Ok(())
    }
}

/// The cases that come with the program.
const DEFAULT: &str = include_str!("../../campaigns/default.toml");

/// What takes more than chance to reach: where an axis leaves its range or the tool its speed before its reference, a torque that is
/// at its limit for long, and a button that no fault presses.
const AIMED: &str = r#"
faults = ["motor:shoulder:runaway", "motor:wrist:dead", "encoder:lift:jump=0.004", "none"]
lasts_ms = [0]

[[situation]]
name = "at the end of the lift, 2 kg"
scenario = "gate"
set = ["rate_hz=500", "cycles=1", "cycle=[{ joints = { to = [0.3, 1.0, 0.3, 0.0] } }, { dwell = 0.5 }]"]
begin_ms = { from = 800, until = 900, step = 0.7 }

[[situation]]
name = "in manual operation, 2 kg"
scenario = "gate"
set = ["cycles=1", "operation=manual", "cycle=[{ dwell = 0.5 }]"]
begin_ms = { from = 200, until = 400, step = 0.7 }

[[situation]]
name = "gate, 22 kg"
scenario = "gate"
set = ["cycles=1"]
payload = 22
begin_ms = { from = 170, until = 670, step = 0.7 }

[[situation]]
name = "emergency stop, 10 kg"
scenario = "estop-descent"
begin_ms = { from = 200, until = 400, step = 0.7 }
"#;

/// How many cases are drawn.
const DRAWN: u64 = 600;

/// Cases drawn from those of `text`.
struct Draw {
    crossing: Crossing,
    cases: Vec<Case>,
}

impl Draw {
    fn of(text: &str, count: u64) -> Self {
        let table: toml::Table = text.parse().unwrap();
        let texts = |value: &toml::Value| -> Vec<String> { value.clone().try_into().unwrap() };
        let lasts: Vec<f64> = table["lasts_ms"].clone().try_into().unwrap();
        let lasts = lasts.into_iter().map(micros).collect();
        let situations = table["situation"].as_array().unwrap().iter();
        let situations = situations.map(|spec| {
            let name = spec["scenario"].as_str().unwrap();
            let changes = spec.get("set").map(texts).unwrap_or_default();
            let changes: Vec<Change> = changes.iter().map(|it| it.parse().unwrap()).collect();
            let text = built_in(name).unwrap();
            let mut scenario = Scenario::parse_with(text, name, &changes).unwrap();
            if let Some(kg) = spec.get("payload").and_then(toml::Value::as_integer) {
                scenario.carry(kg as f64).unwrap();
            }
            let begin: std::collections::BTreeMap<String, f64> =
                spec["begin_ms"].clone().try_into().unwrap();
            Situation {
                name: spec["name"].as_str().unwrap().into(),
                scenario,
                after: String::new(),
                from: micros(begin["from"]),
                until: micros(begin["until"]),
                step: micros(begin["step"]),
            }
        });
        let crossing = Crossing::new(situations.collect(), &texts(&table["faults"]), lasts);
        let crossing = crossing.unwrap();
        let cases = crossing.sample(count, 3).collect();
        Self { crossing, cases }
    }

    /// What becomes of a case with a controller without this row.
    fn judge(&self, case: &Case, row: Option<Cause>) -> Verdict {
        let mut situations = self.crossing.situations().iter();
        let situation = situations.find(|situation| situation.name == case.situation);
        let config = RunConfig::new(case.scenario(&situation.unwrap().scenario));
        let connect = |config| Ok(Without::new(config, row));
        trial::run(&config, connect, &mut ()).unwrap().0
    }
}

fn micros(ms: f64) -> u64 {
    (ms * 1e3).round() as u64
}

/// Rows that no fault of a run reaches, and why.
const OUT_OF_REACH: [(Cause, &str); 2] = [
    (
        Cause::SelfTest,
        "answers of the processor itself: tests/ci/35-bits.sh",
    ),
    (
        Cause::Overload,
        "a motor heats up for longer than a case lasts: firmware/tests/heat.rs",
    ),
];

/// Rows that cases reach which are aimed at them.
const AIMED_AT: [Cause; 4] = [
    Cause::SoftLimit,
    Cause::OverSpeed,
    Cause::OverTorque,
    Cause::EStop,
];

#[test]
fn a_row_that_is_missing_is_found_by_cases_drawn_at_random() {
    let (all, aimed) = (Draw::of(DEFAULT, DRAWN), Draw::of(AIMED, 200));
    // Each case is run once with all rows: which one it reaches, and whether it misses nothing by itself.
    let sound = |draw: &Draw| -> Vec<Verdict> {
        let cases = draw.cases.iter();
        cases.map(|case| draw.judge(case, None)).collect()
    };
    let verdicts = [sound(&all), sound(&aimed)];
    for (draw, verdicts) in [&all, &aimed].into_iter().zip(&verdicts) {
        for (case, verdict) in draw.cases.iter().zip(verdicts) {
            assert!(verdict.missed.is_empty(), "{case:?}: {verdict:?}");
        }
    }
    for row in &REACTIONS {
        let cause = row.cause;
        let speaks = |verdict: &Verdict| verdict.detected.as_deref() == Some(cause.name());
        if let Some((_, why)) = OUT_OF_REACH.iter().find(|(out, _)| *out == cause) {
            let is_reached = verdicts.iter().flatten().any(speaks);
            assert!(!is_reached, "{} is not out of reach: {why}", cause.name());
            continue;
        }
        let is_aimed = usize::from(AIMED_AT.contains(&cause));
        let draw = [&all, &aimed][is_aimed];
        // A case in which the row does not speak is that of the sound controller.
        let cases = draw.cases.iter().zip(&verdicts[is_aimed]);
        let reached = cases.filter(|(_, verdict)| speaks(verdict));
        let mut reached = reached.map(|(case, _)| (case, draw.judge(case, Some(cause))));
        let found = reached.find(|(_, verdict)| !verdict.missed.is_empty());
        let Some((case, verdict)) = found else {
            panic!("{} is not found", cause.name());
        };
        let faults = case.faults.iter().map(|fault| fault.text.as_str());
        println!(
            "{}: {}, {}: {:?}",
            cause.name(),
            case.situation,
            faults.collect::<Vec<_>>().join(" + "),
            verdict.missed
        );
    }
}
