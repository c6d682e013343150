//! The operator's last request, which a request that is to be refused comes after.

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Motion, MotionRequest};

/// The operator's last request.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Request {
    /// Counter of its frame.
    pub(super) counter: u8,
    /// Its number.
    pub(super) sequence: u8,
}

impl Request {
    /// The request to switch on that comes next.
    pub(super) fn enable(self) -> Option<CanFrame> {
        let enable = Message::Motion(Motion {
            sequence: self.sequence.wrapping_add(1),
            request: MotionRequest::Enable,
        });
        codec::encode(&enable, self.counter.wrapping_add(1)).ok()
    }
}
