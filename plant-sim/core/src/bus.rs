//! Simulated CAN bus: bit-timed, with arbitration, deterministic.
//!
//! Time is an argument. The bus never runs by itself: the caller queues frames with [`BuiltinBus::enqueue`], gets the
//! time of the next event from [`BuiltinBus::next_event`], and takes received frames with [`BuiltinBus::pop_delivery`].
//!
//! Modelled: exact frame lengths, arbitration bit by bit, non-preemption, interframe space, transmit mailboxes; errors of
//! ISO 11898-1 with error frames, error counters, retransmission, bus-off and recovery, where a [`Disturbance`] or an
//! [`Affliction`] causes them, two nodes send different frames of one identifier, or nobody acknowledges. Not modelled:
//! propagation delay, oscillator tolerance, overload frames. What goes wrong inside a node is injected by wrappers around its
//! [`Peer`](crate::peer::Peer).

mod affliction;
mod anatomy;
mod counters;
mod course;
mod disturbance;
mod foresight;
mod held;
mod load;
mod node;
mod nodes;
mod report;
mod settle;
mod statistics;

use protocol::bus::TransmitError;
use protocol::frame::{CanFrame, StandardId};
use protocol::time::{Duration, Instant};
use protocol::wire::{BitTiming, FrameBits};

use affliction::Afflictions;
use disturbance::Interference;
use foresight::{Next, Transmission};
use held::Held;
use node::{Mailbox, Node, OCCURRENCE};

pub use affliction::{Affliction, Level};
pub use anatomy::Field;
pub use counters::{Counters, Rule, State};
pub use disturbance::{Disturbance, Disturbed, ErrorKind};
pub use load::{MAX_LOAD, Overload, Traffic, admit, worst_case_load};
pub use nodes::{NodeId, NodeSet};
pub use report::{Noticed, Report};
pub use statistics::{Carried, Statistics};

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

/// The bus and the transmit side of its nodes' controllers.
///
/// A controller sends its mailboxes in the order of their priority (as bxCAN by default, M_CAN in queue mode), frames
/// of one identifier in the order of arrival: a FIFO would let a heartbeat delay a command. A mailbox is free again
/// once its frame is valid for the receivers; until then the frame is sent again and again.
#[derive(Clone)]
pub struct BuiltinBus {
    timing: BitTiming,
    /// Duration of [`OCCURRENCE`].
    occurrence: Duration,
    /// [`BitTiming::after_valid`].
    after_valid: Duration,
    nodes: Vec<Node>,
    /// End of the last intermission; no frame starts earlier.
    idle: Instant,
    interference: Interference,
    afflictions: Afflictions,
    /// While the bus is dominant where it should not be.
    held: Option<Held>,
    /// What a babbling node sends.
    babble: Mailbox,
    /// What happens next, renewed by whatever can change it.
    next: Option<Next>,
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
            occurrence: timing.duration(FrameBits {
                nominal: OCCURRENCE,
                data: 0,
            }),
            after_valid: timing.after_valid(),
            timing,
            nodes: Vec::new(),
            idle: Instant::ORIGIN,
            interference: Interference::default(),
            afflictions: Afflictions::default(),
            held: None,
            babble: babble(&timing),
            next: None,
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
        self.next = self.foreseen();
        NodeId(self.nodes.len() - 1)
    }

    /// Adds a disturbance, with random numbers from `seed`.
    pub fn disturb(&mut self, disturbance: Disturbance, seed: u64) -> Wrong {
        let number = self.interference.add(disturbance, seed);
        self.next = self.foreseen();
        Wrong::Disturbance(number)
    }

    /// Adds something that is so from `from` until `until`.
    pub fn afflict(&mut self, what: Affliction, from: Instant, until: Instant) -> Wrong {
        let number = self.afflictions.add(what, from, until);
        self.next = self.foreseen();
        Wrong::Affliction(number)
    }

    /// Gives something that is wrong another time, of which nothing that changes has passed.
    ///
    /// # Panics
    /// With something of another bus.
    pub fn retime(&mut self, what: Wrong, from: Instant, until: Instant) {
        match what {
            Wrong::Disturbance(number) => self.interference.retime(number, from, until),
            Wrong::Affliction(number) => {
                let what = self.afflictions.retime(number, from, until);
                if let Affliction::NoRecovery(NodeId(index)) = what {
                    self.nodes[index].attend(until);
                }
            }
        }
        self.next = self.foreseen();
    }

    /// Whether something that is wrong has changed what becomes of a frame; of what does not wait for frames, always.
    pub fn has_hit(&self, what: Wrong) -> bool {
        match what {
            Wrong::Disturbance(number) => self.interference.has_hit(number),
            Wrong::Affliction(_) => true,
        }
    }

    /// Has the software of a node that has just gone bus-off wait until then before it tells its controller to recover.
    ///
    /// # Panics
    /// With a node of another bus.
    pub fn leave_alone(&mut self, node: NodeId, until: Instant) {
        self.nodes[node.0].leave_alone(until);
        self.next = self.foreseen();
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
        // A frame that is queued after the start of another does not change what becomes of that.
        let is_known = matches!(&self.next, Some(Next::Transmission(next)) if next.start < now);
        let node = &mut self.nodes[node.0];
        if node.mailboxes.len() == node.capacity {
            self.statistics.refused += 1;
            return Err(TransmitError::QueueFull);
        }
        node.mailboxes.push(Mailbox::new(frame, now, &self.timing));
        if !is_known {
            self.next = self.foreseen();
        }
        Ok(())
    }

    /// End of the current or next attempt to send, unless frames queued by then win arbitration, or of a recovery from
    /// bus-off; `None` when nothing will happen.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        self.next.as_ref().map(Next::time)
    }

    /// The oldest frame received at or before `until` and not yet taken.
    ///
    /// By calling it the caller promises to queue nothing more before `until`. A frame that nobody acknowledges is sent
    /// for as long as that.
    pub fn pop_delivery(&mut self, until: Instant) -> Option<Delivery> {
        loop {
            let next = self.next.take_if(|next| next.time() <= until)?;
            let delivery = match next {
                Next::Transmission(next) => self.complete(&next),
                Next::Recovery(time, node) => {
                    self.nodes[node].recover(time);
                    self.report(time, node, Noticed::Recovered, Duration::ZERO);
                    None
                }
                Next::Hold(held) => {
                    self.held = Some(held);
                    None
                }
                Next::Held(time, step) => {
                    self.endure(time, step);
                    None
                }
            };
            self.next = self.foreseen();
            if delivery.is_some() {
                return delivery;
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

    /// Duration of nominal bits.
    fn bits(&self, nominal: u32) -> Duration {
        self.timing.duration(FrameBits { nominal, data: 0 })
    }

    /// Empties the senders' mailboxes if the frame was sent, counts and reports; returns the frame if it was received.
    fn complete(&mut self, next: &Transmission) -> Option<Delivery> {
        let Transmission {
            start, idle, from, ..
        } = *next;
        self.statistics.collisions += u64::from(next.clash.is_some());
        self.idle = idle;
        let course = next.trouble.as_ref().map(|it| &it.course);
        let sent = course.is_none_or(|course| course.sent);
        let mut wait = Duration::ZERO;
        for NodeId(index) in from.iter() {
            let (place, mailbox) = self.candidate(index, start)?;
            // One that babbles has not been queued.
            let queued = place.map_or(start, |_| mailbox.queued);
            wait = wait.max(start.since(queued));
            if let (true, Some(place)) = (sent, place) {
                self.nodes[index].mailboxes.remove(place);
            }
        }
        let to = self.settle(next);
        for index in 0..self.nodes.len() {
            self.nodes[index].witness(start, idle, self.occurrence);
            self.go_off(index, idle);
        }
        let received = !to.is_empty();
        let is_error = next.clash.is_some() || course.is_some_and(|course| course.error.is_some());
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

    /// A node goes bus-off if its counters say so, on a bus that is idle from `idle` on. If its software begins the recovery it
    /// does so at once.
    fn go_off(&mut self, index: usize, idle: Instant) {
        if self.nodes[index].counters.state() != State::BusOff {
            return;
        }
        let left = Affliction::NoRecovery(NodeId(index));
        let times = self.afflictions.of(left, idle);
        let within = times.filter(|(from, _)| *from <= idle);
        let attended = within.map(|(_, until)| until).max().unwrap_or(idle);
        self.nodes[index].go_off(attended);
    }
}

/// Something that is wrong with a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// The disturbance of this number.
    Disturbance(usize),
    /// The affliction of this number.
    Affliction(usize),
}

/// The frame of the highest priority that a classical bus can carry, with eight bytes.
fn babble(timing: &BitTiming) -> Mailbox {
    let id = StandardId::new(0).expect("an identifier of 11 bits");
    let frame = CanFrame::classical(id, &[0; 8]).expect("eight bytes");
    Mailbox::new(&frame, Instant::ORIGIN, timing)
}
