//! What a trace carried: frames, periods, losses and load, by identifier and in total.

use std::collections::BTreeMap;
use std::fmt;

use protocol::codec::DecodeError;
use protocol::e2e::{Receiver, Verdict};
use protocol::frame::{CanFrame, Id};
use protocol::schema::Rate;
use protocol::table;
use serde::Serialize;

use super::decode::id;
use super::fields::Decoded;
use super::{Entry, Record};
use protocol::wire::{BitTiming, FrameBits};

/// A period this many times the usual one is a gap.
const GAP: f64 = 1.5;
/// Periods of a message of unknown rate before its mean is taken for the usual one.
const LEARNED: u64 = 16;
/// Window of the peak load, us.
const WINDOW_US: u64 = 100_000;

/// Gathers the statistics of a trace, record by record.
pub struct Gatherer {
    timing: BitTiming,
    ids: BTreeMap<Id, Tally>,
    first_us: Option<u64>,
    newest_us: u64,
    backwards: u64,
    error_frames: u64,
    busy_ns: u64,
    window: u64,
    window_ns: u64,
    peak_ns: u64,
}

impl Gatherer {
    /// Nothing seen yet; the load is that of a bus of this timing.
    #[must_use]
    pub fn new(timing: BitTiming) -> Self {
        Self {
            timing,
            ids: BTreeMap::new(),
            first_us: None,
            newest_us: 0,
            backwards: 0,
            error_frames: 0,
            busy_ns: 0,
            window: 0,
            window_ns: 0,
            peak_ns: 0,
        }
    }

    /// Takes the next record in.
    pub fn record(&mut self, record: &Record) {
        let first = *self.first_us.get_or_insert(record.time_us);
        if record.time_us < self.newest_us {
            self.backwards += 1;
        }
        self.newest_us = self.newest_us.max(record.time_us);
        let frame = match &record.entry {
            Entry::Frame(frame) => frame,
            Entry::Error(_) => {
                self.error_frames += 1;
                return;
            }
        };
        let busy = self.timing.duration(FrameBits::exact(frame)).nanos();
        self.busy_ns += busy;
        let window = self.newest_us.saturating_sub(first) / WINDOW_US;
        if window != self.window {
            (self.window, self.window_ns) = (window, 0);
        }
        self.window_ns += busy;
        self.peak_ns = self.peak_ns.max(self.window_ns);
        self.ids
            .entry(frame.id())
            .or_insert_with(|| Tally::new(frame))
            .frame(record.time_us, frame, busy);
    }

    /// The statistics of what was taken in.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let span_us = self.newest_us - self.first_us.unwrap_or(self.newest_us);
        // One instant has neither load nor rate.
        let over = |sum: u64, span: f64| if span == 0.0 { 0.0 } else { sum as f64 / span };
        let load = |busy_ns: u64| over(busy_ns, span_us as f64 * 1e3);
        let rate = |frames: u64| over(frames, span_us as f64 / 1e6);
        Statistics {
            frames: self.ids.values().map(|tally| tally.frames).sum(),
            error_frames: self.error_frames,
            backwards: self.backwards,
            span_s: span_us as f64 / 1e6,
            load: load(self.busy_ns),
            // A trace shorter than a window is its own busiest part.
            peak_load: (self.peak_ns as f64 / (WINDOW_US * 1000) as f64).max(load(self.busy_ns)),
            ids: self
                .ids
                .values()
                .map(|tally| tally.line(load(tally.busy_ns), rate(tally.frames)))
                .collect(),
        }
    }
}

/// What was seen of one identifier.
struct Tally {
    id: String,
    name: &'static str,
    rate: Rate,
    frames: u64,
    newest_us: u64,
    periods: Periods,
    gaps: u64,
    receiver: Option<Receiver>,
    lost: u64,
    duplicate: u64,
    stale: u64,
    crc: u64,
    refused: u64,
    busy_ns: u64,
}

impl Tally {
    fn new(frame: &CanFrame) -> Self {
        let info = table::of_frame(frame);
        Self {
            id: id(frame),
            name: info.map_or("-", |info| info.name),
            rate: info.map_or(Rate::Event, |info| info.rate),
            frames: 0,
            newest_us: 0,
            periods: Periods::default(),
            gaps: 0,
            receiver: info.and_then(|info| info.protection).map(Receiver::new),
            lost: 0,
            duplicate: 0,
            stale: 0,
            crc: 0,
            refused: 0,
            busy_ns: 0,
        }
    }

    fn frame(&mut self, time_us: u64, frame: &CanFrame, busy_ns: u64) {
        self.frames += 1;
        self.busy_ns += busy_ns;
        // A clock that was set back gives no period.
        if self.frames > 1
            && let Some(period) = time_us.checked_sub(self.newest_us)
        {
            if let Some(usual) = self.usual_us()
                && period as f64 > GAP * usual
            {
                self.gaps += 1;
            }
            self.periods.add(period);
        }
        self.newest_us = time_us;
        match Decoded::new(frame) {
            Ok(decoded) => {
                if let (Some(counter), Some(receiver)) = (decoded.counter, &mut self.receiver) {
                    match receiver.judge(counter) {
                        Verdict::Initial | Verdict::Fresh => {}
                        Verdict::Lost(frames) => self.lost += u64::from(frames),
                        Verdict::Duplicate => self.duplicate += 1,
                        Verdict::Stale(_) => self.stale += 1,
                    }
                }
            }
            Err(DecodeError::UnknownId) => {}
            Err(DecodeError::Crc) => self.crc += 1,
            Err(_) => self.refused += 1,
        }
    }

    /// The period that is due, us; `None` if there is none, or it is not known yet.
    fn usual_us(&self) -> Option<f64> {
        match self.rate {
            Rate::Hertz(hertz) => Some(1e6 / f64::from(hertz)),
            Rate::EverySample => (self.periods.count >= LEARNED).then_some(self.periods.mean),
            Rate::Event => None,
        }
    }

    fn line(&self, load: f64, rate_hz: f64) -> IdStatistics {
        let periods = (self.periods.count > 0).then(|| PeriodStatistics {
            min_ms: self.periods.min as f64 / 1e3,
            mean_ms: self.periods.mean / 1e3,
            max_ms: self.periods.max as f64 / 1e3,
            jitter_ms: self.periods.deviation() / 1e3,
        });
        IdStatistics {
            id: self.id.clone(),
            name: self.name,
            frames: self.frames,
            rate_hz,
            period: periods,
            gaps: self.gaps,
            lost: self.lost,
            duplicate: self.duplicate,
            stale: self.stale,
            crc: self.crc,
            refused: self.refused,
            load,
        }
    }
}

/// Mean and deviation in one pass (Welford 1962).
#[derive(Default)]
struct Periods {
    count: u64,
    mean: f64,
    squares: f64,
    min: u64,
    max: u64,
}

impl Periods {
    fn add(&mut self, period_us: u64) {
        self.min = if self.count == 0 {
            period_us
        } else {
            self.min.min(period_us)
        };
        self.max = self.max.max(period_us);
        self.count += 1;
        let value = period_us as f64;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
    }

    fn deviation(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

/// Statistics of a trace. `Display` makes a table of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Frames.
    pub frames: u64,
    /// Error frames that interfaces reported.
    pub error_frames: u64,
    /// Records earlier than one before them.
    pub backwards: u64,
    /// From the first record to the last, s.
    pub span_s: f64,
    /// Share of the time that the bus was taken, of 1.
    pub load: f64,
    /// The same in the busiest window of 100 ms.
    pub peak_load: f64,
    /// By identifier, in the order of arbitration.
    pub ids: Vec<IdStatistics>,
}

/// Statistics of one identifier.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdStatistics {
    /// Identifier, 3 or 8 hexadecimal digits.
    pub id: String,
    /// Message, or `-`.
    pub name: &'static str,
    /// Frames.
    pub frames: u64,
    /// Frames a second over the whole trace.
    pub rate_hz: f64,
    /// From one frame to the next; none if there was one frame only.
    pub period: Option<PeriodStatistics>,
    /// Periods more than half as long again as is usual, for a message that comes at a rate.
    pub gaps: u64,
    /// Frames that never came, by the end-to-end counter.
    pub lost: u64,
    /// Frames that came twice.
    pub duplicate: u64,
    /// Frames older than one before them.
    pub stale: u64,
    /// Frames with a wrong end-to-end CRC.
    pub crc: u64,
    /// Frames that fail another check of the protocol.
    pub refused: u64,
    /// Share of the time that they took the bus, of 1.
    pub load: f64,
}

/// Time from one frame to the next, ms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PeriodStatistics {
    /// Shortest.
    pub min_ms: f64,
    /// Mean.
    pub mean_ms: f64,
    /// Longest.
    pub max_ms: f64,
    /// Standard deviation.
    pub jitter_ms: f64,
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} frames in {:.6} s; bus load {:.1} % mean, {:.1} % in the busiest 100 ms",
            self.frames,
            self.span_s,
            self.load * 100.0,
            self.peak_load * 100.0
        )?;
        if self.error_frames > 0 {
            writeln!(f, "{} error frames", self.error_frames)?;
        }
        if self.backwards > 0 {
            writeln!(f, "{} records are earlier than one before", self.backwards)?;
        }
        writeln!(
            f,
            "{:>8} {:<26} {:>9} {:>9} {:>10} {:>10} {:>10} {:>9} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>6}",
            "id",
            "message",
            "frames",
            "rate/Hz",
            "min/ms",
            "mean/ms",
            "max/ms",
            "jitter/ms",
            "gaps",
            "lost",
            "twice",
            "stale",
            "CRC",
            "refused",
            "load/%"
        )?;
        self.ids.iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

impl fmt::Display for IdStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:>8} {:<26} {:>9} {:>9.2} ",
            self.id, self.name, self.frames, self.rate_hz
        )?;
        match &self.period {
            Some(period) => write!(
                f,
                "{:>10.3} {:>10.3} {:>10.3} {:>9.3}",
                period.min_ms, period.mean_ms, period.max_ms, period.jitter_ms
            )?,
            None => write!(f, "{:>10} {:>10} {:>10} {:>9}", "-", "-", "-", "-")?,
        }
        write!(
            f,
            " {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>6.2}",
            self.gaps,
            self.lost,
            self.duplicate,
            self.stale,
            self.crc,
            self.refused,
            self.load * 100.0
        )
    }
}
