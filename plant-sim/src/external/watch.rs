//! The built-in bus, shown to CAN tools on a serial-line port.

use std::time::Duration;

use firmware::node::Node;
use link::realtime::{monotonic, sleep_until};
use link::{Clients, Link, SlcanHub};
use protocol::bus::Bus as _;
use protocol::frame::CanFrame;

use sim::endpoint::{Endpoint, EndpointError};

/// Between two looks for a client.
const PATIENCE: Duration = Duration::from_millis(100);

/// A controller whose bus is shown: every frame it receives or sends is one on the bus, and there are no others.
///
/// The run waits for the first client and then goes at the speed of the clock, so that a person can follow it.
pub struct Watched<E> {
    controller: E,
    hub: Link,
    origin: Option<Duration>,
}

impl<E: Endpoint> Watched<E> {
    /// Shows the bus of `controller` on `server`, `HOST:PORT`.
    ///
    /// # Errors
    /// The port is taken or not this machine's.
    pub fn new(controller: E, server: &str) -> Result<Self, EndpointError> {
        let hub = SlcanHub::bind(server, Clients::Watch).map_err(|error| EndpointError {
            who: "in this process".into(),
            what: format!("cannot be watched: {error}"),
        })?;
        Ok(Self {
            controller,
            hub: Link::SlcanHub(hub),
            origin: None,
        })
    }

    /// Answers clients, greets new ones and lets others go.
    fn serve(&mut self) {
        if let Link::SlcanHub(hub) = &mut self.hub {
            hub.exchange();
        }
    }

    fn show(&mut self, frame: &CanFrame) {
        // A hub takes every frame; clients that do not read lose it, and the run does not wait for them.
        let _ = self.hub.transmit(frame);
    }
}

impl<E: Endpoint> Endpoint for Watched<E> {
    fn poll(
        &mut self,
        now: u64,
        received: Option<&CanFrame>,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError> {
        let now_of_run = Duration::from_micros(now);
        match self.origin {
            Some(origin) => sleep_until(origin + now_of_run),
            None => {
                eprintln!("plant-sim: waiting for a client");
                self.wait_for_client()?;
                self.origin = Some(monotonic().saturating_sub(now_of_run));
            }
        }
        self.serve();
        if let Some(frame) = received {
            self.show(frame);
        }
        let before = sent.len();
        self.controller.poll(now, received, sent)?;
        for frame in &sent[before..] {
            self.show(frame);
        }
        Ok(())
    }

    fn node(&self) -> &Node {
        self.controller.node()
    }

    fn latency_ns(&self) -> u64 {
        self.controller.latency_ns()
    }
}

impl<E> Watched<E> {
    fn wait_for_client(&mut self) -> Result<(), EndpointError> {
        while !matches!(&self.hub, Link::SlcanHub(hub) if hub.is_open()) {
            self.hub.wait(PATIENCE).map_err(|error| EndpointError {
                who: "in this process".into(),
                what: format!("cannot be watched any more: {error}"),
            })?;
        }
        Ok(())
    }
}
