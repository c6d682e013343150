//! Moves of one axis as long as a person presses a button, in a run that goes on.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/live.rs"]
mod live;

use std::io;

use live::live;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Mode, MotionRequest, Operation};
use protocol::time::Instant;
use sim::controller::InProcess;
use sim::live::Live;
use sim::observer::{Observer, Truth};
use sim::operator::Order;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

/// Frames and samples.
#[derive(Default)]
struct Record {
    frames: Vec<CanFrame>,
    truths: Vec<Truth>,
}

impl Observer for Record {
    fn frame(&mut self, _: Instant, frame: &CanFrame) -> io::Result<()> {
        self.frames.push(*frame);
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.truths.push(*truth);
        Ok(())
    }
}

/// A run after its scenario, the axes under torque.
fn standing() -> (Live<'static>, Record) {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    let config = RunConfig::new(scenario);
    let mut run = Live::new(&config, |config| Ok(InProcess::new(config))).unwrap();
    live(&mut run, &mut Record::default(), 3.0);
    assert!(!run.is_scripted());
    (run, Record::default())
}

/// Whether the operator has asked for a move.
fn has_asked(seen: &Record) -> bool {
    seen.frames.iter().any(|frame| {
        let message = codec::decode(frame).unwrap().message;
        matches!(message, Message::Motion(motion) if motion.request.is_move())
    })
}

/// A person presses a button of an axis: it goes on as long as the page says that it is pressed, and in automatic operation not at all.
#[test]
fn an_axis_moves_as_long_as_its_button_is_held() {
    let (mut run, mut seen) = standing();
    live(&mut run, &mut seen, 0.01);
    let shoulder = |seen: &Record| seen.truths.last().unwrap().plant.q[0];
    let mut target = seen.truths.last().unwrap().plant.q.map(|q| q as f32);
    target[0] = 2.6;
    let jog = Order::Jog(MotionRequest::MoveJoint {
        target,
        speed: 1.0,
        zone: 0.0,
    });
    let hold = |run: &mut Live<'_>, seen: &mut Record, seconds: f64| {
        for _ in 0..(seconds / 0.05) as u32 {
            run.order(Order::Request(MotionRequest::Hold));
            live(run, seen, 0.05);
        }
    };
    run.order(jog);
    let answers = live(&mut run, &mut seen, 0.2);
    assert!(
        !answers[0].good && answers[0].text.contains("manual operation"),
        "{answers:?}"
    );
    assert!(!has_asked(&seen), "nothing goes out");

    let operation = Operation::Manual;
    run.order(Order::Request(MotionRequest::SetOperation { operation }));
    // Not before the controller has said so.
    run.order(jog);
    let answers = live(&mut run, &mut seen, 0.2);
    assert_eq!(
        answers.iter().filter(|answer| answer.good).count(),
        1,
        "{answers:?}"
    );
    let start = shoulder(&seen);
    run.order(jog);
    live(&mut run, &mut seen, 0.5);
    assert!((shoulder(&seen) - start).abs() < 1e-4, "not held");
    hold(&mut run, &mut seen, 1.0);
    let held = shoulder(&seen);
    // 225 mm/s at half a metre for nearly a second.
    assert!((0.2..0.6).contains(&(held - start)), "{start} {held}");
    // The page is closed.
    live(&mut run, &mut seen, 0.3);
    let rest = shoulder(&seen);
    live(&mut run, &mut seen, 1.0);
    assert!(
        (shoulder(&seen) - rest).abs() < 1e-4 && rest - held < 0.1,
        "{held} {rest}"
    );
    // Let go of: a stop, after which a late hold moves nothing.
    hold(&mut run, &mut seen, 0.2);
    run.order(Order::Request(MotionRequest::Stop));
    hold(&mut run, &mut seen, 0.3);
    let rest = shoulder(&seen);
    hold(&mut run, &mut seen, 0.5);
    assert_eq!(seen.truths.last().unwrap().mind.mode, Mode::Enabled);
    assert!((shoulder(&seen) - rest).abs() < 1e-4);
}
