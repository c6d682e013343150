//! Lock-step: the plant waits for each answer.

use std::{iter, time};

use firmware::control::controller::Config;
use link::LinkAddress;
use protocol::bus::Bus as _;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Message, Node as Name};
use protocol::table;
use protocol::time::Instant;
use sim::controller::COMPUTE;
use sim::peer::{Outbox, Peer, PeerError};
use sim::world::World;

use super::peers::{self, sender};
use super::{ANSWER_LIMIT, Remote};
use crate::say;
use crate::twin::Twin;

/// A controller behind a link, in lock-step with the rig.
pub struct LockStep {
    remote: Remote,
    twin: Twin,
    /// Whether the first command has arrived: earlier frames may be from the time before the restart.
    begun: bool,
    /// Whether the twin still has the same input as the controller.
    follows: bool,
    /// Whether the controller has let a whole [`ANSWER_LIMIT`] pass.
    late: bool,
    period: time::Duration,
    /// Frames sent by the controller; empty between calls.
    sent: Vec<CanFrame>,
}

impl LockStep {
    /// Waits for a controller on the bus and resets it.
    ///
    /// # Errors
    /// The bus cannot be used, another plant is on it, or no controller answers within a minute.
    pub fn connect(address: &LinkAddress, config: Config) -> Result<Self, PeerError> {
        Ok(Self {
            remote: peers::meet(address)?,
            twin: Twin::new(config),
            begun: false,
            follows: true,
            late: false,
            period: config.period.duration().into(),
            sent: Vec::new(),
        })
    }

    /// Takes the frames that have arrived; those of the controller are compared and passed on.
    fn take(&mut self, now: Instant) -> Result<(), PeerError> {
        while let Some(frame) = self.remote.link.receive() {
            // Before what the controller makes of it.
            self.hear_of_bus_off(now);
            match sender(&frame) {
                Some(Name::Controller) => self.answer(&frame)?,
                Some(Name::Drives | Name::Operator) => {
                    return Err(self.remote.second_plant(&frame));
                }
                // Another node has sent a frame, such as an emergency stop or a parameter request, and only the
                // controller knows when it received it. The twin receives it as well, so that what is judged by its reference
                // stays right to a sample.
                None => {
                    self.follows = false;
                    self.twin.call(now, Some(&frame));
                    // Of what the controller has yet to send, only the command is sure to come.
                    let due = self.twin.due();
                    due.retain(|frame| table::COMMAND.identifies(frame));
                }
            }
        }
        self.hear_of_bus_off(now);
        Ok(())
    }

    /// The controller hears the same of the interface, and only it knows when. The interface recovers as it is set up.
    fn hear_of_bus_off(&mut self, now: Instant) {
        if self.remote.link.take_bus_off() {
            self.follows = false;
            self.twin.bus_off(now);
        }
    }

    fn answer(&mut self, frame: &CanFrame) -> Result<(), PeerError> {
        let command = table::COMMAND.identifies(frame);
        if !self.begun && !command {
            return Ok(());
        }
        self.begun = true;
        self.remote.refuse_restart(frame, self.twin.node())?;
        if self.follows {
            if let Err(difference) = self.twin.compare(frame) {
                // What it says of the plant may come behind its answer to a request.
                let link = &mut self.remote.link;
                let mut rest = iter::once(*frame).chain(iter::from_fn(|| link.receive()));
                if rest.any(|frame| misses_a_peer(&frame)) {
                    return Err(self.remote.error(format!(
                        "has missed the plant {}, and says peer-silent: this process has stood still meanwhile, stopped or on a \
                         computer with too much to do, and the time of a controller in another one goes on",
                        self.place()
                    )));
                }
                return Err(self.remote.error(format!(
                    "differs from its twin in this process {}: {difference}. Both must be built from the same source and \
                     have the same robot (--model) and rate (--rate); a controller in real time needs a plant in real \
                     time (--real-time)",
                    self.place()
                )));
            }
        } else if command {
            self.twin.due().clear();
        }
        self.sent.push(*frame);
        Ok(())
    }

    fn place(&self) -> String {
        let ms = self.twin.controller().now().millis();
        format!("at {}.{:03} s", ms / 1000, ms % 1000)
    }

    /// Frames of a starting controller cannot be distinguished from earlier ones, so the twin's are used.
    fn start(&mut self, now: Instant) {
        self.twin.call(now, None);
        self.sent.extend(self.twin.due().drain(..));
    }

    /// Sends a frame and waits for all answers of the twin.
    fn exchange(&mut self, now: Instant, frame: &CanFrame) -> Result<(), PeerError> {
        self.twin.call(now, Some(frame));
        self.remote.send(frame);
        // Feedback is always answered by a command; other answers are only known while the twin follows.
        let commanded = table::FEEDBACK.identifies(frame) && !self.late;
        let patience = if self.follows || commanded {
            ANSWER_LIMIT
        } else {
            self.period
        };
        let limit = time::Instant::now() + patience;
        self.take(now)?;
        while !self.twin.due().is_empty() {
            let left = limit.saturating_duration_since(time::Instant::now());
            if left.is_zero() || self.remote.lost.is_some() {
                if self.follows && self.remote.lost.is_none() {
                    say!(
                        "plant-sim: the controller on {} is late {}: no answer to {frame} within {} s; going on",
                        self.remote.bus,
                        self.place(),
                        ANSWER_LIMIT.as_secs()
                    );
                }
                self.late |= patience == ANSWER_LIMIT;
                self.follows = false;
                self.twin.due().clear();
                break;
            }
            self.remote.wait(left);
            self.take(now)?;
        }
        Ok(())
    }
}

impl Peer for LockStep {
    fn wake(&self) -> Option<Instant> {
        // Between samples the link gives no indication of the time.
        self.twin.controller().is_new().then_some(Instant::ORIGIN)
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        match received {
            None => self.start(now),
            Some(frame) => self.exchange(now, frame)?,
        }
        out.extend(self.sent.drain(..).map(|frame| (now + COMPUTE, frame)));
        world.mind = self.twin.controller().mind();
        Ok(())
    }
}

/// Whether a controller says in this frame that it has not heard the drives for too long.
fn misses_a_peer(frame: &CanFrame) -> bool {
    let cause = match codec::decode(frame).map(|received| received.message) {
        Ok(Message::Emergency(_, emergency)) => emergency.cause,
        Ok(Message::Heartbeat(_, heartbeat)) => heartbeat.cause,
        Ok(Message::State(state)) => state.cause,
        _ => return false,
    };
    cause == Cause::PeerSilent
}

#[cfg(test)]
mod tests {
    use protocol::messages::{Emergency, Heartbeat, Mode, ResetReason};

    use super::*;

    /// A plant that has stood still is not told as one of another source.
    #[test]
    fn a_controller_that_missed_the_plant_says_so() {
        let heartbeat = |cause| {
            let heartbeat = Heartbeat {
                state: Mode::Fault,
                cause,
                reset: ResetReason::PowerOn,
            };
            Message::Heartbeat(Name::Controller, heartbeat)
        };
        let emergency = Emergency::new(Cause::PeerSilent, 0);
        for (message, expected) in [
            (heartbeat(Cause::PeerSilent), true),
            (Message::Emergency(Name::Controller, emergency), true),
            (heartbeat(Cause::Chatter), false),
        ] {
            let frame = codec::encode(&message, 0).unwrap();
            assert_eq!(misses_a_peer(&frame), expected, "{message:?}");
        }
    }
}
