//! Faults of the controller on the emulated board, planted in mid-motion: behaviour of pins, drives and bus.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use channel::Fault;
use firmware::cabinet::pins::{RUNNING, TORQUE_OFF};
use firmware::cabinet::reset::Stop;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{DriveStatus, Message, Mode, Node as Name, ResetReason};
use protocol::time::Instant;

use crate::external::peers;
use crate::qemu::{Channel, Options, Qemu};
use sim::drives::Drives;
use sim::observer::{Observer, Truth};
use sim::operator::Operator;
use sim::rig::Rig;
use sim::setup::RunConfig;

/// Samples for which the arm has been moving when the fault is planted.
const IN_MOTION: u32 = 90;
/// Samples from the fault to the verdict: time for five heartbeats.
const AFTERWARDS: u64 = 500;
/// Most samples until the drives have switched torque off: at 1 kHz they hold the last command for 5, and a frame may be in
/// transmission.
const LET_GO: u64 = 5 + 3;
/// Fault status of an access that is not allowed, by an instruction or while stacking (CFSR: DACCVIOL, MSTKERR).
const OUT_OF_STACK: u32 = 1 << 1 | 1 << 4;
/// Speed below which the lift counts as at rest, m/s.
const STANDING: f64 = 1e-3;

/// A fault to plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planted {
    /// By the image itself.
    Fault(Fault),
    /// A reset by network management, which every image obeys, with frames on this channel.
    Reset(Channel),
}

impl Planted {
    /// All faults that can be planted.
    pub fn all() -> impl Iterator<Item = Self> {
        Fault::ALL
            .into_iter()
            .map(Self::Fault)
            .chain([Channel::Fifo, Channel::Uart].map(Self::Reset))
    }

    /// Name, lower case with hyphens.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fault(fault) => fault.name(),
            Self::Reset(Channel::Fifo) => "software-reset",
            Self::Reset(Channel::Uart) => "reset-over-uart",
        }
    }

    /// Reason that the controller has to report.
    fn reason(self) -> ResetReason {
        match self {
            Self::Fault(Fault::Panic) => ResetReason::Panic,
            Self::Fault(_) => ResetReason::HardFault,
            Self::Reset(_) => ResetReason::Software,
        }
    }

    /// Bits of the fault status, one of which has to be set.
    fn status(self) -> u32 {
        match self {
            Self::Fault(Fault::StackOverflow | Fault::OverflowInInterrupt) => OUT_OF_STACK,
            Self::Fault(Fault::HardFault) => u32::MAX,
            Self::Fault(Fault::Panic) | Self::Reset(_) => 0,
        }
    }
}

/// Observations of one fault.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Report of the board after its restart.
    pub stop: Option<Stop>,
    /// Reasons in the heartbeats since.
    pub reasons: Vec<ResetReason>,
    /// Mode in the newest heartbeat.
    pub mode: Option<Mode>,
    /// Samples until the drives had no torque and the brake was closing, for good.
    pub let_go: Option<u64>,
    /// Whether the lift's brake was closed at the end.
    pub braked: bool,
    /// Speed of the lift at the end, m/s. The other axes have no brake: they coast.
    pub lift: f64,
    /// The log, before and after.
    pub log: String,
}

impl Seen {
    /// Deviations from the required behaviour after `planted`; empty if there are none.
    pub fn wrong(&self, planted: Planted) -> Vec<String> {
        let reason = planted.reason();
        let stop = self.stop.as_ref();
        let status = stop.map_or(0, |stop| stop.status);
        let expected = planted.status();
        [
            (
                stop.is_none_or(|stop| stop.pins != [RUNNING, TORQUE_OFF]),
                "pins not those of motion before, or not those without torque after",
            ),
            (
                stop.is_none_or(|stop| stop.reason != reason),
                "another reason in the record",
            ),
            (
                (status & expected == 0) != (expected == 0),
                "fault status of another fault",
            ),
            (
                self.reasons.is_empty() || self.reasons.iter().any(|seen| *seen != reason),
                "another reason in a heartbeat, or none",
            ),
            (
                self.mode != Some(Mode::PreOperational),
                "controller not disabled",
            ),
            (
                self.let_go.is_none_or(|samples| samples > LET_GO),
                "drives kept torque on for too long",
            ),
            (!self.braked, "brake open"),
            (self.lift.abs() > STANDING, "lift moving"),
            (
                !self.log.contains(&format!("started: {reason:?}")),
                "another reason in the log",
            ),
        ]
        .into_iter()
        .filter(|(wrong, _)| *wrong)
        .map(|(_, what)| what.to_string())
        .collect()
    }
}

/// Plants a fault in the middle of the first move of a scenario, and observes for a while.
///
/// # Errors
/// The run did not get that far, or the board did not restart.
pub fn plant(config: &RunConfig, image: &Path, planted: Planted) -> Result<Seen, String> {
    let text = |error: &dyn std::error::Error| error.to_string();
    let rig = config.rig().map_err(|error| text(&error))?;
    let options = Options {
        image: Some(image.into()),
        channel: match planted {
            Planted::Fault(_) => Channel::Fifo,
            Planted::Reset(channel) => channel,
        },
        in_step: true,
        ..Options::default()
    };
    let controller = Qemu::start(rig.controller(), &options).map_err(|error| text(&error))?;
    let controller = Rc::new(RefCell::new(controller));
    let drives = Drives::new(&rig.actual, rig.period);
    let mut rig = Rig::new(&rig);
    rig.attach(drives);
    rig.attach(Operator::new(&config.scenario));
    rig.attach(Rc::clone(&controller));
    let mut watch = Watch::default();
    while watch.moving < IN_MOTION {
        rig.step(&mut (), &mut watch)
            .map_err(|error| text(&error))?;
        if let Some(outcome) = rig.outcome() {
            let why = outcome.as_ref().err().map(ToString::to_string);
            return Err(why.unwrap_or_else(|| "the arm never moved long enough".into()));
        }
    }
    match planted {
        Planted::Fault(fault) => controller
            .borrow_mut()
            .plant(fault)
            .map_err(|error| text(&error))?,
        Planted::Reset(_) => rig.inject(&peers::reset()),
    }
    watch.since = Some(0);
    // The operator waits for the end of its move and requests nothing more.
    for _ in 0..AFTERWARDS {
        rig.step(&mut (), &mut watch)
            .map_err(|error| text(&error))?;
    }
    watch.seen.stop = controller.borrow().last_stop();
    watch.seen.log = controller.borrow_mut().take_log()?;
    Ok(watch.seen)
}

/// Watches the bus and the arm.
#[derive(Default)]
struct Watch {
    /// Samples for which the arm has been moving.
    moving: u32,
    /// Samples since the fault.
    since: Option<u64>,
    seen: Seen,
}

impl Observer for Watch {
    fn frame(&mut self, _: Instant, frame: &CanFrame) -> std::io::Result<()> {
        let (Some(samples), Ok(received)) = (self.since, codec::decode(frame)) else {
            return Ok(());
        };
        match received.message {
            Message::Heartbeat(Name::Controller, heartbeat) => {
                self.seen.reasons.push(heartbeat.reset);
                self.seen.mode = Some(heartbeat.state);
            }
            Message::Feedback(feedback) => {
                let torque = feedback.status.contains(DriveStatus::TORQUE_ON);
                self.seen.let_go = match self.seen.let_go {
                    _ if torque => None,
                    None => Some(samples),
                    seen => seen,
                };
                self.seen.braked = !feedback.status.contains(DriveStatus::BRAKE_RELEASED);
            }
            _ => {}
        }
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> std::io::Result<()> {
        self.moving += u32::from(truth.mind.mode == Mode::Moving);
        self.since = self.since.map(|samples| samples + 1);
        self.seen.lift = truth.plant.qd[2];
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Seen {
        Seen {
            stop: Some(Stop {
                reason: ResetReason::HardFault,
                pins: [RUNNING, TORQUE_OFF],
                at: 0x1234,
                status: OUT_OF_STACK,
            }),
            reasons: vec![ResetReason::HardFault; 5],
            mode: Some(Mode::PreOperational),
            let_go: Some(LET_GO),
            braked: true,
            lift: 0.0,
            log: "0.342 INFO started: HardFault".into(),
        }
    }

    /// Each possible deviation, one at a time.
    #[test]
    fn whatever_is_not_as_it_has_to_be_is_named() {
        const PLANTED: Planted = Planted::Fault(Fault::StackOverflow);
        assert_eq!(good().wrong(PLANTED), Vec::<String>::new());
        let stop = good().stop.unwrap();
        let other = |change: &dyn Fn(&mut Stop)| {
            let mut stop = stop;
            change(&mut stop);
            Some(stop)
        };
        let cases: [(&str, Seen); 11] = [
            (
                "pins",
                Seen {
                    stop: other(&|stop| stop.pins = [RUNNING; 2]),
                    ..good()
                },
            ),
            (
                "record",
                Seen {
                    stop: other(&|stop| stop.reason = ResetReason::Panic),
                    ..good()
                },
            ),
            (
                "status",
                Seen {
                    stop: other(&|stop| stop.status = 1 << 16),
                    ..good()
                },
            ),
            (
                "heartbeat",
                Seen {
                    reasons: vec![],
                    ..good()
                },
            ),
            (
                "heartbeat",
                Seen {
                    reasons: vec![ResetReason::PowerOn],
                    ..good()
                },
            ),
            (
                "disabled",
                Seen {
                    mode: Some(Mode::Enabled),
                    ..good()
                },
            ),
            (
                "torque",
                Seen {
                    let_go: None,
                    ..good()
                },
            ),
            (
                "torque",
                Seen {
                    let_go: Some(LET_GO + 1),
                    ..good()
                },
            ),
            (
                "brake",
                Seen {
                    braked: false,
                    ..good()
                },
            ),
            (
                "lift",
                Seen {
                    lift: -0.1,
                    ..good()
                },
            ),
            (
                "log",
                Seen {
                    log: "0.000 INFO started: PowerOn".into(),
                    ..good()
                },
            ),
        ];
        for (word, seen) in cases {
            let wrong = seen.wrong(PLANTED);
            assert!(
                wrong.len() == 1 && wrong[0].contains(word),
                "{word}: {wrong:?}"
            );
        }
    }
}
