//! A node's CAN controller, from the bus's side.

use std::cell::OnceCell;

use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};
use protocol::wire::{BitTiming, FrameBits, arbitration_field};

use super::anatomy::Anatomy;
use super::counters::{Counters, State};

/// Occurrences of eleven recessive bits after which a bus-off node may take part again.
const OCCURRENCES: u64 = 128;
/// Bits of such an occurrence; every frame and every error frame ends with one.
pub(super) const OCCURRENCE: u32 = 11;

/// Frame in a transmit mailbox.
#[derive(Clone)]
pub(super) struct Mailbox {
    pub(super) arbitration: u32,
    pub(super) frame: CanFrame,
    pub(super) queued: Instant,
    pub(super) duration: Duration,
    /// Once somebody has asked for it.
    anatomy: OnceCell<Anatomy>,
}

impl Mailbox {
    pub(super) fn new(frame: &CanFrame, queued: Instant, timing: &BitTiming) -> Self {
        Self {
            arbitration: arbitration_field(frame).0,
            frame: *frame,
            queued,
            duration: timing.duration(FrameBits::exact(frame)),
            anatomy: OnceCell::new(),
        }
    }

    /// The bits of the frame: taken apart once, however often the frame is sent.
    pub(super) fn anatomy(&self) -> &Anatomy {
        self.anatomy.get_or_init(|| Anatomy::of(&self.frame))
    }
}

/// A node's CAN controller.
#[derive(Clone)]
pub(super) struct Node {
    pub(super) capacity: usize,
    /// In the order of filling. They stay there while the node is bus-off, as in an M_CAN.
    pub(super) mailboxes: Vec<Mailbox>,
    /// Whether it takes no part in what it receives: it neither acknowledges nor destroys frames.
    pub(super) listens: bool,
    pub(super) counters: Counters,
    /// End of its suspended transmission, or of its recovery: no frame of the node starts earlier.
    pub(super) ready: Instant,
    /// Recovery, while bus-off.
    pub(super) off: Option<Recovery>,
}

/// Progress of a bus-off node.
#[derive(Clone, Copy)]
pub(super) struct Recovery {
    /// From when on the bus is recessive, as far as counted.
    since: Instant,
    /// Occurrences still to come.
    left: u64,
}

impl Node {
    pub(super) fn new(mailboxes: usize, listens: bool) -> Self {
        Self {
            capacity: mailboxes,
            mailboxes: Vec::with_capacity(mailboxes),
            listens,
            counters: Counters::default(),
            ready: Instant::ORIGIN,
            off: None,
        }
    }

    /// When the node could begin to send on a bus that is idle from `idle` on.
    pub(super) fn earliest(&self, idle: Instant) -> Option<Instant> {
        let queued = self.mailboxes.iter().map(|mailbox| mailbox.queued).min()?;
        let ready = queued.max(self.ready).max(idle);
        self.off.is_none().then_some(ready)
    }

    /// The mailbox that takes part in an arbitration at `start`: the highest priority, and the oldest per identifier.
    pub(super) fn candidate(&self, start: Instant) -> Option<(usize, &Mailbox)> {
        if self.off.is_some() || self.ready > start {
            return None;
        }
        self.mailboxes
            .iter()
            .enumerate()
            .filter(|(_, mailbox)| mailbox.queued <= start)
            .min_by_key(|(_, mailbox)| mailbox.arbitration)
    }

    /// Whether it acknowledges frames and destroys wrong ones.
    pub(super) fn takes_part(&self) -> bool {
        self.off.is_none() && !self.listens
    }

    /// Goes bus-off if its counters say so; its software begins the recovery at `attended`.
    pub(super) fn go_off(&mut self, attended: Instant) {
        if self.off.is_none() && self.counters.state() == State::BusOff {
            self.off = Some(Recovery {
                since: attended,
                left: OCCURRENCES,
            });
        }
    }

    /// Its software does not begin the recovery before `until`.
    pub(super) fn leave_alone(&mut self, until: Instant) {
        if let Some(Recovery { since, .. }) = &mut self.off {
            *since = until.max(*since);
        }
    }

    /// Its software begins the recovery at `attended`, if it has not begun before.
    pub(super) fn attend(&mut self, attended: Instant) {
        if let Some(Recovery { since, .. }) = &mut self.off {
            *since = attended.min(*since);
        }
    }

    /// When it takes part again if nobody sends, with an occurrence taking `occurrence`; `None` for never.
    pub(super) fn recovers(&self, occurrence: Duration) -> Option<Instant> {
        let Recovery { since, left } = self.off?;
        let wait = Duration::from_nanos(occurrence.nanos().saturating_mul(left));
        (since < Instant::MAX).then(|| since + wait)
    }

    /// Takes part again from `now` on.
    pub(super) fn recover(&mut self, now: Instant) {
        self.off = None;
        self.ready = now;
        self.counters = Counters::default();
    }

    /// Sees the bus busy from `start` to `idle`.
    pub(super) fn witness(&mut self, start: Instant, idle: Instant, occurrence: Duration) {
        if let Some(Recovery { since, left }) = &mut self.off
            && *since < idle
        {
            let passed = start.since(*since).nanos() / occurrence.nanos().max(1);
            *left = left.saturating_sub(passed + 1);
            *since = idle;
        }
    }
}
