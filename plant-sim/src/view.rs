//! A run, or a bus, on a page in the browser: what happens there, and what a person asks for.
//!
//! ```text
//! loop (session)  --Heard-->  scribe  --text-->  viewers (server)
//!                 <--Wish---                     POST /do
//! ```
//!
//! All that the page shows comes from frames, as any other listener on the bus has them. The loop puts them into a bounded
//! queue and never waits: what finds no room is not shown. The scribe, a thread of its own, decodes them and hands texts
//! to the server, whose queue for each viewer is bounded, too: a slow one misses some.

mod air;
pub mod offers;
mod scribe;
mod server;
mod session;
mod sight;
mod wish;

use std::sync::mpsc::{SyncSender, TrySendError};
use std::{collections::VecDeque, io};

use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};
use sim::observer::Observer;
use sim::record::of_run;
use trace::{Entry, ErrorFrame, Record};

pub use air::Air;
pub use scribe::{Scribe, Subject};
pub use server::{ServeError, Server};
pub use session::{Done, Session};
pub use wish::Wish;

/// What the scribe hears.
#[derive(Clone, Debug)]
pub enum Heard {
    /// A record of the bus.
    Record(Record),
    /// A sentence about what was asked for.
    Word(Word),
    /// Records that were on the bus and could not be taken.
    Missed(u64),
}

/// A sentence about what a person has asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Word {
    /// Time, us on the clock of the records.
    pub time_us: u64,
    /// In words.
    pub text: String,
    /// Whether it is as it was asked for.
    pub good: bool,
    /// Whether the scenario goes on.
    pub scripted: bool,
}

/// Room for records between a loop and its scribe: more than a bus carries in half a second.
pub const ROOM: usize = 8192;

/// The loop's end of the queue.
#[derive(Debug)]
pub struct Ear {
    queue: SyncSender<Heard>,
    /// Words that found no room yet.
    words: VecDeque<Word>,
    missed: u64,
    /// Records that the bus itself had lost so far.
    lost: u64,
}

impl Ear {
    /// An end of `queue`.
    #[must_use]
    pub fn new(queue: SyncSender<Heard>) -> Self {
        Self {
            queue,
            words: VecDeque::new(),
            missed: 0,
            lost: 0,
        }
    }

    /// Passes on a record, or counts it as missed.
    pub fn record(&mut self, record: Record) {
        if self.queue.try_send(Heard::Record(record)).is_err() {
            self.missed += 1;
        }
    }

    /// Passes on a sentence as soon as there is room.
    pub fn say(&mut self, word: Word) {
        self.words.push_back(word);
        self.deliver();
    }

    /// The bus itself has lost so many records since the start.
    pub fn lost(&mut self, records: u64) {
        self.missed += records - self.lost.min(records);
        self.lost = records;
    }

    /// Passes on sentences that found no room before, and how many records did not.
    pub fn deliver(&mut self) {
        while let Some(word) = self.words.pop_front() {
            if let Err(TrySendError::Full(Heard::Word(word))) =
                self.queue.try_send(Heard::Word(word))
            {
                self.words.push_front(word);
                return;
            }
        }
        if self.missed > 0 && self.queue.try_send(Heard::Missed(self.missed)).is_ok() {
            self.missed = 0;
        }
    }
}

impl Observer for Ear {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.record(of_run(time, Entry::Frame(*frame)));
        Ok(())
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, _: Duration) -> io::Result<()> {
        self.record(of_run(time, Entry::Error(*error)));
        Ok(())
    }
}
