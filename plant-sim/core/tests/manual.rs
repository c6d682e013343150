//! Manual operation with the whole bench: whatever is asked for, held and let go of, the true tool stays slow, and stands where nobody
//! holds it.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;
#[path = "common/tool.rs"]
mod tool;

use std::fmt::Write;

use oorandom::Rand64;
use protocol::codec;
use protocol::messages::{Cause, Law, Message, Mode, MotionRequest, Operation};
use record::{Record, run_of};
use sim::run::in_process;
use sim::scenario::{OperationName, PayloadSpec, Scenario};
use sim::setup::RunConfig;
use tool::speed;

/// m/s of ISO 10218-1, at every point of the tool.
const LIMIT: f64 = 0.25;

/// A scenario of manual operation at this rate, with this payload in kg and these steps.
fn scenario(rate: u32, payload: f64, steps: &str) -> Scenario {
    let text = format!(
        "name = \"manual\"\ncycles = 1\nrate_hz = {rate}\nlaw = \"computed-torque:observer\"\noperation = \"manual\"\n\
         start = [0.5, 0.1, -0.27, 0.0]\n{}\n{steps}",
        if payload > 0.0 {
            format!(
                "payload = {{ mass = {payload}, com_flange_frame = [0.0, 0.0, 0.05], inertia_com_diag = [0.02, 0.02, 0.02] }}"
            )
        } else {
            String::new()
        }
    );
    Scenario::parse(&text, "a test").unwrap()
}

/// Times of the holds, s.
fn holds(record: &Record) -> Vec<f64> {
    let frames = record.frames.iter();
    let holds = frames.filter(|(_, frame)| {
        let message = codec::decode(frame).map(|received| received.message);
        matches!(message, Ok(Message::Motion(motion)) if motion.request == MotionRequest::Hold)
    });
    holds.map(|(time, _)| time.seconds()).collect()
}

/// Random steps: moves of every kind, let go of at any time for any time.
fn steps(random: &mut Rand64) -> String {
    let mut text = String::new();
    let mut number = |from: f64, to: f64| from + random.rand_float() * (to - from);
    for _ in 0..4 {
        let (radius, angle) = (number(0.4, 0.9), number(-1.2, 1.2));
        let (x, y, z) = (
            radius * angle.cos(),
            radius * angle.sin(),
            number(-0.35, -0.2),
        );
        let (yaw, speed) = (number(-3.0, 3.0), number(0.3, 1.0));
        let to = format!("to = [{x}, {y}, {z}, {yaw}], speed = {speed}");
        let step = match number(0.0, 3.0) as u8 {
            0 => format!("jump = {{ {to}, top = {} }}", z.max(number(-0.25, -0.15))),
            1 => format!(
                "joints = {{ to = [{}, {}, {}, {}], speed = {speed} }}",
                number(-1.5, 1.5),
                number(0.3, 2.2),
                number(0.05, 0.25),
                number(-3.0, 3.0)
            ),
            _ => format!("jump = {{ {to}, top = {z} }}"),
        };
        let _ = writeln!(text, "[[cycle]]\n{step}");
        for _ in 0..number(0.0, 3.0) as u8 {
            let (after, lasts) = (number(0.0, 0.6), number(0.02, 0.6));
            let _ = writeln!(
                text,
                "[[cycle]]\nrelease = {{ after = {after}, for = {lasts} }}"
            );
        }
        if number(0.0, 1.0) < 0.3 {
            let (after, to) = (number(0.0, 0.3), number(0.2, 1.0));
            let _ = writeln!(
                text,
                "[[cycle]]\noverride = {{ after = {after}, to = {to} }}"
            );
        }
    }
    text
}

#[test]
fn the_true_tool_stays_slow_and_stands_where_nobody_holds_it() {
    let mut random = Rand64::new(11);
    let (mut stood, mut fast) = (0, 0);
    for k in 0..24 {
        let rate = [500, 1000, 2000][k % 3];
        let payload = [0.0, 2.0, 22.0][k / 3 % 3];
        let text = steps(&mut random);
        let (summary, record) = run_of(scenario(rate, payload, &text), &[], 0);
        assert!(summary.completed, "{k}: {:?}\n{text}", summary.error);
        let holds = holds(&record);
        let mut fastest = 0.0f64;
        for pair in record.truths.windows(2) {
            let (before, now) = (&pair[0].plant, &pair[1].plant);
            let speed = speed(before, now);
            fastest = fastest.max(speed);
            let at = holds.partition_point(|time| *time < before.t);
            let last = at.checked_sub(1).map_or(f64::NEG_INFINITY, |at| holds[at]);
            // 150 ms, and a tenth of a second to stop; what is left is less than a hundredth of the limit.
            if now.t - last > 0.25 {
                let creep = LIMIT / 100.0;
                assert!(speed < creep, "case {k} at {} s: {speed}\n{text}", now.t);
                stood += u32::from(pair[1].mind.mode == Mode::Moving);
            }
        }
        assert!(fastest < LIMIT, "case {k}: {fastest}\n{text}");
        fast += u32::from(fastest > 0.5 * LIMIT);
    }
    assert!(stood > 1000 && fast > 8, "{stood} {fast}");
}

/// At the lowest rates the loop overshoots: manual operation is refused there, and nowhere from the first rate on at which it is not.
#[test]
fn the_tool_stays_slow_at_every_rate_that_is_taken() {
    let rates = [
        100.0, 120.0, 175.0, 200.0, 249.0, 250.0, 251.3, 270.0, 300.0, 333.0, 400.0, 700.0, 1000.0,
        2500.0,
    ];
    for rate in rates {
        for (name, payload) in [("gate", 0.0), ("gate", 22.0), ("arc", 0.0), ("square", 2.0)] {
            let mut scenario = Scenario::built_in(name).unwrap();
            scenario.cycles = 1;
            scenario.payload = (payload > 0.0).then(|| PayloadSpec::compact(payload));
            scenario.operation = OperationName::Manual;
            scenario.rate_hz = rate;
            let checked = Scenario::parse(&scenario.to_toml(), "a test");
            if rate < 250.0 {
                let error = checked.unwrap_err().to_string();
                for word in ["rate_hz is", "250 Hz", "manual"] {
                    assert!(error.contains(word), "{rate}: {error}");
                }
                // A controller asked behind the check's back refuses as well.
                let run = in_process(&RunConfig::new(scenario), &mut ());
                let error = run.map_or_else(|error| error.to_string(), |it| it.error.unwrap());
                assert!(error.contains("limit 250 Hz"), "{rate}: {error}");
                break;
            }
            let (summary, record) = run_of(checked.unwrap(), &[], 0);
            assert!(summary.completed, "{name}, {rate}: {:?}", summary.error);
            let pairs = record.truths.windows(2);
            let speeds = pairs.map(|pair| speed(&pair[0].plant, &pair[1].plant));
            let fastest = speeds.fold(0.0, f64::max);
            assert!(
                (0.2..LIMIT).contains(&fastest),
                "{name}, {payload} kg, {rate} Hz: {fastest}"
            );
        }
    }
}

/// The state says how the arm is operated, and that it waits.
#[test]
fn the_state_tells_the_operation() {
    let text = "[[cycle]]\njump = { to = [0.7, -0.1, -0.27, 0.0], top = -0.25 }\n\
                [[cycle]]\nrelease = { after = 0.3, for = 1.0 }\n";
    let (summary, record) = run_of(scenario(1000, 2.0, text), &[], 0);
    assert!(summary.completed, "{:?}", summary.error);
    let states =
        record
            .frames
            .iter()
            .filter_map(|(_, frame)| match codec::decode(frame).ok()?.message {
                Message::State(state) => Some(state),
                _ => None,
            });
    let moving: Vec<_> = states.filter(|state| state.mode == Mode::Moving).collect();
    assert!(
        moving
            .iter()
            .all(|state| state.operation == Operation::Manual)
    );
    let waits = moving.iter().filter(|state| state.pace == 0).count();
    // 1 s without 150 ms, 50 times a second.
    assert!((38..=46).contains(&waits), "{waits}");
}

/// An operator who falls silent holds nothing: the arm waits first, and then the controller misses the operator.
#[test]
fn a_silent_operator_lets_go_first() {
    let text = "[[cycle]]\njump = { to = [0.7, -0.1, -0.27, 0.0], top = -0.25 }\n";
    let (summary, record) = run_of(scenario(1000, 2.0, text), &["operator:silent@0.6s"], 0);
    assert!(!summary.completed && summary.at_rest);
    let faults =
        record
            .frames
            .iter()
            .filter_map(|(time, frame)| match codec::decode(frame).ok()?.message {
                Message::Emergency(_, emergency) => Some((time.seconds(), emergency.cause)),
                _ => None,
            });
    let (time, cause) = faults.into_iter().next().unwrap();
    assert_eq!(cause, Cause::OperatorSilent);
    let before: Vec<_> = record
        .truths
        .iter()
        .filter(|it| (time - 0.04..time).contains(&it.plant.t))
        .collect();
    assert!(
        before.iter().all(|it| !it.plant.is_moving()),
        "it stood by then"
    );
}

/// Laws without a model of the arm do not keep the tool as slow as it is planned: they are refused before anything runs, with what would do.
#[test]
fn a_law_that_overshoots_is_refused_in_manual_operation() {
    let text = "[[cycle]]\njump = { to = [0.7, -0.1, -0.27, 0.0], top = -0.25 }\n";
    for law in Law::ALL {
        let mut text = scenario(1000, 22.0, text).to_toml();
        text = text.replace("computed-torque:observer", law.name());
        let manual = Scenario::parse(&text, "a test");
        // Whatever the law, nothing is wrong with it where no tool has to be slow.
        let mut automatic =
            Scenario::parse(&text.replace("operation = \"manual\"", ""), "a test").unwrap();
        if law.takes_compensation() {
            assert!(manual.is_ok(), "{law}");
            continue;
        }
        let error = manual.unwrap_err().to_string();
        for word in ["law is", law.name(), "computed-torque", "250 mm/s"] {
            assert!(error.contains(word), "{law}: {error}");
        }
        // A run is the oracle for the worst of them: asked to be manual behind the check's back it is stopped.
        automatic.operation = OperationName::Manual;
        automatic.rate_hz = 250.0;
        let (summary, _) = run_of(automatic, &[], 0);
        if *law == Law::Pid {
            let fault = summary.fault.unwrap();
            assert!(fault.contains("over speed, tool"), "{fault}");
        }
    }
}

/// A scenario lets go only where moves are held.
#[test]
fn a_release_in_automatic_operation_is_refused() {
    let text = "name = \"a\"\ncycles = 1\nrate_hz = 1000\nlaw = \"computed-torque:observer\"\nstart = [0.5, 0.1, -0.27, 0.0]\n\
                [[cycle]]\njump = { to = [0.7, -0.1, -0.27, 0.0], top = -0.25 }\n[[cycle]]\nrelease = { after = 0.3, for = 1.0 }\n";
    let error = Scenario::parse(text, "a test").unwrap_err().to_string();
    assert!(
        error.contains("cycle[1].release.after") && error.contains("operation = \"manual\""),
        "{error}"
    );
}
