//! Bus traces as candump logs, one frame per line, interchangeable with can-utils in both directions.
//!
//! # Contents
//!
//! [`Reader`] and [`Writer`] turn lines into [`Record`]s and back. [`decode`] names every field of a frame, [`stats`]
//! counts rates, jitter, gaps and losses, [`convert`] writes pcapng and Vector ASC, [`dbc`] and [`dissector`] the message
//! table for other tools. All of them stream: memory does not grow with a trace. The crate depends on [`protocol`] alone;
//! anything that needs a robot or a controller (replay, check, plot) is in `plant-sim`.
//!
//! # The path of one Feedback frame
//!
//! When delivered on the bus it becomes one line through [`Writer`]; later [`Reader`] turns the line back into the same
//! frame, and [`decode`] uses the protocol's table to print counts, velocities and torques with their units.
//!
//! # The format
//!
//! ```text
//! (0000000012.345678) can0 1C0##1000102...        FD with bit rate switch
//! (0000000012.345801) can0 18FF1234#DEADBEEF      29-bit identifier
//! (0000000012.346000) can0 123#R4                 remote frame
//! (0000000012.346500) can0 20000080#0000000000000000   error frame
//! ```
//!
//! Three identifier digits are an 11-bit identifier, eight a 29-bit one or, with 0x20000000, an error frame as SocketCAN
//! reports it. `##` introduces an FD frame, its first digit holds the flags. The [`Reader`] also accepts candump's
//! screen output, Vector ASC and pcapng.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "an index or an expectation names an invariant of this crate; one that breaks is its own fault"
)]
#![forbid(unsafe_code)]

pub mod convert;
pub mod dbc;
pub mod decode;
pub mod difference;
pub mod dissector;
mod error_frame;
pub mod fields;
mod line;
mod reader;
pub mod select;
pub mod stats;
mod text;
mod writer;

use std::fmt;

use protocol::frame::CanFrame;

pub use error_frame::ErrorFrame;
pub use line::Problem;
pub use reader::{ReadError, Reader};
pub use writer::Writer;

/// Bit of an identifier that marks an error frame (SocketCAN, `CAN_ERR_FLAG`).
const ERROR_FLAG: u32 = 0x2000_0000;
/// Flag digit of an FD frame: bit rate switch (`CANFD_BRS`).
const FLAG_BRS: u8 = 0x1;
/// Flag digit of an FD frame: error state indicator (`CANFD_ESI`).
const FLAG_ESI: u8 = 0x2;
/// Flag digit of an FD frame: FD format (`CANFD_FDF`). Newer kernels set it; `##` already implies it.
const FLAG_FDF: u8 = 0x4;

/// One line of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// Time, us from an origin that the log does not give.
    pub time_us: u64,
    /// Interface.
    pub interface: Interface,
    /// Direction, if the log has it.
    pub direction: Option<Direction>,
    /// Content.
    pub entry: Entry,
}

/// Direction of a frame, as seen by the host that logged it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Received from another node.
    Received,
    /// Sent by the host itself.
    Transmitted,
}

impl Direction {
    /// `Rx` or `Tx`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Received => "Rx",
            Self::Transmitted => "Tx",
        }
    }
}

/// What a line reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// A frame that was received.
    Frame(CanFrame),
    /// A state or error reported by a controller; not a frame on the bus.
    Error(ErrorFrame),
}

/// Name of a CAN interface: 1 to 15 printable ASCII characters without blanks, as Linux has it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Interface {
    name: [u8; Self::MAX],
    len: u8,
}

impl Interface {
    /// Longest name, bytes (`IFNAMSIZ` less the terminating zero).
    pub const MAX: usize = 15;

    /// Name of the simulated bus.
    pub const CAN0: Self = Self {
        name: *b"can0\0\0\0\0\0\0\0\0\0\0\0",
        len: 4,
    };

    /// The name, or `None` if no interface can have it.
    #[must_use]
    pub fn new(name: &str) -> Option<Self> {
        Self::from_bytes(name.as_bytes())
    }

    /// Name of the interface of this number, counted from 0: `can0`.
    fn numbered(number: usize) -> Self {
        // No machine has a number too long for a name.
        Self::new(&format!("can{number}")).unwrap_or(Self::CAN0)
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.is_empty() || !bytes.iter().all(u8::is_ascii_graphic) {
            return None;
        }
        let mut name = [0; Self::MAX];
        name.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Self {
            name,
            len: bytes.len() as u8,
        })
    }

    fn as_bytes(&self) -> &[u8] {
        &self.name[..usize::from(self.len)]
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Printable ASCII by construction.
        self.as_bytes()
            .iter()
            .try_for_each(|&byte| fmt::Write::write_char(f, char::from(byte)))
    }
}

impl fmt::Debug for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// SHA-256 of a log; `Display` gives the same hex digits as `sha256sum` for the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogHash(pub [u8; 32]);

impl fmt::Display for LogHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}
