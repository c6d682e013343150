//! What the bus has carried.

use std::collections::BTreeMap;

use protocol::frame::Id;
use protocol::time::Duration;

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
    /// Attempts of several nodes at once to send different frames of one identifier.
    pub collisions: u64,
}
