//! The heartbeat of drives and operator.

use protocol::codec::Encoder;
use protocol::messages::{Heartbeat, Message, Node};
use protocol::time::{Duration, Instant, Period};

use crate::peer::Outbox;

/// Time between two heartbeats.
const PERIOD: Duration = Duration::from_millis(100);

/// When a node of the simulation gives its next sign of life.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heart {
    next: Instant,
    /// From a sampling instant until the heartbeat of that sample, behind feedback, command and state: it delays none of them.
    later: Duration,
}

impl Heart {
    /// One that beats from `begin` on, where samples are taken every `period`.
    pub(crate) fn new(begin: Instant, period: Period) -> Self {
        Self {
            next: begin,
            later: Duration::from_nanos(period.duration().nanos() / 5 * 3),
        }
    }

    /// Sends the heartbeat if it is due at the sampling instant `now`.
    pub(crate) fn beat(
        &mut self,
        now: Instant,
        (node, heartbeat): (Node, Heartbeat),
        encoder: &mut Encoder,
        out: &mut Outbox,
    ) {
        if now < self.next {
            return;
        }
        self.next = now + PERIOD;
        let frame = encoder.encode(&Message::Heartbeat(node, heartbeat));
        out.extend(frame.map(|frame| (now + self.later, frame)));
    }
}
