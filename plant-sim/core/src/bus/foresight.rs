//! What happens next on the bus: the frame that wins arbitration and what is wrong with the attempt to send it, or the recovery
//! of a node.

use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};
use protocol::wire::INTERMISSION;

use super::anatomy::Anatomy;
use super::counters::State;
use super::course::{Course, Flagged, Reader, course};
use super::disturbance::{ErrorKind, Hit};
use super::node::Node;
use super::{BuiltinBus, NodeId, NodeSet};

/// Recessive bits that end an error frame.
const DELIMITER: u32 = 8;
/// Error flags of a collision, superposed: 6 to 12 bits.
const COLLISION_FLAGS: u32 = 12;

/// What happens next on the bus, as far as known.
pub(super) enum Next {
    Transmission(Transmission),
    /// This node takes part again.
    Recovery(Instant, usize),
}

impl Next {
    pub(super) fn time(&self) -> Instant {
        match self {
            Self::Transmission(next) => next.end,
            Self::Recovery(time, _) => *time,
        }
    }
}

/// An attempt to send a frame.
pub(super) struct Transmission {
    pub(super) start: Instant,
    /// When it is known what becomes of it: the frame is valid, or an error flag begins.
    pub(super) end: Instant,
    pub(super) idle: Instant,
    pub(super) frame: CanFrame,
    pub(super) from: NodeSet,
    pub(super) collides: bool,
    /// Where anything is wrong with it. Seldom: the others are not to carry the room for it.
    pub(super) trouble: Option<Box<Trouble>>,
}

/// What is wrong with an attempt.
pub(super) struct Trouble {
    pub(super) hit: Option<Hit>,
    /// Nodes that take part, in the order of the course's readers.
    pub(super) readers: Vec<(usize, Reader)>,
    pub(super) course: Course,
}

impl BuiltinBus {
    /// What happens next if nothing more is queued until then.
    pub(super) fn foreseen(&self) -> Option<Next> {
        let recovery = (self.nodes.iter().enumerate())
            .filter_map(|(index, node)| Some((node.recovers(self.occurrence)?, index)))
            .min();
        let transmission = self.next_transmission();
        match (recovery, transmission) {
            (Some((time, node)), next) if next.as_ref().is_none_or(|next| time <= next.start) => {
                Some(Next::Recovery(time, node))
            }
            (_, next) => next.map(Next::Transmission),
        }
    }

    /// Arbitration among the frames queued so far.
    ///
    /// A frame in transmission needs no state: frames queued after its start are not candidates, so the answer stays
    /// the same until it is complete.
    fn next_transmission(&self) -> Option<Transmission> {
        let earliest = |node: &Node| node.earliest(self.idle);
        let start = self.nodes.iter().filter_map(earliest).min()?;
        let candidates = || {
            self.nodes
                .iter()
                .enumerate()
                .filter_map(|(index, node)| Some((index, node.candidate(start)?.1)))
        };
        let (_, winner) = candidates().min_by_key(|(_, mailbox)| mailbox.arbitration)?;

        let mut from = NodeSet::default();
        let mut collides = false;
        let mut duration = Duration::ZERO;
        for (index, mailbox) in
            candidates().filter(|(_, mailbox)| mailbox.arbitration == winner.arbitration)
        {
            from.insert(index);
            collides |= mailbox.frame != winner.frame;
            duration = duration.max(mailbox.duration);
        }
        if collides {
            // An upper bound: the longest frame in full, as if the last bit were the first to differ.
            duration += self.bits(COLLISION_FLAGS + DELIMITER);
        }
        let mut next = Transmission {
            start,
            end: start + duration.saturating_sub(self.after_valid),
            idle: start + duration,
            frame: winner.frame,
            from,
            collides,
            trouble: None,
        };
        if !collides {
            next.trouble = self.trouble(start, &winner.frame, from);
        }
        if let Some((flagged, flags)) = next.trouble.as_ref().and_then(|it| it.course.destroyed) {
            let anatomy = Anatomy::of(&winner.frame);
            let bits = anatomy.until(match flagged {
                Flagged::Bit(index) => index,
                Flagged::Field(field) => anatomy.first(field),
            });
            next.end = start + self.timing.duration(bits);
            next.idle = next.end + self.bits(flags + DELIMITER + INTERMISSION);
        }
        Some(next)
    }

    /// What is wrong with an attempt to send `frame`, if anything is.
    fn trouble(&self, start: Instant, frame: &CanFrame, from: NodeSet) -> Option<Box<Trouble>> {
        let others = || {
            let part = |(index, node): &(usize, &Node)| {
                node.takes_part() && !from.contains(NodeId(*index))
            };
            self.nodes.iter().enumerate().filter(part)
        };
        let calm = !self.interference.acts(start);
        if calm && others().next().is_some() {
            return None;
        }
        let hit = self.interference.hit(start, frame);
        let for_all = hit.is_some_and(|hit| hit.kind == ErrorKind::Crc);
        let reader = |(index, node): (usize, &Node)| {
            let reader = Reader {
                state: node.counters.state(),
                misreads: for_all || self.interference.misleads(start, NodeId(index)),
            };
            (index, reader)
        };
        let readers: Vec<_> = others().map(reader).collect();
        let senders = from.iter().map(|node| self.counters(node).state());
        let course = course(
            senders.min().unwrap_or(State::ErrorActive),
            &readers
                .iter()
                .map(|(_, reader)| *reader)
                .collect::<Vec<_>>(),
            hit.filter(|_| !for_all),
        );
        Some(Box::new(Trouble {
            hit,
            readers,
            course,
        }))
    }
}
