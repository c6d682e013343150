//! Statistics of a trace: frames, periods, losses, errors and load, by interface, by identifier and in total.

mod periods;
mod table;
mod tally;

use std::collections::BTreeMap;

use protocol::frame::Id;
use protocol::messages::{Message, NmtCommand};
use protocol::wire::{BitTiming, FrameBits};
use schemars::JsonSchema;
use serde::Serialize;

use super::{Entry, Interface, Record};
use tally::Tally;

pub use periods::{Bin, PeriodStatistics};

/// Window of the peak load, us.
const WINDOW_US: u64 = 100_000;

/// Gathers the statistics of a trace, record by record.
pub struct Gatherer {
    timing: BitTiming,
    skip_us: u64,
    /// In the order of appearance: each bus has its own frames and load.
    buses: Vec<(Interface, Bus)>,
    clock: Clock,
}

/// Time of an interface or of the whole trace, which may jump forwards and back.
#[derive(Clone, Copy, Default)]
struct Clock {
    newest_us: Option<u64>,
    /// Time that has passed: after a step back it counts on from there.
    span_us: u64,
    /// Time in skipped steps.
    skipped_us: u64,
    skipped: u64,
    backwards: u64,
    largest_us: u64,
    largest_back_us: u64,
}

/// From one record to the next.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Step {
    On,
    Skipped,
    Back,
}

impl Clock {
    /// Takes the time of a record.
    fn tick(&mut self, time_us: u64, skip_us: u64) -> Step {
        let newest_us = self.newest_us.replace(time_us).unwrap_or(time_us);
        let Some(step) = time_us.checked_sub(newest_us) else {
            self.backwards += 1;
            self.largest_back_us = self.largest_back_us.max(newest_us - time_us);
            return Step::Back;
        };
        self.largest_us = self.largest_us.max(step);
        if step > skip_us {
            self.skipped_us = self.skipped_us.saturating_add(step);
            self.skipped += 1;
            return Step::Skipped;
        }
        self.span_us = self.span_us.saturating_add(step);
        Step::On
    }

    /// Takes the time of a record of an interface whose own clock made this step: one interface may be ahead of another
    /// without any clock having been set.
    fn follow(&mut self, time_us: u64, skip_us: u64, own: Step) {
        if own == Step::Back || self.newest_us.is_none_or(|newest_us| newest_us <= time_us) {
            self.tick(time_us, skip_us);
        }
    }
}

/// Statistics of one interface in progress.
#[derive(Default)]
struct Bus {
    ids: BTreeMap<Id, Tally>,
    clock: Clock,
    errors: BTreeMap<String, u64>,
    error_frames: u64,
    busy_ns: u64,
    window: u64,
    window_ns: u64,
    peak_ns: u64,
}

impl Gatherer {
    /// Empty statistics; the load will be that of a bus of this timing.
    #[must_use]
    pub fn new(timing: BitTiming) -> Self {
        Self {
            timing,
            skip_us: u64::MAX,
            buses: Vec::new(),
            clock: Clock::default(),
        }
    }

    /// Leaves out steps of time longer than this, us: they count neither as periods nor as time of the trace.
    #[must_use]
    pub fn skipping(self, skip_us: u64) -> Self {
        Self { skip_us, ..self }
    }

    /// Adds the next record.
    pub fn record(&mut self, record: &Record) {
        let place = self
            .buses
            .iter()
            .position(|(name, _)| *name == record.interface);
        let place = place.unwrap_or_else(|| {
            self.buses.push((record.interface, Bus::default()));
            self.buses.len() - 1
        });
        let bus = &mut self.buses[place].1;
        let step = bus.record(record, self.timing, self.skip_us);
        self.clock.follow(record.time_us, self.skip_us, step);
    }

    /// The statistics of the records added.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let buses = || self.buses.iter().map(|(_, bus)| bus);
        let most = |of: fn(&Clock) -> u64| buses().map(|bus| of(&bus.clock)).max().unwrap_or(0);
        Statistics {
            frames: buses().map(Bus::frames).sum(),
            error_frames: buses().map(|bus| bus.error_frames).sum(),
            backwards: buses().map(|bus| bus.clock.backwards).sum(),
            largest_step_s: self.clock.largest_us as f64 / 1e6,
            largest_step_back_s: most(|clock| clock.largest_back_us) as f64 / 1e6,
            skipped_steps: self.clock.skipped,
            skipped_s: self.clock.skipped_us as f64 / 1e6,
            // With interfaces whose clocks differ, the trace is at least as long as each of them.
            span_s: self.clock.span_us.max(most(|clock| clock.span_us)) as f64 / 1e6,
            bitrate: self.timing.nominal(),
            data_bitrate: self.timing.data(),
            interfaces: self
                .buses
                .iter()
                .map(|(name, bus)| bus.statistics(*name))
                .collect(),
        }
    }
}

impl Bus {
    fn record(&mut self, record: &Record, timing: BitTiming, skip_us: u64) -> Step {
        let step = self.clock.tick(record.time_us, skip_us);
        if step == Step::Skipped {
            self.ids.values_mut().for_each(Tally::pause);
        }
        let frame = match &record.entry {
            Entry::Frame(frame) => frame,
            Entry::Error(error) => {
                self.error_frames += 1;
                for class in error.classes() {
                    *self.errors.entry(class).or_default() += 1;
                }
                return step;
            }
        };
        let busy = timing.duration(FrameBits::exact(frame)).nanos();
        self.busy_ns += busy;
        let window = self.clock.span_us / WINDOW_US;
        if window != self.window {
            (self.window, self.window_ns) = (window, 0);
        }
        self.window_ns += busy;
        self.peak_ns = self.peak_ns.max(self.window_ns);
        let tally = self
            .ids
            .entry(frame.id())
            .or_insert_with(|| Tally::new(frame));
        if let Some(Message::Nmt(nmt)) = tally.frame(record.time_us, frame, busy)
            && nmt.command == NmtCommand::ResetNode
        {
            // A restarted node counts from the start.
            for tally in self.ids.values_mut() {
                tally.reset(nmt.node);
            }
        }
        step
    }

    fn frames(&self) -> u64 {
        self.ids.values().map(|tally| tally.frames).sum()
    }

    fn statistics(&self, name: Interface) -> BusStatistics {
        let span_us = self.clock.span_us;
        // A single instant has neither load nor rate.
        let over = |sum: u64, span: f64| if span == 0.0 { 0.0 } else { sum as f64 / span };
        let load = |busy_ns: u64| over(busy_ns, span_us as f64 * 1e3);
        let rate = |frames: u64| over(frames, span_us as f64 / 1e6);
        BusStatistics {
            interface: name.to_string(),
            frames: self.frames(),
            error_frames: self.error_frames,
            errors: self.errors.clone(),
            span_s: span_us as f64 / 1e6,
            load: load(self.busy_ns),
            // A trace shorter than a window is its own busiest window.
            peak_load: (self.peak_ns as f64 / (WINDOW_US * 1000) as f64).max(load(self.busy_ns)),
            ids: self
                .ids
                .values()
                .map(|tally| tally.line(load(tally.busy_ns), rate(tally.frames)))
                .collect(),
        }
    }
}

/// Statistics of a trace.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Statistics {
    /// Frames.
    pub frames: u64,
    /// Error frames reported by interfaces.
    pub error_frames: u64,
    /// Records earlier than the one before on their interface, from which time counts on.
    pub backwards: u64,
    /// Longest time between two records, s.
    pub largest_step_s: f64,
    /// Largest step back in time, s.
    pub largest_step_back_s: f64,
    /// Steps of time that were left out.
    pub skipped_steps: u64,
    /// Time in them, s.
    pub skipped_s: f64,
    /// From the first record to the last, less what was left out and steps back, s.
    pub span_s: f64,
    /// Nominal bit rate that loads were computed for, bit/s.
    pub bitrate: u32,
    /// Data bit rate that loads were computed for, bit/s.
    pub data_bitrate: u32,
    /// By interface, in the order in which they appear.
    pub interfaces: Vec<BusStatistics>,
}

impl Statistics {
    /// The identifier most of whose periods were left out as gaps, and how often it came on average, s: what is left of
    /// the time then says nothing about rates and loads.
    #[must_use]
    pub fn left_out(&self) -> Option<(&IdStatistics, f64)> {
        if self.skipped_steps == 0 {
            return None;
        }
        self.interfaces.iter().find_map(|bus| {
            let id = bus.ids.iter().max_by_key(|id| id.frames)?;
            let steps = id.frames.saturating_sub(1);
            let all_s = bus.span_s + self.skipped_s;
            (2 * id.periods() < steps).then_some((id, all_s / steps as f64))
        })
    }
}

/// Statistics of one interface.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BusStatistics {
    /// Its name.
    pub interface: String,
    /// Frames.
    pub frames: u64,
    /// Error frames reported by it.
    pub error_frames: u64,
    /// Error frames by class; one of several classes counts in each.
    pub errors: BTreeMap<String, u64>,
    /// From its first record to its last, less what was left out and steps back, s.
    pub span_s: f64,
    /// Share of the time for which the bus was busy, 0 to 1.
    pub load: f64,
    /// The same in the busiest window of 100 ms.
    pub peak_load: f64,
    /// By identifier, in the order of arbitration.
    pub ids: Vec<IdStatistics>,
}

/// Statistics of one identifier.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct IdStatistics {
    /// Identifier, 3 or 8 hexadecimal digits.
    pub id: String,
    /// Message, or `-`.
    pub name: &'static str,
    /// Frames.
    pub frames: u64,
    /// Frames per second over the whole trace.
    pub rate_hz: f64,
    /// From one frame to the next; none with a single frame.
    pub period: Option<PeriodStatistics>,
    /// Periods more than 1.5 times the usual one, for a periodic message.
    pub gaps: u64,
    /// Frames that never came, by the end-to-end counter.
    pub lost: u64,
    /// Frames received twice.
    pub duplicate: u64,
    /// Frames older than a previous one.
    pub stale: u64,
    /// Frames with a wrong end-to-end CRC.
    pub crc: u64,
    /// Frames that fail another check of the protocol.
    pub refused: u64,
    /// Share of the bus time that they took, 0 to 1.
    pub load: f64,
}

impl IdStatistics {
    /// Periods that were counted.
    fn periods(&self) -> u64 {
        let bins = self.period.iter().flat_map(|period| &period.histogram);
        bins.map(|bin| bin.count).sum()
    }

    /// Frames that a node does not use.
    #[must_use]
    pub fn bad(&self) -> u64 {
        self.duplicate + self.stale + self.crc + self.refused
    }
}
