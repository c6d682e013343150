//! Simulated CAN bus: bit-timed, with arbitration, deterministic.
//!
//! Time is an argument. The bus never runs by itself: the caller queues frames with [`BuiltinBus::enqueue`], gets the
//! time of the next event from [`BuiltinBus::next_event`], and takes received frames with [`BuiltinBus::pop_delivery`].
//!
//! Modelled: exact frame lengths, arbitration bit by bit, non-preemption, interframe space, transmit mailboxes,
//! identifier collisions; errors of ISO 11898-1 with error frames, error counters, retransmission, bus-off and recovery,
//! where a [`Disturbance`] causes them or nobody acknowledges. Not modelled: propagation delay, oscillator tolerance,
//! overload frames, disturbed error flags. What goes wrong inside a node is injected by wrappers around its
//! [`Peer`](crate::peer::Peer).

mod anatomy;
mod counters;
mod course;
mod disturbance;
mod load;
mod node;
mod nodes;
mod report;
mod settle;
mod statistics;

use protocol::bus::TransmitError;
use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};
use protocol::wire::{BitTiming, FrameBits, INTERMISSION, arbitration_field};

use anatomy::Anatomy;
use course::{Course, Flagged, Reader};
use disturbance::{Hit, Interference};
use node::{Mailbox, Node, OCCURRENCE};

pub use anatomy::Field;
pub use counters::{Counters, Rule, State};
pub use disturbance::{Disturbance, Disturbed, ErrorKind};
pub use load::{MAX_LOAD, Overload, Traffic, admit, worst_case_load};
pub use nodes::{NodeId, NodeSet};
pub use report::{Noticed, Report};
pub use statistics::{Carried, Collision, Statistics};

/// Recessive bits that end an error frame.
const DELIMITER: u32 = 8;
/// Error flags of a collision, superposed: 6 to 12 bits.
const COLLISION_FLAGS: u32 = 12;

/// A frame that has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// When receivers accepted it as valid: sample point of the last but one bit of end of frame.
    pub time: Instant,
    /// When its start of frame began.
    pub start: Instant,
    /// The frame.
    pub frame: CanFrame,
    /// The sender; several if nodes sent identical frames at the same instant, which CAN merges into one.
    pub from: NodeSet,
    /// Who received it: every other node that is not bus-off, unless it has read something else.
    pub to: NodeSet,
}

/// What happens next on the bus, as far as known.
enum Next {
    Transmission(Transmission),
    /// This node takes part again.
    Recovery(Instant, usize),
}

/// An attempt to send a frame.
struct Transmission {
    start: Instant,
    /// When it is known what becomes of it: the frame is valid, or an error flag begins.
    end: Instant,
    idle: Instant,
    frame: CanFrame,
    from: NodeSet,
    collides: bool,
    /// Where anything is wrong with it.
    trouble: Option<Trouble>,
}

/// What is wrong with an attempt.
struct Trouble {
    hit: Option<Hit>,
    /// Nodes that take part, in the order of the course's readers.
    readers: Vec<(usize, Reader)>,
    course: Course,
}

/// The bus and the transmit side of its nodes' controllers.
///
/// A controller sends its mailboxes in the order of their priority (as bxCAN by default, M_CAN in queue mode), frames
/// of one identifier in the order of arrival: a FIFO would let a heartbeat delay a command. A mailbox is free again
/// once its frame is valid for the receivers; until then the frame is sent again and again.
pub struct BuiltinBus {
    timing: BitTiming,
    nodes: Vec<Node>,
    /// End of the last intermission; no frame starts earlier.
    idle: Instant,
    interference: Interference,
    reports: Vec<Report>,
    statistics: Statistics,
}

impl BuiltinBus {
    /// Most nodes of one bus.
    pub const MAX_NODES: usize = u64::BITS as usize;

    /// An idle bus without nodes.
    #[must_use]
    pub fn new(timing: BitTiming) -> Self {
        Self {
            timing,
            nodes: Vec::new(),
            idle: Instant::ORIGIN,
            interference: Interference::default(),
            reports: Vec::new(),
            statistics: Statistics::default(),
        }
    }

    /// Adds a node whose controller has `mailboxes` transmit mailboxes.
    ///
    /// # Panics
    /// Above [`Self::MAX_NODES`] nodes.
    pub fn attach(&mut self, mailboxes: usize) -> NodeId {
        self.add(Node::new(mailboxes, false))
    }

    /// Adds a node that neither acknowledges frames nor destroys wrong ones: an analyser in listen-only mode, which can
    /// send all the same.
    ///
    /// # Panics
    /// As [`Self::attach`].
    pub fn attach_listener(&mut self, mailboxes: usize) -> NodeId {
        self.add(Node::new(mailboxes, true))
    }

    fn add(&mut self, node: Node) -> NodeId {
        assert!(
            self.nodes.len() < Self::MAX_NODES,
            "a bus has at most {} nodes",
            Self::MAX_NODES
        );
        self.nodes.push(node);
        NodeId(self.nodes.len() - 1)
    }

    /// Adds a disturbance, with random numbers from `seed`.
    pub fn disturb(&mut self, disturbance: Disturbance, seed: u64) {
        self.interference.add(disturbance, seed);
    }

    /// From `from` until `until` nobody tells the controller of this node to recover once it is bus-off.
    ///
    /// # Panics
    /// With a node of another bus.
    pub fn leave_off(&mut self, node: NodeId, from: Instant, until: Instant) {
        self.nodes[node.0].unattended.push((from, until));
    }

    /// Error counters of a node.
    ///
    /// # Panics
    /// With a node of another bus.
    #[must_use]
    pub fn counters(&self, node: NodeId) -> Counters {
        self.nodes[node.0].counters
    }

    /// Puts a frame into a mailbox of `node` at `now`.
    ///
    /// `now` must not be earlier than the last delivery taken, and deliveries up to `now` must have been taken, since
    /// only that frees their mailboxes. A frame queued at the very instant another starts takes part in the
    /// arbitration; a later one waits.
    ///
    /// # Errors
    /// [`TransmitError::QueueFull`] when every mailbox is occupied; the frame is lost and counted.
    ///
    /// # Panics
    /// With a node of another bus.
    pub fn enqueue(
        &mut self,
        node: NodeId,
        now: Instant,
        frame: &CanFrame,
    ) -> Result<(), TransmitError> {
        let node = &mut self.nodes[node.0];
        if node.mailboxes.len() == node.capacity {
            self.statistics.refused += 1;
            return Err(TransmitError::QueueFull);
        }
        node.mailboxes.push(Mailbox {
            arbitration: arbitration_field(frame).0,
            frame: *frame,
            queued: now,
            duration: self.timing.duration(FrameBits::exact(frame)),
        });
        Ok(())
    }

    /// End of the current or next attempt to send, unless frames queued by then win arbitration, or of a recovery from
    /// bus-off; `None` when nothing will happen.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        Some(match self.next()? {
            Next::Transmission(next) => next.end,
            Next::Recovery(time, _) => time,
        })
    }

    /// The oldest frame received at or before `until` and not yet taken.
    ///
    /// By calling it the caller promises to queue nothing more before `until`. A frame that nobody acknowledges is sent
    /// for as long as that.
    pub fn pop_delivery(&mut self, until: Instant) -> Option<Delivery> {
        loop {
            match self.next()? {
                Next::Transmission(next) if next.end <= until => {
                    if let Some(delivery) = self.complete(&next) {
                        return Some(delivery);
                    }
                }
                Next::Recovery(time, node) if time <= until => {
                    self.nodes[node].recover(time);
                    self.report(time, node, Noticed::Recovered, Duration::ZERO);
                }
                _ => return None,
            }
        }
    }

    /// What nodes have reported since the last call, in the order of time.
    pub fn reports(&mut self) -> impl Iterator<Item = Report> + use<> {
        std::mem::take(&mut self.reports).into_iter()
    }

    /// Statistics so far. A frame counts once it is taken.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    fn next(&self) -> Option<Next> {
        let occurrence = self.bits(OCCURRENCE);
        let recovery = (self.nodes.iter().enumerate())
            .filter_map(|(index, node)| Some((node.recovers(occurrence)?, index)))
            .min();
        let transmission = self.next_transmission();
        match (recovery, transmission) {
            (Some((time, node)), next) if next.as_ref().is_none_or(|next| time <= next.start) => {
                Some(Next::Recovery(time, node))
            }
            (_, next) => next.map(Next::Transmission),
        }
    }

    /// Duration of nominal bits.
    fn bits(&self, nominal: u32) -> Duration {
        self.timing.duration(FrameBits { nominal, data: 0 })
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
            end: start + duration.saturating_sub(self.timing.after_valid()),
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
    fn trouble(&self, start: Instant, frame: &CanFrame, from: NodeSet) -> Option<Trouble> {
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
        let course = course::course(
            senders.min().unwrap_or(State::ErrorActive),
            &readers
                .iter()
                .map(|(_, reader)| *reader)
                .collect::<Vec<_>>(),
            hit.filter(|_| !for_all),
        );
        Some(Trouble {
            hit,
            readers,
            course,
        })
    }

    /// Empties the senders' mailboxes if the frame was sent, counts and reports; returns the frame if it was received.
    fn complete(&mut self, next: &Transmission) -> Option<Delivery> {
        let Transmission {
            start, idle, from, ..
        } = *next;
        self.idle = idle;
        let course = next.trouble.as_ref().map(|it| &it.course);
        let sent = course.is_none_or(|course| course.sent);
        let mut wait = Duration::ZERO;
        for NodeId(index) in from.iter() {
            let node = &mut self.nodes[index];
            let (place, mailbox) = node.candidate(start)?;
            wait = wait.max(start.since(mailbox.queued));
            if sent {
                node.mailboxes.remove(place);
            }
        }
        let to = if next.collides {
            self.collide(next);
            NodeSet::default()
        } else {
            self.settle(next)
        };
        let occurrence = self.bits(OCCURRENCE);
        for node in &mut self.nodes {
            node.witness(start, idle, occurrence);
            node.go_off(idle);
        }
        if next.collides {
            return None;
        }
        let received = !to.is_empty();
        let is_error = course.is_some_and(|course| course.error.is_some());
        let by_id = self.statistics.by_id.entry(next.frame.id()).or_default();
        for carried in [&mut self.statistics.total, by_id] {
            carried.add(idle.since(start), received.then_some(wait), is_error);
        }
        received.then_some(Delivery {
            time: next.end,
            start,
            frame: next.frame,
            from,
            to,
        })
    }
}
