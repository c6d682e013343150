//! A node on the bus of a run: drives, operator, controller, or a wrapper that makes one of them fail.
//!
//! The interface includes time: a peer is called with the time, and returns when each of its frames enters its transmit
//! buffer. A wrapper can therefore delay, drop, duplicate or shift what a node receives and sends, or babble at times
//! of its own, without the node's knowledge.

use std::cell::RefCell;
use std::rc::Rc;

use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};

use crate::world::World;

/// Frames sent by a call, each with the time at which it enters the transmit buffer, not before that of the call.
pub type Outbox = Vec<(Instant, CanFrame)>;

/// A node on the bus of a run.
pub trait Peer {
    /// When to call it without a frame: later than the last call, or `None` for never.
    fn wake(&self) -> Option<Instant>;

    /// Takes the frame just received, or `None` at the time of [`Peer::wake`], and appends the frames it sends to
    /// `out`. No peer receives its own frames.
    ///
    /// # Errors
    /// It can no longer take part, and the run is pointless without it: a process or a board has failed, or differs
    /// from its twin.
    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError>;

    /// Its CAN controller has gone bus-off; returns how long it is left alone before it is told to recover. A peer that its CAN
    /// controller does not tell has one that recovers by itself.
    ///
    /// # Errors
    /// Those of [`Peer::poll`].
    fn bus_off(&mut self, now: Instant) -> Result<Duration, PeerError> {
        let _ = now;
        Ok(Duration::ZERO)
    }

    /// Its answer to the last call has taken so long. A peer that has a clock of its own for that needs not be told.
    ///
    /// # Errors
    /// Those of [`Peer::poll`].
    fn took(&mut self, time: Duration) -> Result<(), PeerError> {
        let _ = time;
        Ok(())
    }

    /// Checks what it has left for later. The run has ended.
    ///
    /// # Errors
    /// Those of [`Peer::poll`].
    fn finish(&mut self) -> Result<(), PeerError> {
        Ok(())
    }
}

/// Why a run cannot continue with a peer.
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

    fn bus_off(&mut self, now: Instant) -> Result<Duration, PeerError> {
        (**self).bus_off(now)
    }

    fn took(&mut self, time: Duration) -> Result<(), PeerError> {
        (**self).took(time)
    }

    fn finish(&mut self) -> Result<(), PeerError> {
        (**self).finish()
    }
}

/// A peer that is inspected while it runs.
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

    fn bus_off(&mut self, now: Instant) -> Result<Duration, PeerError> {
        self.borrow_mut().bus_off(now)
    }

    fn took(&mut self, time: Duration) -> Result<(), PeerError> {
        self.borrow_mut().took(time)
    }

    fn finish(&mut self) -> Result<(), PeerError> {
        self.borrow_mut().finish()
    }
}
