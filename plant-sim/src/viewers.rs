//! The built-in bus, shown to CAN tools on a serial-line port.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use link::realtime::{monotonic, sleep_until};
use link::{Clients, Link, LinkError, SlcanHub};
use protocol::bus::Transmit as _;
use protocol::frame::CanFrame;
use protocol::time::Instant;
use sim::observer::{Observer, Pace};

use crate::interrupt;
use crate::say;

/// Interval of checking for a client.
const PATIENCE: Duration = Duration::from_millis(100);

/// Viewers of the bus of a run. As an observer they see its frames; as a pace they hold the run until the first of
/// them has connected, and then to real time, so that a person can follow it.
#[derive(Clone)]
pub struct Viewers {
    hub: Rc<RefCell<Link>>,
    /// Start of the run on the machine's clock.
    origin: Option<Duration>,
}

impl Viewers {
    /// No viewers yet; listens on `server`, `HOST:PORT`.
    ///
    /// # Errors
    /// The port is in use, or the address is not one of this machine.
    pub fn bind(server: &str) -> Result<Self, LinkError> {
        let hub = SlcanHub::bind(server, Clients::Watch)?;
        Ok(Self {
            hub: Rc::new(RefCell::new(Link::SlcanHub(hub))),
            origin: None,
        })
    }

    fn wait(&self) -> io::Result<()> {
        let mut hub = self.hub.borrow_mut();
        while !matches!(&*hub, Link::SlcanHub(hub) if hub.is_open()) {
            if interrupt::asked() {
                return Err(interrupt::error());
            }
            hub.wait(PATIENCE).map_err(io::Error::other)?;
        }
        Ok(())
    }
}

impl Observer for Viewers {
    fn frame(&mut self, _: Instant, frame: &CanFrame) -> io::Result<()> {
        // A hub accepts every frame; clients that do not read lose it, and the run does not wait for them.
        let mut hub = self.hub.borrow_mut();
        let _ = hub.transmit(frame);
        // Later clients are accepted, and frames from clients are refused: there is nothing to take.
        hub.wait(Duration::ZERO).map_err(io::Error::other)?;
        Ok(())
    }
}

impl Pace for Viewers {
    fn sample(&mut self, now: Instant) -> io::Result<()> {
        let now = Duration::from_nanos(now.nanos());
        // Answers clients, accepts new ones and drops closed ones.
        if let Link::SlcanHub(hub) = &mut *self.hub.borrow_mut() {
            hub.exchange();
        }
        match self.origin {
            Some(origin) => sleep_until(origin + now),
            None => {
                say!("plant-sim: waiting for a client");
                self.wait()?;
                self.origin = Some(monotonic().saturating_sub(now));
            }
        }
        Ok(())
    }
}
