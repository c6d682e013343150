//! Where the controller lives: the rig hands it frames and takes what it sends.

use std::collections::VecDeque;

use firmware::control::controller::Config;
use firmware::node::Node;
use protocol::bus::{Bus, TransmitError};
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;

/// Time the controller takes from frame in to frame out, ns: 4000 instructions at 100 MHz.
pub const COMPUTE_NS: u64 = 40_000;

/// A controller somewhere, in lock-step with the rig.
pub trait Endpoint {
    /// Lets the controller look at `received` at time `now` (µs) and appends what it sends.
    ///
    /// # Errors
    /// The controller did not answer within the endpoint's limit, or answered what no controller
    /// of this source would.
    fn poll(
        &mut self,
        now: u64,
        received: Option<&CanFrame>,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError>;

    /// The controller itself, or the twin that is fed the same frames: what it had in mind.
    fn node(&self) -> &Node;

    /// Time from the frame handed over last until its answer left the controller, ns.
    fn latency_ns(&self) -> u64 {
        COMPUTE_NS
    }
}

/// A controller that outlives its rig, to be asked about the run afterwards.
impl<E: Endpoint> Endpoint for &mut E {
    fn poll(
        &mut self,
        now: u64,
        received: Option<&CanFrame>,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError> {
        (**self).poll(now, received, sent)
    }

    fn node(&self) -> &Node {
        (**self).node()
    }

    fn latency_ns(&self) -> u64 {
        (**self).latency_ns()
    }
}

/// Why a controller is of no use any more.
#[derive(Debug, thiserror::Error)]
#[error("the controller {who} {what}")]
pub struct EndpointError {
    /// Which controller.
    pub who: String,
    /// What it did.
    pub what: String,
}

/// The controller as a part of this process.
#[derive(Debug)]
pub struct InProcess {
    config: Config,
    node: Node,
}

impl InProcess {
    /// A controller in self-test.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            node: Node::new(config, ResetReason::PowerOn),
        }
    }

    /// Starts the controller again, for this reason.
    pub fn restart(&mut self, reason: ResetReason) {
        self.node = Node::new(self.config, reason);
    }
}

impl Endpoint for InProcess {
    fn poll(
        &mut self,
        now: u64,
        received: Option<&CanFrame>,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError> {
        // Network management's reset, asked for in the last call.
        if self.node.reset_asked() {
            self.restart(ResetReason::Software);
        }
        let mut port = Port {
            received: received.copied().into_iter().collect(),
            sent,
        };
        self.node.poll(now, &mut port);
        Ok(())
    }

    fn node(&self) -> &Node {
        &self.node
    }
}

/// The node's end of the rig: never full, since the rig takes everything at once.
struct Port<'a> {
    received: VecDeque<CanFrame>,
    sent: &'a mut Vec<CanFrame>,
}

impl Bus for Port<'_> {
    fn receive(&mut self) -> Option<CanFrame> {
        self.received.pop_front()
    }

    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self.sent.push(*frame);
        Ok(())
    }
}
