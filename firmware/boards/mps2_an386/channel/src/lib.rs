//! Protocol between the emulated board and its host, compiled into both ends.
//!
//! Two FIFOs, standard input and output of the emulator, which the board opens through Arm semihosting. At every start
//! the board reports how it ended before ([`greeting`]), the host sends the controller's configuration and how frames
//! travel ([`Setup`]), and the board answers once it is ready ([`Reply`]). Then
//!
//! - [`Channel::Fifo`]: the host sends a [`Request`] and waits for the [`Reply`], again and again, and ends by closing
//!   its end. This is the path for long comparisons: a round trip takes microseconds.
//! - [`Channel::Uart`]: frames travel as slcan lines over UART 0, as they would on silicon. An empty line acknowledges
//!   a frame, after the frames that answer it. `O` opens the bus; `C` closes it, and the board's last [`Reply`] has the
//!   number of bytes that its receiver has lost.
//!
//! A Feedback frame on its way to the board is written into a [`Request`] by `plant-sim`, read by the board's loop,
//! passed to the node, and answered by a [`Reply`] with the Command in it; over the UART it is a line that interrupts
//! put into the [`ring`]. One end is in `plant-sim` (qemu, crash, cost), the other in the images of mps2_an386.
//!
//! Every record from the host has a fixed length. Numbers are little-endian, frames in records are in the layout of
//! Linux's `struct canfd_frame`.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod frames;
mod reply;
mod request;
pub mod ring;

use core::ffi::CStr;

use firmware::control::controller::Config;
use serde::{Deserialize, Serialize};

pub use frames::{FRAME_LEN, frame_from_bytes, frame_to_bytes};
pub use reply::{
    GREETING_LEN, Measured, REPLY_FRAMES, REPLY_HEADER, Reply, greeted, greeting, is_greeting,
    reply_header,
};
pub use request::{Fault, REQUEST_LEN, Request};

/// FIFO that the host writes and the board reads. Both can be reopened after a reset.
pub const TO_BOARD: &CStr = c"/dev/stdin";
/// FIFO that the board writes and the host reads.
pub const FROM_BOARD: &CStr = c"/dev/stdout";

/// Bytes of the setup record, more than any setup takes; the rest is zero.
pub const SETUP_LEN: usize = 768;

/// How frames travel between host and board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channel {
    /// In records over the FIFOs.
    #[default]
    Fifo,
    /// As slcan over UART 0.
    Uart,
}

/// Setup that the host sends to the board first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// How frames travel.
    pub channel: Channel,
    /// Configuration of the controller.
    pub config: Config,
}

impl Setup {
    /// The record, or `None` if it does not fit.
    #[must_use]
    pub fn to_bytes(&self) -> Option<[u8; SETUP_LEN]> {
        let mut bytes = [0; SETUP_LEN];
        postcard::to_slice(self, &mut bytes).ok()?;
        Some(bytes)
    }

    /// The setup in a record, or `None` if there is none.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; SETUP_LEN]) -> Option<Self> {
        postcard::from_bytes(bytes).ok()
    }
}

/// Writes `part` at `at`; what does not fit is left out.
fn put(bytes: &mut [u8], at: usize, part: &[u8]) {
    for (place, byte) in bytes.iter_mut().skip(at).zip(part) {
        *place = *byte;
    }
}
