//! Feeds a trace into a fresh controller and compares its commands byte for byte.
//!
//! The controller is a function of the frames it receives, so the same trace gives the same commands: on this machine,
//! on another, on a board. If they differ, either the program differs or the trace lacks frames that the controller
//! received.

use firmware::control::controller::Config;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Hello, Message, Node, ParameterRequest, Server};
use protocol::table;
use protocol::time::{Duration, Instant};
use trace::difference::Difference;
use trace::{Entry, Record};

use crate::twin::Twin;

/// Commands that may wait to appear in the trace: more than any queue between controller and bus holds.
const WAITING: usize = 64;
/// Silence after which the controller has nothing left to react to; further silence is skipped.
const SETTLED: Duration = Duration::from_secs(1);
/// Samples that show at which rate they come.
const ENOUGH: u32 = 10;

/// A controller under replay: the twin of the recorded one.
pub struct Replay {
    twin: Twin,
    /// Time of the last record.
    now: Instant,
    compared: u64,
    /// The first and the newest feedback, and their times, us.
    samples: Option<[(u64, CanFrame); 2]>,
    /// Schema hash of the peer that asked for the controller's.
    schema: Option<u32>,
}

impl Replay {
    /// A fresh controller of this configuration.
    #[must_use]
    pub fn new(config: Config) -> Self {
        Self {
            twin: Twin::new(config),
            now: Instant::ORIGIN,
            compared: 0,
            samples: None,
            schema: None,
        }
    }

    /// Feeds or compares the next record. After a difference, further results are meaningless.
    ///
    /// # Errors
    /// The first [`Difference`]: `due` is from the replay, `found` from the trace.
    pub fn record(&mut self, record: &Record) -> Result<(), Difference> {
        let Entry::Frame(frame) = &record.entry else {
            return Ok(());
        };
        let info = table::of_frame(frame);
        if info == Some(&table::COMMAND) {
            self.compared += 1;
            return self.twin.compare(frame);
        }
        // The controller did not receive its own frames.
        if info.is_some_and(|info| info.sender == Some(Node::Controller)) {
            return Ok(());
        }
        if info == Some(&table::FEEDBACK) {
            let newest = (record.time_us, *frame);
            self.samples = Some([self.samples.map_or(newest, |[first, _]| first), newest]);
        } else if let Ok(received) = codec::decode(frame)
            && let Message::ParameterRequest(
                Server::Controller,
                ParameterRequest::Hello(Hello { schema, .. }),
            ) = received.message
        {
            self.schema = Some(schema);
        }
        self.pass_time(Instant::from_micros(record.time_us));
        self.twin.call(self.now, Some(frame));
        let due = self.twin.due();
        due.retain(|frame| table::COMMAND.identifies(frame));
        match due.front() {
            Some(first) if due.len() > WAITING => Err(Difference::Missing {
                due: Box::new(*first),
            }),
            _ => Ok(()),
        }
    }

    /// Commands compared. Commands missing after the end of a cut trace are not counted.
    #[must_use]
    pub fn compared(&self) -> u64 {
        self.compared
    }

    /// Schema hash of the other nodes of the trace, if they have said it. With another than its own the controller does not
    /// work.
    #[must_use]
    pub fn schema(&self) -> Option<u32> {
        self.schema
    }

    /// The rate at which the samples of the trace have come so far, Hz.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f64> {
        let [first, newest] =
            self.samples?.map(
                |(time_us, frame)| match codec::decode(&frame).ok()?.message {
                    Message::Feedback(feedback) => Some((time_us, feedback.sample)),
                    _ => None,
                },
            );
        let (first, newest) = (first?, newest?);
        let samples = newest.1.checked_sub(first.1).filter(|&n| n >= ENOUGH)?;
        let time_us = newest.0.checked_sub(first.0).filter(|&us| us > 0)?;
        Some(f64::from(samples) / time_us as f64 * 1e6)
    }

    /// Lets time pass between two frames, with calls of the controller as when they were recorded.
    fn pass_time(&mut self, now: Instant) {
        // The node's time never runs backwards, even if the trace's does.
        let now = self.now.max(now);
        let skipped = Instant::from_nanos(now.nanos().saturating_sub(SETTLED.nanos()));
        if self.twin.controller().is_new() {
            self.twin.call(now, None);
        }
        loop {
            let due = self.twin.controller().due().max(skipped);
            if due >= now {
                break;
            }
            self.twin.call(due, None);
        }
        self.now = now;
    }
}
