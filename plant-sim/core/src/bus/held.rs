//! The bus held dominant: nodes signal an error, wait in vain for the end of the error flags, and count every eighth bit.
//!
//! ```text
//! dominant bit       1    2..7        8..14   15            23
//! transmitter        c    error flag          f             f, and so on: bus-off at the 255th
//!
//! dominant bit    1..6    7..12       13      14..19   20   28
//! receiver           a    error flag  b                f    f, and so on: passive at the 132nd
//! ```
//!
//! Bit 1 is the first that is dominant where it should not be: for a transmitter one that it sends recessive, for everybody else the
//! first of six that are equal. A flag of a passive node is as long.

use protocol::time::{Duration, Instant};

use super::affliction::{Affliction, Level};
use super::anatomy::{Anatomy, Field};
use super::counters::{Rule, State};
use super::disturbance::ErrorKind;
use super::foresight::{DELIMITER, Transmission};
use super::report::Noticed;
use super::settle::SUSPENSION;
use super::{BuiltinBus, NodeId, NodeSet};

/// Bits after which everybody has seen an error and sent a flag.
const FLAGS: u64 = 12;
/// Recessive bits between the flags and the next frame.
const REST: u32 = DELIMITER + protocol::wire::INTERMISSION;

/// The bus held dominant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Held {
    /// Beginning of its first bit that should not be dominant.
    pub(super) start: Instant,
    /// Beginning of the frame that it destroys; the same without one.
    begun: Instant,
    /// Who sends that frame.
    from: NodeSet,
    /// Whether they do not count the error itself: exception 2 of rule c.
    is_excepted: bool,
    /// Where they see it.
    field: Field,
    /// Bits counted so far.
    bits: u64,
}

/// What happens next while the bus is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Counters change with this bit.
    Count(u64),
    /// The bus is free again.
    Release,
}

impl BuiltinBus {
    /// The next hold, if the next frame is `next`; `None` where that is done before.
    pub(super) fn hold(&self, next: Option<&Transmission>) -> Option<Held> {
        let dominant = Affliction::Wires(Level::Dominant);
        let windows = self.afflictions.of(dominant, self.idle);
        let (from, until) = windows.min()?;
        let from = from.max(self.idle);
        let idle = Held {
            start: from,
            begun: from,
            from: NodeSet::default(),
            is_excepted: false,
            field: Field::Id28To21,
            bits: 0,
        };
        let Some(next) = next.filter(|next| next.start < from) else {
            return Some(idle);
        };
        let anatomy = Anatomy::of(&next.frame);
        let starts = anatomy
            .starts()
            .map(|bits| next.start + self.timing.duration(bits));
        let hit = starts
            .zip(&anatomy.bits)
            .find(|(start, bit)| (from..until).contains(start) && bit.recessive != Some(false));
        let (start, bit) = hit.filter(|(start, _)| *start < next.end)?;
        let is_excepted = bit.is_excepted();
        // A node that reads dominant in arbitration has lost it.
        let lost = bit.field.is_arbitration() && !is_excepted;
        Some(Held {
            start,
            begun: next.start,
            from: if lost { NodeSet::default() } else { next.from },
            is_excepted,
            field: bit.field,
            bits: 0,
        })
    }

    /// When what happens next while the bus is held; `None` for never.
    pub(super) fn next_step(&self, held: &Held) -> Option<(Instant, Step)> {
        let bit = self.bits(1).nanos();
        let until = self.held_until(held);
        let dominant = until.since(held.start).nanos().div_ceil(bit);
        let (sends, bits) = (!held.from.is_empty(), held.bits);
        // Everybody sees an error, however short it is.
        let first = [sends.then_some(1), Some(6), Some(13)];
        let first = first.into_iter().flatten().find(|&step| step > bits);
        let step = match first {
            Some(step) => step,
            // The next of 15, 23 ... or of 20, 28 ...
            None => {
                let after = |first: u64| first + 8 * bits.saturating_sub(first - 8).div_euclid(8);
                let receivers = after(20);
                if sends {
                    after(15).min(receivers)
                } else {
                    receivers
                }
            }
        };
        let is_certain = step <= 6;
        if is_certain || step <= dominant && !self.is_worn_out() {
            return Some((
                held.start + Duration::from_nanos(step * bit),
                Step::Count(step),
            ));
        }
        let late = held.start + Duration::from_nanos(bits * bit);
        (until < Instant::MAX).then_some((until.max(late), Step::Release))
    }

    fn held_until(&self, held: &Held) -> Instant {
        let dominant = Affliction::Wires(Level::Dominant);
        let windows = self.afflictions.of(dominant, held.start);
        let within = windows.filter(|(from, _)| *from <= held.start);
        within.map(|(_, until)| until).max().unwrap_or(held.start)
    }

    /// Whether counting changes nothing any more.
    fn is_worn_out(&self) -> bool {
        self.nodes.iter().all(|node| {
            !node.takes_part() || node.counters.receive() == super::counters::MOST_RECEIVE
        })
    }

    /// What happens while the bus is held.
    pub(super) fn endure(&mut self, now: Instant, step: Step) {
        let Some(mut held) = self.held.take() else {
            return;
        };
        match step {
            Step::Count(bit) => {
                self.count(&mut held, now, bit);
                self.held = Some(held);
            }
            Step::Release => self.release(&held, now),
        }
    }

    /// Counts one bit of a hold.
    fn count(&mut self, held: &mut Held, now: Instant, step: u64) {
        held.bits = step;
        let mut first = true;
        for index in 0..self.nodes.len() {
            if !self.nodes[index].takes_part() {
                continue;
            }
            let sends = held.from.contains(NodeId(index));
            let rule = match (sends, step) {
                (true, 1) if held.is_excepted => None,
                (true, 1) => Some(Rule::TransmitterFlag),
                (true, 15..) if step % 8 == 7 => Some(Rule::TransmitterHeld),
                (false, 6) => Some(Rule::ReceiverError),
                (false, 13) => Some(Rule::DominantAfterFlag),
                (false, 20..) if step % 8 == 4 => Some(Rule::ReceiverHeld),
                _ => None,
            };
            let sees = if held.from.is_empty() {
                step == 6
            } else {
                sends && step == 1
            };
            if sees && std::mem::take(&mut first) {
                let kind = if sends {
                    ErrorKind::Bit
                } else {
                    ErrorKind::Stuff
                };
                let what = Noticed::Error {
                    kind,
                    field: held.field,
                    recessive: sends.then_some(true),
                    sending: sends,
                };
                self.report(now, index, what, Duration::ZERO);
            }
            if let Some(rule) = rule {
                let counters = &mut self.nodes[index].counters;
                let before = counters.state();
                counters.count(rule);
                let state = counters.state();
                if state != before {
                    self.report(now, index, Noticed::State(state), Duration::ZERO);
                }
                self.go_off(index, now);
            }
        }
    }

    /// The bus is free again: after the delimiter everything goes on.
    fn release(&mut self, held: &Held, now: Instant) {
        let bit = self.bits(1).nanos();
        let flags = held.start + Duration::from_nanos(FLAGS * bit);
        self.idle = now.max(flags) + self.bits(REST);
        for index in 0..self.nodes.len() {
            self.nodes[index].witness(held.begun, self.idle, self.occurrence);
            let sent = held.from.contains(NodeId(index));
            if sent && self.nodes[index].counters.state() == State::ErrorPassive {
                self.nodes[index].ready = self.idle + self.bits(SUSPENSION);
            }
        }
        self.statistics
            .total
            .add(self.idle.since(held.begun), None, true);
        self.interference.draw();
    }
}
