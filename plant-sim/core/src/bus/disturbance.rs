//! Disturbances of the bus: which attempt to send a frame fails, and where in it.

use std::cell::Cell;

use oorandom::Rand64;
use protocol::schema::MessageInfo;
use protocol::time::Instant;

use super::anatomy::{Anatomy, Bit, Field};
use super::node::Mailbox;
use super::nodes::NodeId;

/// What is wrong with a frame, in the words of ISO 11898-1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The transmitter reads another bit than it sends.
    Bit,
    /// Six equal bits in a row, for all nodes.
    Stuff,
    /// A bit of fixed form, such as the CRC delimiter, is dominant for all nodes.
    Form,
    /// Receivers compute another CRC than they read.
    Crc,
    /// The transmitter reads no acknowledgement.
    Ack,
}

/// What is disturbed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disturbed {
    /// Frames of a message, in this way.
    Message(&'static MessageInfo, ErrorKind),
    /// What this node reads of the others' frames, which then has a wrong CRC.
    Reader(NodeId),
}

/// A disturbance of the bus. Attempts to send suffer it that begin within its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// What is disturbed.
    pub what: Disturbed,
    /// Share of the attempts that suffer, 0 to 1.
    pub share: f64,
    /// Beginning.
    pub from: Instant,
    /// End.
    pub until: Instant,
}

/// An error in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Hit {
    /// What is wrong.
    pub(super) kind: ErrorKind,
    /// Where, as its number in the frame.
    pub(super) index: usize,
    /// That bit.
    pub(super) bit: Bit,
}

impl Hit {
    /// An error of this kind in a frame; `random` chooses among the bits that can have it.
    #[must_use]
    pub(super) fn new(kind: ErrorKind, anatomy: &Anatomy, random: u64) -> Self {
        let choose = |bits: Vec<usize>| bits[(random % bits.len() as u64) as usize];
        let index = match kind {
            ErrorKind::Bit => choose(anatomy.written().collect()),
            ErrorKind::Stuff => choose(anatomy.stuffing()),
            ErrorKind::Form => choose(anatomy.fixed().collect()),
            ErrorKind::Crc => anatomy.first(Field::Crc),
            ErrorKind::Ack => anatomy.first(Field::AckSlot),
        };
        Self {
            kind,
            index,
            bit: anatomy.bits[index],
        }
    }
}

/// A disturbance with its chance for the next attempt.
#[derive(Clone, Debug)]
struct Source {
    disturbance: Disturbance,
    random: Rand64,
    /// In [0, 1).
    chance: f64,
    place: u64,
    /// Whether an attempt has suffered it.
    has_hit: Cell<bool>,
}

/// All disturbances of a bus. Chances are drawn once an attempt, so that looking ahead changes nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Interference {
    sources: Vec<Source>,
    /// Attempts so far.
    attempts: u64,
}

impl Interference {
    /// Adds a disturbance with a sequence of random numbers of its own, as far on as if it had been there from the beginning;
    /// its number.
    pub(super) fn add(&mut self, disturbance: Disturbance, seed: u64) -> usize {
        let place = self.sources.len();
        let number = place as u128;
        let mut source = Source {
            disturbance,
            // Apart from those of the nodes, which have the same seed.
            random: Rand64::new(u128::from(seed) << 64 | 1 << 32 | number),
            chance: 0.0,
            place: 0,
            has_hit: Cell::new(false),
        };
        (0..=self.attempts).for_each(|_| source.draw());
        self.sources.push(source);
        place
    }

    /// Gives a disturbance another time.
    pub(super) fn retime(&mut self, number: usize, from: Instant, until: Instant) {
        let disturbance = &mut self.sources[number].disturbance;
        (disturbance.from, disturbance.until) = (from, until);
    }

    /// Whether an attempt has suffered this disturbance.
    pub(super) fn has_hit(&self, number: usize) -> bool {
        self.sources[number].has_hit.get()
    }

    /// Draws the chances of the next attempt.
    pub(super) fn draw(&mut self) {
        self.attempts += 1;
        self.sources.iter_mut().for_each(Source::draw);
    }

    /// Whether anything is disturbed in an attempt that starts at `start`.
    pub(super) fn acts(&self, start: Instant) -> bool {
        self.acting(start).next().is_some()
    }

    /// The error of the frame of this mailbox that starts at `start`, if it has one.
    pub(super) fn hit(&self, start: Instant, mailbox: &Mailbox) -> Option<Hit> {
        self.acting(start).find_map(|source| {
            let Disturbed::Message(info, kind) = source.disturbance.what else {
                return None;
            };
            let concerned = info.identifies(&mailbox.frame);
            concerned.then(|| {
                source.has_hit.set(true);
                Hit::new(kind, mailbox.anatomy(), source.place)
            })
        })
    }

    /// Whether the node reads a wrong CRC in a frame that starts at `start`.
    pub(super) fn misleads(&self, start: Instant, node: NodeId) -> bool {
        let reader = Disturbed::Reader(node);
        let mut misleading = self
            .acting(start)
            .filter(|it| it.disturbance.what == reader);
        let found = misleading.next();
        found.inspect(|it| it.has_hit.set(true)).is_some()
    }

    fn acting(&self, start: Instant) -> impl Iterator<Item = &Source> {
        self.sources.iter().filter(move |source| {
            let Disturbance {
                share, from, until, ..
            } = source.disturbance;
            (from..until).contains(&start) && source.chance < share
        })
    }
}

impl Source {
    fn draw(&mut self) {
        self.chance = self.random.rand_float();
        self.place = self.random.rand_u64();
    }
}
