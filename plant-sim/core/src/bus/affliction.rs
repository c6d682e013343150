//! What is wrong with a node or with the wires for a while, whatever is sent.

use protocol::time::Instant;

use super::nodes::NodeId;

/// Level of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// What a node sends that means 0: it wins.
    Dominant,
    /// What is there while nobody sends.
    Recessive,
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Affliction {
    /// Nobody tells the node's controller to recover once it is bus-off.
    NoRecovery(NodeId),
    /// The node sends the frame of the highest priority whenever it may.
    Babbling(NodeId),
    /// The wires stay at this level.
    Wires(Level),
}

/// Everything that is wrong like this, and when.
#[derive(Clone, Debug, Default)]
pub(super) struct Afflictions(Vec<(Affliction, Instant, Instant)>);

impl Afflictions {
    /// Adds one; its number.
    pub(super) fn add(&mut self, what: Affliction, from: Instant, until: Instant) -> usize {
        self.0.push((what, from, until));
        self.0.len() - 1
    }

    /// Gives one another time; what it is.
    pub(super) fn retime(&mut self, number: usize, from: Instant, until: Instant) -> Affliction {
        let affliction = &mut self.0[number];
        (affliction.1, affliction.2) = (from, until);
        affliction.0
    }

    /// The times of `what` that have not ended by `now`.
    pub(super) fn of(
        &self,
        what: Affliction,
        now: Instant,
    ) -> impl Iterator<Item = (Instant, Instant)> {
        let times = self.0.iter().filter(move |(it, ..)| *it == what);
        let times = times.map(|(_, from, until)| (*from, *until));
        times.filter(move |(from, until)| *until > now && until > from)
    }

    /// Whether it is so at `now`.
    pub(super) fn acts(&self, what: Affliction, now: Instant) -> bool {
        self.of(what, now).any(|(from, _)| from <= now)
    }
}
