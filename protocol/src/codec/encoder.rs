//! The sending side of a node: its counters.

use super::{EncodeError, encode_with};
use crate::e2e::Sender;
use crate::frame::CanFrame;
use crate::messages::{Message, Server};

/// Makes the frames of one node, with a counter per identifier.
#[derive(Clone, Debug, Default)]
pub struct Encoder {
    feedback: Sender,
    command: Sender,
    motion: Sender,
    state: Sender,
    motion_reply: Sender,
    parameter_reply: Sender,
    to_drives: Sender,
    to_controller: Sender,
    heartbeat: Sender,
}

impl Encoder {
    /// Frame of the node's next message.
    ///
    /// # Errors
    /// Those of [`encode`](super::encode).
    pub fn encode(&mut self, message: &Message) -> Result<CanFrame, EncodeError> {
        self.encode_with(message, |frame| *frame)
    }

    /// Like [`Encoder::encode`], for a sender that only needs to look at the frame, see
    /// [`encode_with`](super::encode_with).
    ///
    /// # Errors
    /// Those of [`encode`](super::encode); `look` is not called then.
    pub fn encode_with<T>(
        &mut self,
        message: &Message,
        look: impl FnOnce(&CanFrame) -> T,
    ) -> Result<T, EncodeError> {
        let sender = match message {
            // These carry no counter of the encoder.
            Message::Nmt(_) | Message::EStop(_) | Message::Emergency(..) => &mut Sender::default(),
            Message::Feedback(_) => &mut self.feedback,
            Message::Command(_) => &mut self.command,
            Message::Motion(_) => &mut self.motion,
            Message::State(_) => &mut self.state,
            Message::MotionReply(_) => &mut self.motion_reply,
            Message::ParameterReply(..) => &mut self.parameter_reply,
            Message::ParameterRequest(Server::Drives, _) => &mut self.to_drives,
            Message::ParameterRequest(Server::Controller, _) => &mut self.to_controller,
            Message::Heartbeat(..) => &mut self.heartbeat,
        };
        encode_with(message, sender.next(), look)
    }
}
