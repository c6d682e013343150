//! Simulated CAN bus: bit-timed, with arbitration, deterministic.
//!
//! Time is an argument. The bus never runs by itself: the caller queues frames with [`BuiltinBus::enqueue`], gets the
//! time of the next event from [`BuiltinBus::next_event`], and takes received frames with [`BuiltinBus::pop_delivery`].
//!
//! Modelled: exact frame lengths, arbitration bit by bit, non-preemption, interframe space, transmit mailboxes,
//! identifier collisions. Not modelled: propagation delay, oscillator tolerance, error frames of other causes and error
//! counters; errors of a node are injected by wrappers around its [`Peer`](crate::peer::Peer).

mod load;

use std::collections::BTreeMap;

use protocol::bus::TransmitError;
use protocol::frame::{CanFrame, Id};
use protocol::time::{Duration, Instant};
use protocol::wire::{BitTiming, FrameBits, arbitration_field};

pub use load::{MAX_LOAD, Overload, Traffic, admit, worst_case_load};

/// Cost of an identifier collision besides the frames themselves: superposed error flags (6 to 12 bits) and error
/// delimiter (8).
const ERROR_FRAME: FrameBits = FrameBits {
    nominal: 12 + 8,
    data: 0,
};

/// A node of one bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeId(usize);

/// Some nodes of one bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeSet(u64);

impl NodeSet {
    /// Whether the node is one of them.
    #[must_use]
    pub fn contains(self, node: NodeId) -> bool {
        self.0 & 1 << node.0 != 0
    }

    /// The nodes, in the order they were attached.
    pub fn iter(self) -> impl Iterator<Item = NodeId> {
        (0..BuiltinBus::MAX_NODES)
            .map(NodeId)
            .filter(move |&node| self.contains(node))
    }

    fn insert(&mut self, node: usize) {
        self.0 |= 1 << node;
    }
}

/// A frame that arrived at every node but its sender.
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
}

/// Nodes that started different frames with one identifier at the same instant.
///
/// Arbitration cannot separate them, and a bit error follows. Real controllers repeat both frames and collide until
/// both are bus-off; here both frames are lost at once. Two nodes with the same identifier are a configuration error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Collision {
    /// When the frames started.
    pub start: Instant,
    /// Their identifier.
    pub id: Id,
    /// The nodes that sent them.
    pub nodes: NodeSet,
}

/// Traffic of one identifier, or of all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Carried {
    /// Frames received.
    pub frames: u64,
    /// Time they took, including interframe space.
    pub busy: Duration,
    /// Longest wait from [`BuiltinBus::enqueue`] to the start of frame.
    pub max_wait: Duration,
}

impl Carried {
    /// Share of `elapsed` for which the bus was busy, 0 to 1.
    #[must_use]
    pub fn load(&self, elapsed: Duration) -> f64 {
        self.busy.nanos() as f64 / elapsed.nanos().max(1) as f64
    }

    fn add(&mut self, busy: Duration, wait: Duration) {
        self.frames += 1;
        self.busy += busy;
        self.max_wait = self.max_wait.max(wait);
    }
}

/// Statistics of the bus since its creation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// All frames together.
    pub total: Carried,
    /// By identifier, in the order of arbitration.
    pub by_id: BTreeMap<Id, Carried>,
    /// Frames refused because every mailbox of their node was occupied.
    pub refused: u64,
    /// Identifier collisions.
    pub collisions: u64,
    /// The first of them.
    pub first_collision: Option<Collision>,
}

/// Frame in a transmit mailbox.
struct Mailbox {
    arbitration: u32,
    frame: CanFrame,
    queued: Instant,
    duration: Duration,
}

/// A node's CAN controller, from the bus's side.
struct Node {
    capacity: usize,
    /// In the order of filling.
    mailboxes: Vec<Mailbox>,
}

impl Node {
    /// The mailbox that takes part in an arbitration at `start`: the highest priority, and the oldest per identifier.
    fn candidate(&self, start: Instant) -> Option<(usize, &Mailbox)> {
        self.mailboxes
            .iter()
            .enumerate()
            .filter(|(_, mailbox)| mailbox.queued <= start)
            .min_by_key(|(_, mailbox)| mailbox.arbitration)
    }
}

/// The next transmission, as far as known.
struct Transmission {
    start: Instant,
    valid: Instant,
    idle: Instant,
    from: NodeSet,
    collides: bool,
}

/// The bus and the transmit side of its nodes' controllers.
///
/// A controller sends its mailboxes in the order of their priority (as bxCAN by default, M_CAN in queue mode), frames
/// of one identifier in the order of arrival: a FIFO would let a heartbeat delay a command. A mailbox is free again
/// once its frame is valid for the receivers.
pub struct BuiltinBus {
    timing: BitTiming,
    nodes: Vec<Node>,
    /// End of the last intermission; no frame starts earlier.
    idle: Instant,
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
            statistics: Statistics::default(),
        }
    }

    /// Adds a node whose controller has `mailboxes` transmit mailboxes.
    ///
    /// # Panics
    /// Above [`Self::MAX_NODES`] nodes.
    pub fn attach(&mut self, mailboxes: usize) -> NodeId {
        assert!(
            self.nodes.len() < Self::MAX_NODES,
            "a bus has at most {} nodes",
            Self::MAX_NODES
        );
        self.nodes.push(Node {
            capacity: mailboxes,
            mailboxes: Vec::with_capacity(mailboxes),
        });
        NodeId(self.nodes.len() - 1)
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

    /// End of the current or next transmission, unless frames queued by then win arbitration; `None` when there is
    /// nothing to send.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        self.next_transmission().map(|next| next.valid)
    }

    /// The oldest frame received at or before `until` and not yet taken.
    ///
    /// By calling it the caller promises to queue nothing more before `until`.
    pub fn pop_delivery(&mut self, until: Instant) -> Option<Delivery> {
        // Every round empties a mailbox.
        loop {
            let next = self.next_transmission()?;
            if next.valid > until {
                return None;
            }
            if let Some(delivery) = self.complete(&next) {
                return Some(delivery);
            }
        }
    }

    /// Statistics so far. A frame counts once it is taken.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Arbitration among the frames queued so far.
    ///
    /// A frame in transmission needs no state: frames queued after its start are not candidates, so the answer stays
    /// the same until it is complete.
    fn next_transmission(&self) -> Option<Transmission> {
        let oldest = self
            .nodes
            .iter()
            .flat_map(|node| &node.mailboxes)
            .map(|mailbox| mailbox.queued)
            .min()?;
        let start = oldest.max(self.idle);
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
            duration += self.timing.duration(ERROR_FRAME);
        }
        let idle = start + duration;
        Some(Transmission {
            start,
            valid: start + duration.saturating_sub(self.timing.after_valid()),
            idle,
            from,
            collides,
        })
    }

    /// Empties the senders' mailboxes and updates the statistics; returns the frame unless it collided.
    fn complete(&mut self, sent: &Transmission) -> Option<Delivery> {
        self.idle = sent.idle;
        let mut frame = None;
        let mut wait = Duration::ZERO;
        for NodeId(index) in sent.from.iter() {
            let node = &mut self.nodes[index];
            let (mailbox, _) = node.candidate(sent.start)?;
            let mailbox = node.mailboxes.remove(mailbox);
            wait = wait.max(sent.start.since(mailbox.queued));
            frame = Some(mailbox.frame);
        }
        let frame = frame?;
        if sent.collides {
            self.statistics.collisions += 1;
            self.statistics.first_collision.get_or_insert(Collision {
                start: sent.start,
                id: frame.id(),
                nodes: sent.from,
            });
            return None;
        }
        let busy = sent.idle.since(sent.start);
        self.statistics.total.add(busy, wait);
        self.statistics
            .by_id
            .entry(frame.id())
            .or_default()
            .add(busy, wait);
        Some(Delivery {
            time: sent.valid,
            start: sent.start,
            frame,
            from: sent.from,
        })
    }
}
