//! Feeds a trace into a fresh controller and compares its commands byte for byte.
//!
//! The controller is a function of the frames it receives, so the same trace gives the same commands: on this machine,
//! on another, on a board. If they differ, either the program differs or the trace lacks frames that the controller
//! received.

use firmware::control::controller::Config;
use protocol::messages::Node;
use protocol::table;
use protocol::time::{Duration, Instant};
use trace::difference::Difference;
use trace::{Entry, Record};

use crate::twin::Twin;

/// Commands that may wait to appear in the trace: more than any queue between controller and bus holds.
const WAITING: usize = 64;
/// Silence after which the controller has nothing left to react to; further silence is skipped.
const SETTLED: Duration = Duration::from_secs(1);

/// A controller under replay: the twin of the recorded one.
pub struct Replay {
    twin: Twin,
    /// Time of the last record.
    now: Instant,
    compared: u64,
}

impl Replay {
    /// A fresh controller of this configuration.
    #[must_use]
    pub fn new(config: Config) -> Self {
        Self {
            twin: Twin::new(config),
            now: Instant::ORIGIN,
            compared: 0,
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
