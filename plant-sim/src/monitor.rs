//! Live view of a bus: statistics of the last second, and errors since the start.

mod pages;
mod rows;
mod view;

use std::collections::{BTreeMap, VecDeque};

use protocol::codec;
use protocol::frame::Id;
use protocol::messages::{Cause, Message, State};

use protocol::wire::BitTiming;
use trace::stats::{Gatherer, Statistics};
use trace::{Entry, Record};

pub use rows::{Happening, Row};
pub use view::{Page, View};

/// Span of the rates shown, us.
const WINDOW_US: u64 = 1_000_000;
/// Events kept.
const EVENTS: usize = 1000;
/// Repetitions of an event within this time count as one, us.
const REPEATED_US: u64 = 100_000;

/// Gathers the data to show.
pub struct Monitor {
    title: String,
    timing: BitTiming,
    /// Since the start: losses and errors.
    total: Gatherer,
    /// Since the last full second, and the second before it: rates, jitter, load.
    growing: Gatherer,
    window: Option<Statistics>,
    window_end_us: Option<u64>,
    started_us: Option<u64>,
    newest_us: u64,
    newest: BTreeMap<Id, Record>,
    state: Option<State>,
    events: VecDeque<Event>,
    happened: u64,
    missed: u64,
}

/// A past event that remains of interest.
#[derive(Clone)]
struct Event {
    /// From 1 on.
    number: u64,
    time_us: u64,
    text: String,
}

/// What there is to know at one moment. It stays as it is while the monitor goes on.
pub struct Picture {
    title: String,
    total: Statistics,
    window: Option<Statistics>,
    started_us: Option<u64>,
    newest: BTreeMap<Id, Record>,
    state: Option<State>,
    events: VecDeque<Event>,
    missed: u64,
}

impl Monitor {
    /// An empty monitor of the bus of this name; the load is that of a bus of this timing.
    #[must_use]
    pub fn new(title: &str, timing: BitTiming) -> Self {
        Self {
            title: title.to_owned(),
            timing,
            total: Gatherer::new(timing),
            growing: Gatherer::new(timing),
            window: None,
            window_end_us: None,
            started_us: None,
            newest_us: 0,
            newest: BTreeMap::new(),
            state: None,
            events: VecDeque::new(),
            happened: 0,
            missed: 0,
        }
    }

    /// Frames that were on the bus since the start and did not come here.
    pub fn missed(&mut self, frames: u64) {
        self.missed = frames;
    }

    /// Adds a record from the bus.
    pub fn record(&mut self, record: &Record) {
        self.tick(record.time_us);
        self.total.record(record);
        self.growing.record(record);
        let frame = match &record.entry {
            Entry::Frame(frame) => frame,
            Entry::Error(error) => {
                return self.event(format!("error frame: {}", error.classes().join(", ")));
            }
        };
        self.newest.insert(frame.id(), *record);
        let Ok(received) = codec::decode(frame) else {
            return;
        };
        match received.message {
            Message::State(state) => {
                let before = self.state.replace(state);
                if before.is_none_or(|before| before.mode != state.mode) {
                    self.event(match state.cause {
                        Cause::None => format!("mode {}", state.mode),
                        _ => format!("mode {}: {}", state.mode, state.fault()),
                    });
                }
            }
            Message::Emergency(node, emergency) if emergency.cause == Cause::None => {
                self.event(format!("{node}: faults cleared"));
            }
            Message::Emergency(node, emergency) => self.event(format!(
                "{node}: {} (code {:04X}h): {}",
                emergency.cause,
                emergency.code,
                emergency.cause.describe()
            )),
            Message::EStop(_) => self.event("emergency stop on the bus".into()),
            _ => {}
        }
    }

    /// Advances the time, also while the bus is silent.
    pub fn tick(&mut self, now_us: u64) {
        self.newest_us = self.newest_us.max(now_us);
        self.started_us.get_or_insert(now_us);
        let end = *self.window_end_us.get_or_insert(now_us + WINDOW_US);
        if self.newest_us >= end {
            let full = std::mem::replace(&mut self.growing, Gatherer::new(self.timing));
            self.window = Some(full.statistics());
            self.window_end_us = Some(self.newest_us + WINDOW_US);
        }
    }

    /// What there is to know now.
    #[must_use]
    pub fn picture(&self) -> Picture {
        Picture {
            title: self.title.clone(),
            total: self.total.statistics(),
            window: self.window.clone(),
            started_us: self.started_us,
            newest: self.newest.clone(),
            state: self.state,
            events: self.events.clone(),
            missed: self.missed,
        }
    }

    fn event(&mut self, text: String) {
        if let Some(last) = self.events.back_mut()
            && last.text == text
            && self.newest_us - last.time_us < REPEATED_US
        {
            last.time_us = self.newest_us;
            return;
        }
        if self.events.len() == EVENTS {
            self.events.pop_front();
        }
        self.happened += 1;
        self.events.push_back(Event {
            number: self.happened,
            time_us: self.newest_us,
            text,
        });
    }
}
