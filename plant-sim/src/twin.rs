//! A controller in this process that receives the same frames as another one, which must then send the same.

use std::collections::VecDeque;

use firmware::control::controller::Config;
use firmware::node::Node;
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;
use protocol::time::{Duration, Instant};
use sim::controller::InProcess;
use trace::difference::Difference;

/// The controller that others are compared with.
#[derive(Debug)]
pub struct Twin {
    controller: InProcess,
    /// Frames that it has sent and the other has not yet.
    due: VecDeque<CanFrame>,
    /// Frames sent in the current call; empty between calls.
    sent: Vec<CanFrame>,
}

impl Twin {
    /// A twin at the beginning of a run.
    pub fn new(config: Config) -> Self {
        Self {
            controller: InProcess::new(config),
            due: VecDeque::new(),
            sent: Vec::new(),
        }
    }

    /// The controller.
    pub fn controller(&self) -> &InProcess {
        &self.controller
    }

    /// The node.
    pub fn node(&self) -> &Node {
        self.controller.node()
    }

    /// Restarts like the other, for this reason.
    pub fn restart(&mut self, reason: ResetReason) {
        self.controller.restart(reason);
        self.due.clear();
    }

    /// Calls the twin like the other controller.
    pub fn call(&mut self, now: Instant, received: Option<&CanFrame>) {
        self.controller.call(now, received, &mut self.sent);
        self.due.extend(self.sent.drain(..));
    }

    /// Tells the twin, as the other, that its CAN controller has gone bus-off; returns how long that is then left alone.
    pub fn bus_off(&mut self, now: Instant) -> Duration {
        self.controller.bus_off(now)
    }

    /// Tells the twin, as the other, how long its answer to the last call has taken.
    pub fn took(&mut self, time: Duration) {
        self.controller.took(time);
    }

    /// Compares a frame of the other with the next one expected.
    ///
    /// # Errors
    /// They differ.
    pub fn compare(&mut self, found: &CanFrame) -> Result<(), Difference> {
        let due = self.due.pop_front();
        Difference::between(due.as_ref(), Some(found)).map_or(Ok(()), Err)
    }

    /// Frames that the other has yet to send.
    pub fn due(&mut self) -> &mut VecDeque<CanFrame> {
        &mut self.due
    }
}
