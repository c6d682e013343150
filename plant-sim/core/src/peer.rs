//! A node on the bus of a run: drives, operator, controller, or a wrapper that makes one of them fail.
//!
//! Time is in the seam: a peer is called with the time, and says when each of its frames enters its transmit buffer. A
//! wrapper can therefore delay, drop, double or shift what a node receives and sends, or babble at instants of its own,
//! and the node knows nothing of it.

use std::cell::RefCell;
use std::rc::Rc;

use protocol::frame::CanFrame;
use protocol::time::Instant;

use crate::world::World;

/// Frames that a call sends, each with the time at which it enters the transmit buffer: not before that of the call.
pub type Outbox = Vec<(Instant, CanFrame)>;

/// A node on the bus of a run.
pub trait Peer {
    /// When it is to be called without a frame: later than it was called last, or `None` for not at all.
    fn wake(&self) -> Option<Instant>;

    /// Takes the frame that it has just received, or finds that the time of [`Peer::wake`] has come, and appends what it
    /// sends to `out`. Nobody receives a frame of his own.
    ///
    /// # Errors
    /// It cannot take part any more, and the run has no meaning without it: a process or a board has failed, or does not do
    /// what its twin does.
    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError>;
}

/// Why a run cannot go on with a peer.
#[derive(Debug, thiserror::Error)]
#[error("the controller {who} {what}")]
pub struct PeerError {
    /// Which controller.
    pub who: String,
    /// What it did.
    pub what: String,
}

/// A peer that outlives its run.
impl<P: Peer + ?Sized> Peer for &mut P {
    fn wake(&self) -> Option<Instant> {
        (**self).wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        (**self).poll(now, received, world, out)
    }
}

/// A peer that is looked at while it runs.
impl<P: Peer + ?Sized> Peer for Rc<RefCell<P>> {
    fn wake(&self) -> Option<Instant> {
        self.borrow().wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        self.borrow_mut().poll(now, received, world, out)
    }
}
