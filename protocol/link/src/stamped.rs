//! What comes over a bus, with its time of arrival.

use std::time::SystemTime;

use protocol::frame::CanFrame;

/// A frame and its time of arrival.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamped {
    /// The frame.
    pub frame: CanFrame,
    /// When the kernel (SocketCAN) or this process (serial line) received it.
    pub at: SystemTime,
}

/// What came over a bus, and when; error frames included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// What.
    pub event: Event,
    /// As in [`Stamped`].
    pub at: SystemTime,
}

/// What can come over a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame.
    Frame(CanFrame),
    /// A report of the CAN controller, by the classes and details of `linux/can/error.h`.
    Error {
        /// Classes of errors, one bit each.
        class: u32,
        /// Details.
        data: [u8; 8],
    },
}

impl From<Stamped> for Arrival {
    fn from(Stamped { frame, at }: Stamped) -> Self {
        Self {
            event: Event::Frame(frame),
            at,
        }
    }
}
