//! Judges a trace by the rules of the protocol.
//!
//! - Time does not run backwards.
//! - Every known frame is one that the codec accepts: format, length, CRC, codes, ranges.
//! - Every end-to-end counter increments by one; so does the sample number of the feedback. A node that network
//!   management resets starts anew.
//! - A command echoes the newest feedback, and every feedback is answered before the next one.
//! - No periodic message is missing for longer than two and a half periods, no feedback for longer than the
//!   controller's watchdog.
//! - No torque is commanded without torque enabled, and none beyond the limits of the motors.
//!
//! Foreign identifiers and error frames are counted, not judged.

use firmware::mechanics::arm::ArmModel;
use protocol::codec::{self, DecodeError};
use protocol::e2e::{Receiver, Verdict};
use protocol::frame::CanFrame;
use protocol::messages::{Command, ControlWord, Message, NmtCommand, Node};
use protocol::schema::{MessageInfo, Rate};
use protocol::table::{self, TABLE};

use trace::{Entry, Record};

/// Age at which the frames of every sample count as silent, us: the value of docs/safety.md, written again so
/// that the check does not depend on the code under test.
const SILENCE_US: u64 = 100_000;

/// The first rule that a trace breaks.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Offence {
    /// Time runs backwards.
    #[error("time runs backwards by {by_us} us")]
    Backwards {
        /// By how much.
        by_us: u64,
    },
    /// The codec refuses the frame.
    #[error("{message}: {error}")]
    Refused {
        /// Message of the identifier.
        message: &'static str,
        /// Why.
        error: DecodeError,
    },
    /// The counter does not increment by one.
    #[error("{message}: counter {counter} {}", sequence(*verdict))]
    Counter {
        /// Message.
        message: &'static str,
        /// Counter of the frame.
        counter: u8,
        /// Verdict on the counter.
        verdict: Verdict,
    },
    /// The sample number does not increment by one.
    #[error("Feedback: sample {found} instead of {expected}")]
    Sample {
        /// Number of the frame.
        found: u32,
        /// Number expected after the previous frame.
        expected: u32,
    },
    /// A command without feedback to answer.
    #[error("Command: echoes sample {found} before any feedback")]
    NoFeedback {
        /// Sample echoed.
        found: u32,
    },
    /// A command for another sample than the newest.
    #[error("Command: echoes sample {found}, the newest feedback is {newest}")]
    Echo {
        /// Sample echoed.
        found: u32,
        /// Newest sample.
        newest: u32,
    },
    /// A sample was answered twice.
    #[error("Command: sample {sample} has already been answered")]
    Twice {
        /// Sample echoed.
        sample: u32,
    },
    /// A sample was not answered.
    #[error("Feedback: no command has answered the previous sample {sample}")]
    Unanswered {
        /// Sample without answer.
        sample: u32,
    },
    /// A message is missing.
    #[error("{message}: none for {age_us} us; {limit_us} us are allowed")]
    Age {
        /// Message.
        message: &'static str,
        /// Time since the last.
        age_us: u64,
        /// Longest allowed.
        limit_us: u64,
    },
    /// Torque without torque enabled.
    #[error("Command: motor {motor} is commanded {torque} N m while torque is not enabled")]
    TorqueDisabled {
        /// Motor, 0 to 3.
        motor: usize,
        /// Torque commanded, N m.
        torque: f32,
    },
    /// Torque beyond a motor's limit.
    #[error("Command: motor {motor} is commanded {torque} N m; limit {limit} N m")]
    TorqueLimit {
        /// Motor, 0 to 3.
        motor: usize,
        /// Torque commanded, N m.
        torque: f32,
        /// Limit of the motor, N m.
        limit: f32,
    },
}

fn sequence(verdict: Verdict) -> String {
    match verdict {
        Verdict::Initial | Verdict::Fresh => "is the next".into(),
        Verdict::Lost(frames) => format!("shows that {frames} frames are missing"),
        Verdict::Duplicate => "is a duplicate".into(),
        Verdict::Stale(frames) => format!("is {frames} frames older than the newest"),
    }
}

/// Judges record by record.
pub struct Checker {
    torque_limit: [f32; 4],
    newest_us: u64,
    messages: [Watch; TABLE.len()],
    /// Newest sample, and whether a command has answered it.
    sample: Option<(u32, bool)>,
    commanded: bool,
    counts: Counts,
}

/// Numbers of frames judged and not judged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Known frames.
    pub judged: u64,
    /// Frames with foreign identifiers.
    pub foreign: u64,
    /// Error frames.
    pub error_frames: u64,
}

impl Counts {
    /// The sum of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            judged: self.judged + other.judged,
            foreign: self.foreign + other.foreign,
            error_frames: self.error_frames + other.error_frames,
        }
    }

    /// The counts since `before`.
    #[must_use]
    pub fn minus(self, before: Self) -> Self {
        Self {
            judged: self.judged - before.judged,
            foreign: self.foreign - before.foreign,
            error_frames: self.error_frames - before.error_frames,
        }
    }
}

/// One message of the table.
struct Watch {
    info: &'static MessageInfo,
    receiver: Option<Receiver>,
    seen_us: Option<u64>,
    limit_us: Option<u64>,
}

impl Checker {
    /// A judge of traces of this robot.
    #[must_use]
    pub fn new(arm: &ArmModel) -> Self {
        Self {
            torque_limit: arm.drive.motor_torque_limit.into(),
            newest_us: 0,
            messages: TABLE.map(|info| Watch {
                info,
                receiver: info.protection.map(Receiver::new),
                seen_us: None,
                limit_us: match info.rate {
                    Rate::EverySample => Some(SILENCE_US),
                    Rate::Hertz(hertz) => Some(2_500_000 / u64::from(hertz)),
                    Rate::Event => None,
                },
            }),
            sample: None,
            commanded: false,
            counts: Counts::default(),
        }
    }

    /// Judges the next record.
    ///
    /// # Errors
    /// The rule that it breaks. The rest of the trace is judged as if it had not.
    pub fn record(&mut self, record: &Record) -> Result<(), Offence> {
        let time_us = record.time_us;
        if time_us < self.newest_us {
            let by_us = self.newest_us - time_us;
            return Err(Offence::Backwards { by_us });
        }
        self.newest_us = time_us;
        self.ages(time_us)?;
        match &record.entry {
            Entry::Error(_) => {
                self.counts.error_frames += 1;
                Ok(())
            }
            Entry::Frame(frame) => match table::of_frame(frame) {
                None => {
                    self.counts.foreign += 1;
                    Ok(())
                }
                Some(info) => {
                    self.counts.judged += 1;
                    self.frame(time_us, info, frame)
                }
            },
        }
    }

    /// Counts so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    fn ages(&mut self, now_us: u64) -> Result<(), Offence> {
        for watch in &mut self.messages {
            if let (Some(seen_us), Some(limit_us)) = (watch.seen_us, watch.limit_us)
                && now_us - seen_us > limit_us
            {
                // Reported once; the next frame starts anew.
                watch.seen_us = None;
                return Err(Offence::Age {
                    message: watch.info.name,
                    age_us: now_us - seen_us,
                    limit_us,
                });
            }
        }
        Ok(())
    }

    fn frame(
        &mut self,
        time_us: u64,
        info: &'static MessageInfo,
        frame: &CanFrame,
    ) -> Result<(), Offence> {
        let received = codec::decode(frame).map_err(|error| Offence::Refused {
            message: info.name,
            error,
        })?;
        if let Some(watch) = self.messages.iter_mut().find(|watch| watch.info == info) {
            watch.seen_us = Some(time_us);
            if let (Some(counter), Some(receiver)) = (received.counter, &mut watch.receiver) {
                let verdict = receiver.check(counter);
                if !matches!(verdict, Verdict::Initial | Verdict::Fresh) {
                    return Err(Offence::Counter {
                        message: info.name,
                        counter,
                        verdict,
                    });
                }
            }
        }
        match received.message {
            Message::Feedback(feedback) => self.feedback(feedback.sample),
            Message::Command(command) => self.command(&command),
            Message::Nmt(nmt) if nmt.command == NmtCommand::ResetNode => {
                self.reset(nmt.node);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// The node of this number, or every node for 0, restarts: its counters start anew, and it may take its time.
    fn reset(&mut self, node: u8) {
        let is_it = |sender: Node| node == 0 || node == sender.code();
        for watch in &mut self.messages {
            if watch.info.sender.is_none_or(is_it) {
                watch.seen_us = None;
                if let Some(receiver) = &mut watch.receiver {
                    receiver.reset();
                }
            }
        }
        if is_it(Node::Drives) {
            self.sample = None;
        }
        if is_it(Node::Controller) {
            self.commanded = false;
        }
    }

    fn feedback(&mut self, found: u32) -> Result<(), Offence> {
        let before = self.sample.replace((found, false));
        let Some((sample, answered)) = before else {
            return Ok(());
        };
        let expected = sample.wrapping_add(1);
        if found != expected {
            return Err(Offence::Sample { found, expected });
        }
        // The drives may start before the controller.
        if self.commanded && !answered {
            return Err(Offence::Unanswered { sample });
        }
        Ok(())
    }

    fn command(&mut self, command: &Command) -> Result<(), Offence> {
        self.commanded = true;
        let found = command.sample;
        match &mut self.sample {
            None => return Err(Offence::NoFeedback { found }),
            Some((newest, _)) if *newest != found => {
                return Err(Offence::Echo {
                    found,
                    newest: *newest,
                });
            }
            Some((sample, true)) => return Err(Offence::Twice { sample: *sample }),
            Some((_, answered)) => *answered = true,
        }
        let enabled = command.control.contains(ControlWord::TORQUE_ENABLE);
        for (motor, (&torque, &limit)) in command.torque.iter().zip(&self.torque_limit).enumerate()
        {
            if !enabled && torque != 0.0 {
                return Err(Offence::TorqueDisabled { motor, torque });
            }
            if torque.abs() > limit {
                return Err(Offence::TorqueLimit {
                    motor,
                    torque,
                    limit,
                });
            }
        }
        Ok(())
    }
}
