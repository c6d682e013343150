//! What the operator hears of the controller, and what it makes of it: which frames are news, and when the run is over.

use protocol::codec::{self, DecodeError};
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Heartbeat, Message, Mode, Node, ParameterReply, Server, State};
use protocol::schema::Content;
use protocol::table;
use protocol::time::{Duration, Instant};

use super::Operator;
use crate::world::{OperatorError, Unused};

/// Time without a new state after which the controller counts as silent: fifty states.
pub(super) const SILENCE_LIMIT: Duration = Duration::from_secs(1);

impl Operator {
    /// Takes a frame that has just arrived.
    ///
    /// The state is the one sign of life: without it the operator does not know where the arm is, whatever else arrives. One that is
    /// not valid or not new is none, and no news either: a frame that hangs in a mailbox, is sent again, or comes from another node.
    pub(super) fn receive(&mut self, now: Instant, frame: &CanFrame) {
        let Some(info) = table::of_frame(frame) else {
            return;
        };
        let decoded = codec::decode(frame);
        // No node receives its own frames.
        self.is_imitated |= info.content == Content::Motion && decoded.is_ok();
        // Commands do not concern an operator.
        if info.sender != Some(Node::Controller) || info.content == Content::Command {
            return;
        }
        let received = match decoded {
            Ok(received) => received,
            Err(error) => return self.refuse(info.content, Some(error)),
        };
        match received.message {
            Message::State(state) => {
                let verdict = self.states.check(received.counter.unwrap_or(0));
                if verdict.is_new() {
                    self.heard = now;
                    self.refused_states = Unused::default();
                    self.state = Some(state);
                } else {
                    self.refuse(info.content, None);
                }
            }
            // A controller that starts anew begins its counters anew, and says at once that it is not operational. Its first state has
            // been taken for an old one.
            Message::Heartbeat(_, Heartbeat { state: mode, .. }) if is_starting(mode) => {
                self.states.reset();
                self.state = self.state.map(|state| State { mode, ..state });
            }
            // An answer is known by the number of its request.
            Message::MotionReply(reply) if reply.sequence == self.awaited => {
                self.reply = Some(reply.outcome);
            }
            Message::ParameterReply(Server::Controller, ParameterReply::Hello(hello)) => {
                self.greeted = Some(hello);
            }
            Message::Emergency(_, emergency) => self.alarmed = emergency.cause != Cause::None,
            _ => {}
        }
    }

    fn refuse(&mut self, content: Content, why: Option<DecodeError>) {
        let refused = match content {
            Content::State => &mut self.refused_states,
            Content::MotionReply => &mut self.refused_replies,
            _ => return,
        };
        let frames = refused.frames.saturating_add(1);
        *refused = Unused { frames, why };
    }

    /// Ends the run if the controller has stopped by itself or gone silent.
    pub(super) fn watch(&self, now: Instant) -> Result<(), OperatorError> {
        if let Some(state) = self.state
            && matches!(state.mode, Mode::FaultReaction | Mode::Fault | Mode::EStop)
        {
            return Err(OperatorError::Stopped {
                mode: state.mode,
                fault: state.fault(),
            });
        }
        // In a cycle the axes are under torque, and a controller that has just started knows nothing of that.
        if self.current.is_some_and(|task| task.spot.is_some())
            && let Some(state) = self.state
            && (is_starting(state.mode) || state.mode == Mode::Ready)
        {
            return Err(OperatorError::Restarted { mode: state.mode });
        }
        if now.since(self.heard) > SILENCE_LIMIT {
            let (since, refused) = (self.heard, self.refused_states);
            return Err(match refused.frames {
                0 => OperatorError::Silent { since },
                _ => OperatorError::Unusable { since, refused },
            });
        }
        Ok(())
    }
}

/// Whether a controller in this state has only just started, or lost its peers.
fn is_starting(mode: Mode) -> bool {
    matches!(mode, Mode::Boot | Mode::SelfTest | Mode::PreOperational)
}
