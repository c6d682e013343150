//! A controller in another process or on a board, reached over a CAN link.
//!
//! The rig keeps its bit-timed bus: frames delivered to the controller go out on the link, and the controller's answers
//! are put onto the bit-timed bus. Every frame of the run is therefore visible on the link, and the results are timed
//! as on a wire even if the link is virtual.
//!
//! - *Lock-step*: the plant waits for the answer. The controller counts time in samples
//!   ([`SampleClock`](firmware::cabinet::sample_clock::SampleClock)), so a twin of it in this process
//!   must send the same frames when given the same frames; each is compared byte for byte.
//! - *Real time*: samples are taken at absolute deadlines of the machine's clock. A late command acts late.

mod lock_step;
mod measure;
pub(crate) mod peers;
mod picture;
mod realtime;
mod timing;
mod wall_clock;

use std::time::{Duration, Instant};

use firmware::node::Node;
use link::Link;
use protocol::bus::{Transmit as _, TransmitError};
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Mode};

use sim::peer::PeerError;

use crate::say;

pub use lock_step::LockStep;
pub use measure::measure;
pub use picture::histogram;
pub use realtime::RealTime;
pub use timing::{Distribution, Timing};
pub use wall_clock::WallClock;

/// Longest wait for an answer in lock-step. Only a stopped controller takes this long.
const ANSWER_LIMIT: Duration = Duration::from_secs(2);

/// The link, and the name of its bus.
pub(crate) struct Remote {
    link: Link,
    bus: String,
    /// Whether a controller has been found. From then on a lost link does not end the run: to the other nodes the
    /// controller has fallen silent.
    met: bool,
    /// Why the link failed.
    lost: Option<String>,
}

impl Remote {
    fn error(&self, what: impl Into<String>) -> PeerError {
        PeerError {
            who: format!("on {}", self.bus),
            what: what.into(),
        }
    }

    fn second_plant(&self, frame: &CanFrame) -> PeerError {
        self.error(format!(
            "has a second plant: {frame} was not sent by this one"
        ))
    }

    fn send(&mut self, frame: &CanFrame) {
        let limit = Instant::now() + ANSWER_LIMIT;
        while self.lost.is_none()
            && let Err(error) = self.link.transmit(frame)
        {
            if error == TransmitError::Offline || Instant::now() >= limit {
                // The link has the underlying error.
                self.wait(Duration::ZERO);
                self.lose(format!("cannot be reached: {error}"));
            } else {
                self.wait(Duration::from_millis(1));
            }
        }
    }

    /// Refuses a controller that starts while its twin moves the arm: it has died in between and lost the state of the
    /// run.
    fn refuse_restart(&self, frame: &CanFrame, twin: &Node) -> Result<(), PeerError> {
        if is_starting(frame) && twin.controller().state().is_powered() {
            return Err(self.error("restarted in the middle of the run"));
        }
        Ok(())
    }

    /// Waits for a frame; returns without one if the link is lost.
    fn wait(&mut self, timeout: Duration) {
        if self.lost.is_none()
            && let Err(error) = self.link.wait(timeout)
        {
            self.lose(format!("is out of reach: {error}"));
        }
    }

    fn lose(&mut self, why: String) {
        if self.met && self.lost.is_none() {
            say!(
                "plant-sim: the controller on {} {why}; going on without it",
                self.bus
            );
        }
        self.lost.get_or_insert(why);
    }
}

/// Whether a frame shows that its sender has just started.
fn is_starting(frame: &CanFrame) -> bool {
    let mode = match codec::decode(frame).map(|received| received.message) {
        Ok(Message::State(state)) => state.mode,
        Ok(Message::Heartbeat(_, heartbeat)) => heartbeat.state,
        _ => return false,
    };
    matches!(mode, Mode::Boot | Mode::SelfTest | Mode::PreOperational)
}
