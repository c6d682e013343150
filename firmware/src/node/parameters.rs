//! Parameter requests: answered here or forwarded to the drives.

use protocol::bus::Transmit;
use protocol::e2e::Verdict;
use protocol::messages::{Message, ParameterError, ParameterReply, ParameterRequest, Server};
use protocol::parameters::{self, ControllerParameter};
use protocol::table;

use super::Node;

/// Last parameter number that is answered here.
const LAST: u16 = {
    let [.., last] = ControllerParameter::ALL else {
        panic!("the controller has parameters")
    };
    last.rule().number
};

impl Node {
    /// Answers a request of the operator or forwards it. One frame either way.
    // Out of line, like the next: rarely reached, and it would take registers from a sample.
    #[inline(never)]
    pub(super) fn parameter<B: Transmit>(
        &mut self,
        request: &ParameterRequest,
        verdict: Verdict,
        bus: &mut B,
    ) {
        let refused = |index, error| ParameterReply::Error {
            index,
            error,
            limit: 0.0,
        };
        let reply = match *request {
            ParameterRequest::Hello(peer) => {
                self.same_schema = Some(peer.schema == table::HASH);
                ParameterReply::Hello(table::HELLO)
            }
            // The first frame of an operator may be a replay: it must not change anything.
            ParameterRequest::Set { index, .. } if verdict == Verdict::Initial => {
                refused(index, ParameterError::NotNow)
            }
            ParameterRequest::Get { index } | ParameterRequest::Set { index, .. }
                if index >= parameters::DRIVES =>
            {
                return self.ask_drives(index, request, bus);
            }
            ParameterRequest::List { from } if from > LAST => {
                return self.ask_drives(from, request, bus);
            }
            _ => match parameters::serve(&mut self.controller, request) {
                Some(reply) => reply,
                None => return,
            },
        };
        self.reply_parameter(reply, bus);
    }

    /// Forwards a request; the drives answer later or never, and nothing waits for them here.
    fn ask_drives<B: Transmit>(&mut self, index: u16, request: &ParameterRequest, bus: &mut B) {
        if self.newest.is_none() {
            let silent = ParameterReply::Error {
                index,
                error: ParameterError::NotNow,
                limit: 0.0,
            };
            return self.reply_parameter(silent, bus);
        }
        self.send(&Message::ParameterRequest(Server::Drives, *request), bus);
    }

    /// Sends an answer of the drives or of this controller.
    #[inline(never)]
    pub(super) fn reply_parameter<B: Transmit>(&mut self, reply: ParameterReply, bus: &mut B) {
        self.send(&Message::ParameterReply(Server::Controller, reply), bus);
    }
}
