//! A frame with its time of arrival.

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
