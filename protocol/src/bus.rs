//! The interface between a node and its CAN controller. Frames are pushed into the node with the time; the node sends
//! through [`Transmit`].

use core::fmt;

use crate::frame::CanFrame;

/// The transmit side of a CAN controller. No call blocks, and none reads a clock.
pub trait Transmit {
    /// Puts a frame into the transmit queue.
    ///
    /// `Ok` means that the controller accepted the frame, not that any node received it: CAN only tells a sender that
    /// *somebody* acknowledged. Liveness is therefore always judged from frames received.
    ///
    /// # Errors
    /// The frame was not accepted and will not be sent later; see [`TransmitError`].
    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError>;
}

/// Any function that accepts frames is a transmit side.
impl<F: FnMut(&CanFrame) -> Result<(), TransmitError>> Transmit for F {
    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self(frame)
    }
}

/// A CAN controller with its queues: vcan, serial adapter or silicon.
pub trait Bus: Transmit {
    /// The oldest frame received and not yet taken, or `None`. A node's own frames are not received.
    fn receive(&mut self) -> Option<CanFrame>;
}

/// Why a frame was not accepted for transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TransmitError {
    /// Every transmit buffer is occupied: the bus is slower than its senders. The next sample may succeed.
    QueueFull,
    /// The node does not take part in the bus: bus-off (ISO 11898-1), link down or adapter closed.
    Offline,
}

impl fmt::Display for TransmitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::QueueFull => "transmit queue full",
            Self::Offline => "node is off the bus",
        })
    }
}

impl core::error::Error for TransmitError {}
