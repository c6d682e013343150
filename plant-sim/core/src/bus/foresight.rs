//! What happens next on the bus: the frame that wins arbitration and what is wrong with the attempt to send it, or the recovery
//! of a node.

use protocol::frame::CanFrame;
use protocol::time::Instant;
use protocol::wire::INTERMISSION;

use super::affliction::{Affliction, Level};
use super::anatomy::{Anatomy, Bit, Field};
use super::counters::State;
use super::course::{Course, Flagged, Reader, clash, course, shorted};
use super::disturbance::{ErrorKind, Hit};
use super::held::{Held, Step};
use super::node::{Mailbox, Node};
use super::{BuiltinBus, NodeId, NodeSet};

/// Recessive bits that end an error frame.
pub(super) const DELIMITER: u32 = 8;

/// What happens next on the bus, as far as known.
#[derive(Clone)]
pub(super) enum Next {
    Transmission(Transmission),
    /// This node takes part again.
    Recovery(Instant, usize),
    /// The bus is dominant where it should not be.
    Hold(Held),
    /// While it is.
    Held(Instant, Step),
}

impl Next {
    pub(super) fn time(&self) -> Instant {
        match self {
            Self::Transmission(next) => next.end,
            Self::Recovery(time, _) | Self::Held(time, _) => *time,
            Self::Hold(held) => held.start,
        }
    }
}

/// An attempt to send a frame.
#[derive(Clone)]
pub(super) struct Transmission {
    pub(super) start: Instant,
    /// When it is known what becomes of it: the frame is valid, or an error flag begins.
    pub(super) end: Instant,
    pub(super) idle: Instant,
    pub(super) frame: CanFrame,
    pub(super) from: NodeSet,
    /// Where other nodes send other frames of the same identifier.
    pub(super) clash: Option<Clash>,
    /// Where anything is wrong with it. Seldom: the others are not to carry the room for it.
    pub(super) trouble: Option<Box<Trouble>>,
}

/// Frames of one identifier that were sent at the same instant and differ: arbitration cannot separate them.
#[derive(Clone)]
pub(super) struct Clash {
    /// The bit in which they do.
    pub(super) hit: Hit,
    /// Who sends it recessive.
    pub(super) losers: NodeSet,
}

impl Transmission {
    /// Who sends something else and loses.
    pub(super) fn losers(&self) -> NodeSet {
        let losers = self.clash.as_ref().map(|clash| clash.losers);
        losers.unwrap_or_default()
    }
}

/// What is wrong with an attempt.
#[derive(Clone)]
pub(super) struct Trouble {
    pub(super) hit: Option<Hit>,
    /// Nodes that take part, in the order of the course's readers.
    pub(super) readers: Vec<(usize, Reader)>,
    pub(super) course: Course,
}

impl BuiltinBus {
    /// What happens next if nothing more is queued until then.
    pub(super) fn foreseen(&self) -> Option<Next> {
        if let Some(held) = &self.held {
            let (time, step) = self.next_step(held)?;
            return Some(Next::Held(time, step));
        }
        let recovery = (self.nodes.iter().enumerate())
            .filter_map(|(index, node)| Some((node.recovers(self.occurrence)?, index)))
            .min();
        let transmission = self.next_transmission();
        let hold = self.hold(transmission.as_ref());
        let start = transmission.as_ref().map(|next| next.start);
        let start = start.into_iter().chain(hold.map(|hold| hold.start)).min();
        match (recovery, transmission) {
            (Some((time, node)), _) if start.is_none_or(|start| time <= start) => {
                Some(Next::Recovery(time, node))
            }
            (_, next) => hold.map(Next::Hold).or(next.map(Next::Transmission)),
        }
    }

    /// From when on the node can send something, if nothing more is queued.
    fn earliest(&self, index: usize, node: &Node) -> Option<Instant> {
        let babbling = Affliction::Babbling(NodeId(index));
        let ready = node.ready.max(self.idle);
        let babble = self.afflictions.of(babbling, ready);
        let babble = babble.map(|(from, _)| from.max(ready)).min();
        let babble = babble.filter(|_| node.off.is_none());
        node.earliest(self.idle).into_iter().chain(babble).min()
    }

    /// The frame with which the node takes part in an arbitration at `start`, and the mailbox that holds it, if one does.
    pub(super) fn candidate(
        &self,
        index: usize,
        start: Instant,
    ) -> Option<(Option<usize>, &Mailbox)> {
        let node = &self.nodes[index];
        let babbling = Affliction::Babbling(NodeId(index));
        if self.afflictions.acts(babbling, start) && node.off.is_none() && node.ready <= start {
            return Some((None, &self.babble));
        }
        let (place, mailbox) = node.candidate(start)?;
        Some((Some(place), mailbox))
    }

    /// Arbitration among the frames queued so far.
    ///
    /// A frame in transmission needs no state: frames queued after its start are not candidates, so the answer stays
    /// the same until it is complete.
    fn next_transmission(&self) -> Option<Transmission> {
        let nodes = || self.nodes.iter().enumerate();
        let start = nodes()
            .filter_map(|(index, node)| self.earliest(index, node))
            .min()?;
        let candidates =
            || nodes().filter_map(|(index, _)| Some((index, self.candidate(index, start)?.1)));
        let (first, winner) = candidates().min_by_key(|(_, mailbox)| mailbox.arbitration)?;
        let (mut mailbox, mut clash) = (winner, None);
        let mut from = NodeSet::default();
        from.insert(first);
        let is_equal = |(_, it): &(usize, &Mailbox)| it.arbitration == winner.arbitration;
        let equals = || candidates().filter(is_equal);
        if equals().nth(1).is_some() {
            let mut frame = winner.frame;
            if equals().any(|(_, it)| it.frame != frame) {
                let frames = equals().map(|(index, it)| (index, it.frame));
                (frame, clash) = self.clash(frames.collect());
            }
            from = NodeSet::default();
            for (index, it) in equals().filter(|(_, it)| it.frame == frame) {
                from.insert(index);
                mailbox = it;
            }
        }
        let Mailbox {
            frame, duration, ..
        } = *mailbox;
        let mut next = Transmission {
            start,
            end: start + duration.saturating_sub(self.after_valid),
            idle: start + duration,
            frame,
            from,
            clash,
            trouble: None,
        };
        next.trouble = self.trouble(&next, mailbox);
        if let Some((flagged, flags)) = next.trouble.as_ref().and_then(|it| it.course.destroyed) {
            let anatomy = mailbox.anatomy();
            let bits = anatomy.until(match flagged {
                Flagged::Bit(index) => index,
                Flagged::Field(field) => anatomy.first(field),
            });
            next.end = start + self.timing.duration(bits);
            next.idle = next.end + self.bits(flags + DELIMITER + INTERMISSION);
        }
        Some(next)
    }

    /// Which of different frames goes on, and where the others lose.
    fn clash(&self, mut frames: Vec<(usize, CanFrame)>) -> (CanFrame, Option<Clash>) {
        let mut clash: Option<Clash> = None;
        while let Some((first, other)) = frames
            .first()
            .and_then(|(_, first)| Some((*first, frames.iter().find(|(_, it)| it != first)?.1)))
        {
            let (one, two) = (Anatomy::of(&first), Anatomy::of(&other));
            let differs = |(a, b): (&Bit, &Bit)| a.recessive != b.recessive;
            let place = one.bits.iter().zip(&two.bits).position(differs);
            // Frames that differ do so before their CRC.
            let index = place.unwrap_or(0);
            let loser = if one.bits[index].recessive == Some(true) {
                &one
            } else {
                &two
            };
            let hit = Hit {
                kind: ErrorKind::Bit,
                index,
                bit: loser.bits[index],
            };
            let lost = if std::ptr::eq(loser, &one) {
                first
            } else {
                other
            };
            let is_active = |index: usize| self.nodes[index].counters.state().is_active();
            let clash = clash.get_or_insert(Clash {
                hit,
                losers: NodeSet::default(),
            });
            let mut destroys = false;
            for (index, _) in frames.extract_if(.., |(_, frame)| *frame == lost) {
                clash.losers.insert(index);
                destroys |= is_active(index);
            }
            if destroys {
                clash.hit = hit;
                // The flag of one ends the frames of all.
                for (index, _) in frames.extract_if(1.., |_| true) {
                    clash.losers.insert(index);
                }
                break;
            }
        }
        let frame = frames.first().map(|(_, frame)| *frame);
        (frame.expect("one frame is left"), clash)
    }

    /// What is wrong with an attempt to send the frame of this mailbox, if anything is.
    fn trouble(&self, next: &Transmission, mailbox: &Mailbox) -> Option<Box<Trouble>> {
        let Transmission { start, from, .. } = *next;
        let losers = next.losers();
        let others = || {
            let part = |(index, node): &(usize, &Node)| {
                let sends = |nodes: NodeSet| nodes.contains(NodeId(*index));
                node.takes_part() && !sends(from) && !sends(losers)
            };
            self.nodes.iter().enumerate().filter(part)
        };
        let short = self.short(next);
        let is_active = |node: NodeId| self.counters(node).state().is_active();
        let is_destroyed = losers.iter().any(is_active);
        let calm = !self.interference.acts(start) && short.is_none() && !is_destroyed;
        if calm && others().next().is_some() {
            return None;
        }
        let hit = self.interference.hit(start, mailbox);
        let for_all = hit.is_some_and(|hit| hit.kind == ErrorKind::Crc);
        let reader = |(index, node): (usize, &Node)| {
            let reader = Reader {
                state: node.counters.state(),
                misreads: for_all || self.interference.misleads(start, NodeId(index)),
            };
            (index, reader)
        };
        let readers: Vec<_> = others().map(reader).collect();
        let senders = from.iter().map(|node| self.counters(node));
        let sender = senders.min_by_key(|counters| counters.transmit());
        let sender = sender.unwrap_or_default();
        let (hit, course) = if let Some((hit, read, bits)) = short {
            let readers = others().map(|(_, node)| node.counters);
            let readers: Vec<_> = readers.collect();
            (Some(hit), shorted(sender, &readers, hit, read, bits))
        } else if let Some(Clash { hit, .. }) = next.clash.as_ref().filter(|_| is_destroyed) {
            (Some(*hit), clash(*hit, readers.len()))
        } else {
            let senders = from.iter().map(|node| self.counters(node).state());
            let course = course(
                senders.min().unwrap_or(State::ErrorActive),
                &readers
                    .iter()
                    .map(|(_, reader)| *reader)
                    .collect::<Vec<_>>(),
                hit.filter(|_| !for_all),
            );
            (hit, course)
        };
        Some(Box::new(Trouble {
            hit,
            readers,
            course,
        }))
    }

    /// Where an attempt meets wires that are held recessive: the first bit that is not read as it is sent, whether anybody has read
    /// something before it, and for how many bits it goes on.
    fn short(&self, next: &Transmission) -> Option<(Hit, bool, u32)> {
        let recessive = Affliction::Wires(Level::Recessive);
        let mut windows = self.afflictions.of(recessive, next.start).peekable();
        windows.peek()?;
        let anatomy = Anatomy::of(&next.frame);
        let starts = anatomy
            .starts()
            .map(|bits| next.start + self.timing.duration(bits));
        let bits: Vec<_> = starts.zip(&anatomy.bits).enumerate().collect();
        let meets = |(from, until): (Instant, Instant)| {
            let within = |time: Instant| from <= time && time < until && time < next.end;
            let mut bits = bits.iter();
            let (index, (_, bit)) =
                bits.find(|(_, (time, bit))| within(*time) && bit.recessive != Some(true))?;
            let kind = match bit.field {
                Field::AckSlot => ErrorKind::Ack,
                _ => ErrorKind::Bit,
            };
            let flag = next.start + self.timing.duration(anatomy.until(*index));
            let left = until.since(flag).nanos().div_ceil(self.bits(1).nanos());
            let hit = Hit {
                kind,
                index: *index,
                bit: **bit,
            };
            Some((hit, *index > 0, left.min(64) as u32))
        };
        windows.filter_map(meets).min_by_key(|(hit, ..)| hit.index)
    }
}
