//! What the bus has carried.

use std::collections::BTreeMap;

use protocol::frame::Id;
use protocol::time::{Duration, Instant};

use super::nodes::NodeSet;

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
    /// Attempts in which a node has found an error.
    pub errors: u64,
    /// Time that frames and attempts took, including error frames and interframe space.
    pub busy: Duration,
    /// Longest wait from [`BuiltinBus::enqueue`](super::BuiltinBus::enqueue) to the start of a frame that was received, with
    /// all attempts before it.
    pub max_wait: Duration,
}

impl Carried {
    /// Share of `elapsed` for which the bus was busy, 0 to 1.
    #[must_use]
    pub fn load(&self, elapsed: Duration) -> f64 {
        self.busy.nanos() as f64 / elapsed.nanos().max(1) as f64
    }

    /// Counts a frame and how long it waited, if it was received, or an attempt that took so long.
    pub(super) fn add(&mut self, busy: Duration, received: Option<Duration>, is_error: bool) {
        self.busy += busy;
        self.errors += u64::from(is_error);
        if let Some(wait) = received {
            self.frames += 1;
            self.max_wait = self.max_wait.max(wait);
        }
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
