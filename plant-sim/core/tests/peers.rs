//! Failing peers, as wrappers of working ones, and how a run ends with them.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{EStop, EStopReason, Message, Mode};
use protocol::table;
use protocol::time::{Duration, Instant};
use sim::controller::InProcess;
use sim::drives::Drives;
use sim::observer::{Observer, Truth};
use sim::operator::Operator;
use sim::peer::{Outbox, Peer, PeerError};
use sim::rig::{Rig, RunError, STANDSTILL_LIMIT};
use sim::run::{in_process, with_controller};
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::world::OperatorError;
use sim::world::World;

fn gate() -> RunConfig {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    RunConfig::new(scenario)
}

/// A peer whose frames pass through `fault` on their way out.
struct Faulty<P, F> {
    peer: P,
    fault: F,
}

impl<P: Peer, F: FnMut(Instant, CanFrame, &mut Outbox)> Peer for Faulty<P, F> {
    fn wake(&self) -> Option<Instant> {
        self.peer.wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let mut sent = Outbox::new();
        self.peer.poll(now, received, world, &mut sent)?;
        for (time, frame) in sent {
            (self.fault)(time, frame, out);
        }
        Ok(())
    }
}

/// A node that sends at its own times and never listens.
struct Babbler {
    frame: CanFrame,
    next: Instant,
    every: Duration,
}

impl Peer for Babbler {
    fn wake(&self) -> Option<Instant> {
        Some(self.next)
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        _: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        if received.is_none() {
            out.push((now, self.frame));
            self.next = now + self.every;
        }
        Ok(())
    }
}

/// What was on the bus, and the last truth.
#[derive(Default)]
struct Seen {
    frames: Vec<(Instant, CanFrame)>,
    truth: Option<Truth>,
}

impl Observer for Seen {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> std::io::Result<()> {
        self.frames.push((time, *frame));
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> std::io::Result<()> {
        self.truth = Some(*truth);
        Ok(())
    }
}

impl Seen {
    fn count(&self, info: &protocol::schema::MessageInfo) -> usize {
        self.frames
            .iter()
            .filter(|(_, frame)| info.identifies(frame))
            .count()
    }
}

/// Every tenth command is lost: the drives hold the last torque, and the gate still completes.
#[test]
fn a_wrapper_drops_frames() {
    let mut seen = Seen::default();
    let mut count = 0;
    let summary = with_controller(
        &gate(),
        |config| {
            Ok(Faulty {
                peer: InProcess::new(config),
                fault: |time, frame: CanFrame, out: &mut Outbox| {
                    let command = table::COMMAND.identifies(&frame);
                    count += u32::from(command);
                    if !command || count % 10 != 0 {
                        out.push((time, frame));
                    }
                },
            })
        },
        &mut (),
        &mut seen,
    )
    .unwrap();
    assert_eq!(summary.error, None);
    let (feedback, commands) = (seen.count(&table::FEEDBACK), seen.count(&table::COMMAND));
    assert_eq!(commands, feedback - feedback / 10);
    assert_eq!(summary.overruns, feedback as u64 / 10);
}

/// Feedback 300 us late is answered 300 us late, and duplicate feedback is not answered twice.
#[test]
fn a_wrapper_delays_and_doubles_frames() {
    let late = Duration::from_micros(300);
    let answers = |delay: Duration, copies: usize| {
        let config = gate();
        let rig_config = config.rig().unwrap();
        let mut rig = Rig::new(&rig_config);
        rig.attach(Faulty {
            peer: Drives::new(&rig_config.actual, rig_config.period),
            fault: |time, frame, out: &mut Outbox| {
                for _ in 0..copies {
                    out.push((time + delay, frame));
                }
            },
        });
        rig.attach(InProcess::new(rig_config.controller()));
        let mut seen = Seen::default();
        for _ in 0..50 {
            rig.step(&mut (), &mut seen).unwrap();
        }
        seen
    };
    let (good, delayed) = (answers(Duration::ZERO, 1), answers(late, 1));
    let first = |seen: &Seen| {
        let mut frames = seen.frames.iter();
        frames
            .find(|(_, frame)| table::COMMAND.identifies(frame))
            .unwrap()
            .0
    };
    // The controller's first frames delay the first feedback, but not the late one.
    assert_eq!(good.count(&table::COMMAND), 50);
    assert_eq!(delayed.count(&table::COMMAND), 50);
    assert!(first(&delayed) > first(&good));
    let doubled = answers(Duration::ZERO, 2);
    assert_eq!(doubled.count(&table::FEEDBACK), 100);
    assert_eq!(doubled.count(&table::COMMAND), 50);
}

/// A node that repeats an emergency stop stops the run, which ends at rest and reports why.
#[test]
fn a_babbler_is_one_more_peer() {
    let config = gate();
    let rig_config = config.rig().unwrap();
    let stop = EStop {
        reason: EStopReason::BUTTON,
        counter: 0,
    };
    let mut rig = Rig::new(&rig_config);
    rig.attach(Drives::new(&rig_config.actual, rig_config.period));
    rig.attach(Operator::new(&config.scenario));
    rig.attach(InProcess::new(rig_config.controller()));
    let every = Duration::from_millis(3);
    rig.attach(Babbler {
        frame: codec::encode(&Message::EStop(stop), 0).unwrap(),
        next: Instant::from_micros(400_000),
        every,
    });
    let mut seen = Seen::default();
    let result = rig.run(&mut (), &mut seen);
    assert!(
        matches!(
            result,
            Err(RunError::Operator(OperatorError::Stopped {
                mode: Mode::EStop,
                ..
            }))
        ),
        "{result:?}"
    );
    assert!(rig.is_at_rest());
    let stops: Vec<Instant> = seen
        .frames
        .iter()
        .filter(|(_, frame)| table::ESTOP.identifies(frame))
        .map(|(time, _)| *time)
        .collect();
    assert!(stops.len() > 10);
    for pair in stops.windows(2) {
        // A frame in transmission may delay one of them.
        assert!(pair[1].since(pair[0]) < every + Duration::from_micros(200));
    }
}

/// A controller that falls silent in the middle of a move is a valid result: torque is off, and the arm at rest.
#[test]
fn silence_of_the_controller_is_a_result() {
    let silent = Instant::from_micros(450_000);
    let mut seen = Seen::default();
    let summary = with_controller(
        &gate(),
        |config| {
            Ok(Faulty {
                peer: InProcess::new(config),
                fault: |time, frame, out: &mut Outbox| {
                    if time < silent {
                        out.push((time, frame));
                    }
                },
            })
        },
        &mut (),
        &mut seen,
    )
    .unwrap();
    assert!(!summary.completed);
    let error = summary.error.unwrap();
    assert!(
        error.starts_with("the controller has been silent since 0.44"),
        "{error}"
    );
    assert!(summary.at_rest);
    let last = seen.truth.unwrap().plant;
    assert!(last.qd.iter().all(|qd| qd.abs() < 1e-3), "{last:?}");
    assert!(last.t < 0.45 + 1.0 + STANDSTILL_LIMIT.seconds());
    // It was moving when the controller fell silent.
    assert!(summary.speed_utilisation[0] > 0.1);
}

/// A motor that dies in motion: the first fault is reported, not the move refused after it, and the run continues until every
/// axis is at rest.
#[test]
fn the_first_fault_is_reported_and_the_arm_comes_to_rest() {
    let mut config = gate();
    config.scenario.faults = vec!["motor:elbow:dead@0.4s".parse().unwrap()];
    let mut seen = Seen::default();
    let summary = in_process(&config, &mut seen).unwrap();
    let first = &summary.faults[0];
    let error = summary.error.as_ref().unwrap();
    assert!(
        error.starts_with("the controller went to") && error.ends_with(&first.text),
        "{error}; {first:?}"
    );
    assert!(summary.at_rest);
    let last = seen.truth.unwrap().plant;
    assert!(last.qd.iter().all(|qd| qd.abs() < 1e-3), "{last:?}");
}

/// A controller in whose answers something is found wrong after the run, as on a board that is compared behind.
struct FoundOut(InProcess);

impl Peer for FoundOut {
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
        self.0.poll(now, received, world, out)
    }

    fn finish(&mut self) -> Result<(), PeerError> {
        Err(PeerError {
            who: "late".into(),
            what: "differs".into(),
        })
    }
}

#[test]
fn what_a_peer_finds_out_after_the_end_fails_the_run() {
    let connect = |config| Ok(FoundOut(InProcess::new(config)));
    let summary = with_controller(&gate(), connect, &mut (), &mut ()).unwrap();
    assert!(!summary.completed);
    assert_eq!(
        summary.error.as_deref(),
        Some("the controller late differs")
    );
}
