//! Feeds a trace into a fresh controller and compares what it commands, byte for byte.
//!
//! The controller is a function of the frames it receives and of the time it is told, so the same trace gives the same
//! commands: on this machine, on another, on a board. Where they part, either the program differs or the trace is not
//! all that the controller received.

use std::collections::VecDeque;

use firmware::control::controller::Config;
use protocol::codec::DecodeError;
use protocol::frame::CanFrame;
use protocol::messages::Node;
use protocol::table;

use sim::endpoint::{Endpoint, EndpointError, InProcess};
use trace::fields::{Decoded, full_name};
use trace::{Entry, Record};

/// Commands that may wait for their place in the trace: more than any queue between controller and bus holds.
const WAITING: usize = 64;
/// Silence after which the controller has reacted to all there is to react to, us; more of it is skipped.
const SETTLED_US: u64 = 1_000_000;

/// Where the commands part.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum Difference {
    /// A field differs.
    #[error("sample {sample}: {field} is {recorded} in the trace, {replayed} in the replay")]
    Field {
        /// Sample that the replayed command answers.
        sample: u32,
        /// Field of the command.
        field: String,
        /// Value in the trace.
        recorded: String,
        /// Value in the replay.
        replayed: String,
    },
    /// The command in the trace is none.
    #[error("sample {sample}: the command in the trace is damaged: {error}")]
    Damaged {
        /// Sample that the replayed command answers.
        sample: u32,
        /// What is wrong with it.
        error: DecodeError,
    },
    /// The controller gave a command that is not in the trace.
    #[error("sample {sample}: the trace has no command")]
    Missing {
        /// Sample that the replayed command answers.
        sample: u32,
    },
    /// The trace has a command that the controller did not give.
    #[error("the trace has a command that the replay has not: {frame:?}")]
    Surplus {
        /// The command.
        frame: CanFrame,
    },
}

/// A controller under replay.
pub struct Replay {
    controller: InProcess,
    period_us: u64,
    /// When the controller last looked at its bus.
    polled_us: Option<u64>,
    /// Commands given and not yet found in the trace.
    given: VecDeque<CanFrame>,
    sent: Vec<CanFrame>,
    compared: u64,
}

impl Replay {
    /// A fresh controller of this configuration.
    #[must_use]
    pub fn new(config: Config) -> Self {
        Self {
            // At least once a sample is what a node asks for; a microsecond is the trace's resolution.
            period_us: ((f64::from(config.period) * 1e6) as u64).max(1),
            controller: InProcess::new(config),
            polled_us: None,
            given: VecDeque::new(),
            sent: Vec::new(),
            compared: 0,
        }
    }

    /// Feeds or compares the next record. After a difference, what follows means nothing.
    ///
    /// # Errors
    /// The first [`Difference`].
    pub fn record(&mut self, record: &Record) -> Result<(), Difference> {
        let Entry::Frame(frame) = &record.entry else {
            return Ok(());
        };
        let info = table::of_frame(frame);
        if info == Some(&table::COMMAND) {
            let given = self
                .given
                .pop_front()
                .ok_or(Difference::Surplus { frame: *frame })?;
            self.compared += 1;
            return compare(frame, &given);
        }
        // What the controller itself sent, it did not receive.
        if info.is_some_and(|info| info.sender == Some(Node::Controller)) {
            return Ok(());
        }
        self.pass_time(record.time_us);
        self.poll(record.time_us, Some(frame));
        match self.given.front() {
            Some(given) if self.given.len() > WAITING => Err(Difference::Missing {
                sample: sample(given),
            }),
            _ => Ok(()),
        }
    }

    /// Commands compared. Those that a trace cut off at its end lacks are none of them.
    #[must_use]
    pub fn compared(&self) -> u64 {
        self.compared
    }

    /// Between two frames the controller looks at its bus once a sample: its watchdogs live on that.
    fn pass_time(&mut self, now_us: u64) {
        let Some(polled) = self.polled_us else {
            return;
        };
        let mut time = polled.max(now_us.saturating_sub(SETTLED_US)) + self.period_us;
        while time < now_us {
            self.poll(time, None);
            time += self.period_us;
        }
    }

    fn poll(&mut self, now_us: u64, frame: Option<&CanFrame>) {
        // The node's time never runs backwards, whatever the trace's does.
        let now_us = self.polled_us.map_or(now_us, |polled| polled.max(now_us));
        self.polled_us = Some(now_us);
        let polled: Result<(), EndpointError> = self.controller.poll(now_us, frame, &mut self.sent);
        // A controller within this process always answers.
        debug_assert!(polled.is_ok());
        let commands = self
            .sent
            .drain(..)
            .filter(|frame| table::of_frame(frame) == Some(&table::COMMAND));
        self.given.extend(commands);
    }
}

fn sample(command: &CanFrame) -> u32 {
    command
        .data()
        .first_chunk()
        .map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

fn compare(recorded: &CanFrame, replayed: &CanFrame) -> Result<(), Difference> {
    // Bit rate switch and error state indicator belong to the link.
    if recorded.data() == replayed.data() {
        return Ok(());
    }
    let sample = sample(replayed);
    let (recorded, replayed) = match (Decoded::new(recorded), Decoded::new(replayed)) {
        (Ok(recorded), Ok(replayed)) => (recorded, replayed),
        (Err(error), _) | (_, Err(error)) => return Err(Difference::Damaged { sample, error }),
    };
    let difference = |field: String, recorded: String, replayed: String| Difference::Field {
        sample,
        field,
        recorded,
        replayed,
    };
    for (one, other) in recorded.fields().zip(replayed.fields()) {
        for ((element, _, one_value), (_, _, other_value)) in one.elements().zip(other.elements()) {
            // Bits, not numbers: 0 and -0 differ.
            let (one_text, other_text) = (one_value.to_string(), other_value.to_string());
            if one_text != other_text {
                return Err(difference(
                    full_name(one.signal.name, element),
                    one_text,
                    other_text,
                ));
            }
        }
    }
    // Content is equal, so it is the counter, the only other thing that a valid frame holds.
    let counter = |decoded: &Decoded| decoded.counter.unwrap_or(0).to_string();
    Err(difference(
        "counter".into(),
        counter(&recorded),
        counter(&replayed),
    ))
}
