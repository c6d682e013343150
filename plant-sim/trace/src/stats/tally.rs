//! Counts of one identifier.

use protocol::codec::{self, DecodeError};
use protocol::e2e::{Receiver, Verdict};
use protocol::frame::CanFrame;
use protocol::messages::{Message, Node};
use protocol::schema::Rate;
use protocol::table;

use super::IdStatistics;
use super::periods::Periods;
use crate::decode::id;

/// A period this many times the usual one is a gap.
const GAP: f64 = 1.5;
/// Periods of a message of unknown rate before their mean counts as the usual one.
const LEARNED: u64 = 16;

/// Counts of one identifier.
pub(super) struct Tally {
    id: String,
    name: &'static str,
    rate: Rate,
    sender: Option<Node>,
    pub frames: u64,
    /// Time of the newest frame; none after a pause.
    newest_us: Option<u64>,
    periods: Periods,
    gaps: u64,
    receiver: Option<Receiver>,
    lost: u64,
    duplicate: u64,
    stale: u64,
    crc: u64,
    refused: u64,
    pub busy_ns: u64,
}

impl Tally {
    pub(super) fn new(frame: &CanFrame) -> Self {
        let info = table::of_frame(frame);
        Self {
            id: id(frame),
            name: info.map_or("-", |info| info.name),
            rate: info.map_or(Rate::Event, |info| info.rate),
            sender: info.and_then(|info| info.sender),
            frames: 0,
            newest_us: None,
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

    /// Adds a frame; returns its message if it has one.
    pub(super) fn frame(
        &mut self,
        time_us: u64,
        frame: &CanFrame,
        busy_ns: u64,
    ) -> Option<Message> {
        self.frames += 1;
        self.busy_ns += busy_ns;
        // A clock set back gives no period.
        let period = self
            .newest_us
            .and_then(|newest| time_us.checked_sub(newest));
        if let Some(period) = period {
            if let Some(usual) = self.usual_us()
                && period as f64 > GAP * usual
            {
                self.gaps += 1;
            }
            self.periods.add(period);
        }
        self.newest_us = Some(time_us);
        match codec::decode(frame) {
            Ok(received) => {
                if let (Some(counter), Some(receiver)) = (received.counter, &mut self.receiver) {
                    match receiver.check(counter) {
                        Verdict::Initial | Verdict::Fresh => {}
                        Verdict::Lost(frames) => self.lost += u64::from(frames),
                        Verdict::Duplicate => self.duplicate += 1,
                        Verdict::Stale(_) => self.stale += 1,
                    }
                }
                return Some(received.message);
            }
            Err(DecodeError::UnknownId) => {}
            Err(DecodeError::Crc) => self.crc += 1,
            Err(_) => self.refused += 1,
        }
        None
    }

    /// Starts a time that is not counted.
    pub(super) fn pause(&mut self) {
        self.newest_us = None;
    }

    /// The node of this number, or every node for 0, restarts.
    pub(super) fn reset(&mut self, node: u8) {
        let is_it = |sender: Node| node == 0 || node == sender.code();
        if let Some(receiver) = &mut self.receiver
            && self.sender.is_none_or(is_it)
        {
            receiver.reset();
        }
    }

    /// The usual period, us; `None` if there is none or it is not known yet.
    fn usual_us(&self) -> Option<f64> {
        match self.rate {
            Rate::Hertz(hertz) => Some(1e6 / f64::from(hertz)),
            Rate::EverySample => (self.periods.count >= LEARNED).then_some(self.periods.mean),
            Rate::Event => None,
        }
    }

    pub(super) fn line(&self, load: f64, rate_hz: f64) -> IdStatistics {
        IdStatistics {
            id: self.id.clone(),
            name: self.name,
            frames: self.frames,
            rate_hz,
            period: self.periods.statistics(),
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
