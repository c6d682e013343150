//! A controller in another process or on a board, reached over a CAN link.
//!
//! The rig keeps its bit-timed bus: what that delivers to the controller goes out on the link, what the controller
//! answers comes back and is put onto the bit-timed bus. Every frame of the run is therefore on the link for anybody to
//! see, and the results are timed as on a wire even where the link is a virtual one.
//!
//! - *Lock-step*: the plant waits for the answer. The controller counts time in samples
//!   ([`SampleClock`]), so a twin of it in this process, fed with the same frames,
//!   must send the same frames; each is compared byte for byte.
//! - *Real time*: samples are taken at absolute deadlines of the machine's clock. A command that is late acts late.

mod compare;
mod measure;
mod peers;
mod picture;
mod realtime;
mod timing;
mod watch;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use firmware::cabinet::sample_clock::SampleClock;
use firmware::control::controller::Config;
use firmware::node::Node;
use link::{Link, LinkAddress};
use protocol::bus::{Bus, TransmitError};
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Mode, Node as Name, ResetReason};
use protocol::table;

use sim::endpoint::{Endpoint, EndpointError};

pub use compare::first_difference;
pub use measure::measure;
use peers::sender;
pub use picture::histogram;
pub use realtime::RealTime;
pub use timing::{Distribution, Timing};
pub use watch::Watched;

/// Longest wait for an answer in lock-step. Only a controller that has stopped needs this long.
const ANSWER_LIMIT: Duration = Duration::from_secs(2);

/// A controller behind a link, in lock-step with the rig.
pub struct LockStep {
    remote: Remote,
    twin: Node,
    clock: SampleClock,
    /// What the twin has sent and the controller has not yet.
    expected: VecDeque<CanFrame>,
    /// Whether the first command has come: what a controller says before it belongs to its past.
    begun: bool,
    /// Whether the twin still knows all that the controller knows.
    follows: bool,
    period: Duration,
}

/// The link and the name of who is at its other end.
pub(crate) struct Remote {
    link: Link,
    bus: String,
}

impl Remote {
    fn error(&self, what: impl Into<String>) -> EndpointError {
        EndpointError {
            who: format!("on {}", self.bus),
            what: what.into(),
        }
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), EndpointError> {
        let limit = Instant::now() + ANSWER_LIMIT;
        while let Err(error) = self.link.transmit(frame) {
            if error == TransmitError::Offline || Instant::now() >= limit {
                // The link knows more than the frame that was not taken.
                self.wait(Duration::ZERO)?;
                return Err(self.error(format!("cannot be reached: {error}")));
            }
            self.wait(Duration::from_millis(1))?;
        }
        Ok(())
    }

    /// A controller that starts while its twin moves the arm has died in between: nothing of the run is left in it.
    fn refuse_restart(&self, frame: &CanFrame, twin: &Node) -> Result<(), EndpointError> {
        if is_starting(frame) && twin.controller().state().is_powered() {
            return Err(self.error("has started again in the middle of the run"));
        }
        Ok(())
    }

    fn wait(&mut self, timeout: Duration) -> Result<bool, EndpointError> {
        self.link
            .wait(timeout)
            .map_err(|error| self.error(format!("is out of reach: {error}")))
    }
}

impl LockStep {
    /// Waits for a controller on the bus and makes it start afresh.
    ///
    /// # Errors
    /// The bus cannot be used, another plant is on it, or no controller answers within a minute.
    pub fn connect(address: &LinkAddress, config: Config) -> Result<Self, EndpointError> {
        let remote = peers::meet(address)?;
        let period_ns = (f64::from(config.period) * 1e9).round() as u64;
        let mut twin = twin(&config);
        twin.poll(0, &mut Sent(None, &mut VecDeque::new()));
        Ok(Self {
            remote,
            twin,
            clock: SampleClock::new(period_ns),
            expected: VecDeque::new(),
            begun: false,
            follows: true,
            period: Duration::from_nanos(period_ns),
        })
    }

    /// Takes what has come; the controller's frames are compared and handed on.
    fn take(&mut self, sent: &mut Vec<CanFrame>) -> Result<(), EndpointError> {
        while let Some(frame) = self.remote.link.receive() {
            match sender(&frame) {
                Some(Name::Controller) => self.answer(&frame, sent)?,
                Some(Name::Drives | Name::Operator) => {
                    return Err(self.remote.error(format!(
                        "has a second plant: {frame} was not sent by this one"
                    )));
                }
                // Somebody else has spoken, an emergency stop perhaps, and only the controller knows when it heard it.
                None => self.follows = false,
            }
        }
        Ok(())
    }

    fn answer(&mut self, frame: &CanFrame, sent: &mut Vec<CanFrame>) -> Result<(), EndpointError> {
        let command = table::COMMAND.identifies(frame);
        if !self.begun && !command {
            return Ok(());
        }
        self.begun = true;
        self.remote.refuse_restart(frame, &self.twin)?;
        if self.follows {
            let expected = self.expected.pop_front();
            if expected != Some(*frame) {
                let difference = first_difference(expected.as_ref(), frame);
                return Err(self.remote.error(format!(
                    "differs from its twin in this process {}: {difference}. Both must be built from one source and \
                     told one robot (--model); a controller in real time needs a plant in real time (--real-time)",
                    self.place()
                )));
            }
        } else if command {
            self.expected.clear();
        }
        sent.push(*frame);
        Ok(())
    }

    fn place(&self) -> String {
        let ms = self.clock.now() / 1000;
        format!("at {}.{:03} s", ms / 1000, ms % 1000)
    }
}

impl Endpoint for LockStep {
    fn poll(
        &mut self,
        _now: u64,
        received: Option<&CanFrame>,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError> {
        // Without a frame there is nothing that a link could tell the controller.
        let Some(frame) = received else {
            return Ok(());
        };
        self.clock.observe(frame);
        self.twin.poll(
            self.clock.now(),
            &mut Sent(Some(*frame), &mut self.expected),
        );
        self.remote.send(frame)?;
        let patience = if self.follows {
            ANSWER_LIMIT
        } else {
            self.period
        };
        let limit = Instant::now() + patience;
        self.take(sent)?;
        while !self.expected.is_empty() {
            let left = limit.saturating_duration_since(Instant::now());
            if left.is_zero() {
                if self.follows {
                    eprintln!(
                        "plant-sim: the controller on {} is late {}: no answer to {frame} within {} s; going on",
                        self.remote.bus,
                        self.place(),
                        ANSWER_LIMIT.as_secs()
                    );
                    self.follows = false;
                }
                self.expected.clear();
                break;
            }
            self.remote.wait(left)?;
            self.take(sent)?;
        }
        Ok(())
    }

    fn node(&self) -> &Node {
        &self.twin
    }
}

/// The same controller in this process, started by network management. The time that a command
/// takes is what a controller on a real bus assumes, not what the rig knows.
pub(crate) fn twin(config: &Config) -> Node {
    Node::new(
        Config::new(config.arm, config.period),
        ResetReason::Software,
    )
}

/// Whether a frame says that its sender has just started.
fn is_starting(frame: &CanFrame) -> bool {
    let mode = match codec::decode(frame).map(|received| received.message) {
        Ok(Message::State(state)) => state.mode,
        Ok(Message::Heartbeat(_, heartbeat)) => heartbeat.state,
        _ => return false,
    };
    matches!(mode, Mode::Boot | Mode::SelfTest | Mode::PreOperational)
}

/// The twin's bus: one frame in, everything out kept.
pub(crate) struct Sent<'a>(pub Option<CanFrame>, pub &'a mut VecDeque<CanFrame>);

impl Bus for Sent<'_> {
    fn receive(&mut self) -> Option<CanFrame> {
        self.0.take()
    }

    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self.1.push_back(*frame);
        Ok(())
    }
}
