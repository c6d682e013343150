//! Serial line CAN: the ASCII protocol of Lawicel's CAN232, with the usual letters for FD.
//!
//! One line is one command or one frame, ended by a carriage return; BEL refuses. Frames are `t` and `T` (data), `r`
//! and `R` (remote), `d` and `D` (FD), `b` and `B` (FD with bit rate switch), small letters for 11-bit identifiers,
//! followed by identifier (3 or 8 hex digits), data length code (1) and data. The error state indicator has no place
//! and is lost. Hex digits are written in capitals and read in either case, as the Linux driver does. Line feeds
//! are ignored everywhere. A frame may end in a timestamp of 4 digits (ms, CAN232) or 8 (us), which is skipped.

mod text;

use core::fmt;

use crate::frame::{CLASSICAL_MAX, CanFrame, ExtendedId, FD_MAX, Id, StandardId, fd_length_of_dlc};

pub use text::Text;

/// Longest line: letter, 29-bit identifier, length code, 64 bytes, carriage return.
pub const MAX_LINE: usize = 1 + 8 + 1 + 2 * FD_MAX + 1;

/// Longest timestamp after a frame, digits.
const MAX_STAMP: usize = 8;

/// Ends every line; alone it acknowledges.
pub const CR: u8 = b'\r';
/// Refuses the line before it.
pub const BEL: u8 = 0x07;

/// Content of one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Line {
    /// Nothing: from an adapter, an acknowledgement; from a host, a way to end an unfinished line.
    Empty,
    /// Refusal (BEL).
    Refused,
    /// A frame.
    Frame(CanFrame),
    /// `O`: take part in the bus.
    Open,
    /// `L`: take part in the bus, listening only.
    Listen,
    /// `C`: leave the bus.
    Close,
    /// `S0` to `S8`: nominal bit rate; 8 is 1 Mbit/s.
    Bitrate(u8),
    /// `Y0` to `Y9`: data bit rate; 5 is 5 Mbit/s.
    DataBitrate(u8),
    /// `V`: ask for the version.
    Version,
    /// `Vhhss`: hardware and software version.
    VersionIs([u8; 2]),
    /// `N`: ask for the serial number.
    SerialNumber,
    /// `Nxxxx`: serial number, four letters or digits.
    SerialNumberIs([u8; 4]),
    /// `F`: ask for the status flags.
    Status,
    /// `Fhh`: status flags; 0 is no error.
    StatusIs(u8),
    /// `Z0` or `Z1`: received frames end in a timestamp.
    Timestamps(bool),
    /// `Mhhhhhhhh`: acceptance code, the identifiers that pass where the mask has zeros.
    AcceptanceCode(u32),
    /// `mhhhhhhhh`: acceptance mask; all ones let everything pass.
    AcceptanceMask(u32),
    /// `s` with register values or rates, in the dialect of the adapter: bit timing.
    Timing,
    /// `X0` or `X1`: received frames are sent as they arrive, without polling.
    AutoPoll(bool),
}

/// Why a line was refused. It is dropped up to its carriage return; parsing restarts at the next line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlcanError {
    /// No command begins with this byte.
    UnknownCommand(u8),
    /// The line is longer or shorter than its command and length code require.
    WrongLength,
    /// The byte at this position, counted from 0, is not a hex digit.
    NotHex {
        /// Position.
        at: usize,
    },
    /// The identifier has more than 11 or 29 bits.
    IdOutOfRange(u32),
    /// The number is greater than the command allows.
    OutOfRange(u8),
    /// The line is longer than [`MAX_LINE`] bytes and a timestamp.
    TooLong,
}

impl fmt::Display for SlcanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownCommand(byte) => write!(f, "no command begins with {byte:#04x}"),
            Self::WrongLength => f.write_str("line too long or too short for its command"),
            Self::NotHex { at } => write!(f, "not a hex digit at position {at}"),
            Self::IdOutOfRange(id) => write!(f, "identifier {id:#x} has too many bits"),
            Self::OutOfRange(digit) => {
                write!(f, "digit {digit} is greater than the command allows")
            }
            Self::TooLong => write!(f, "line of more than {} bytes", MAX_LINE + MAX_STAMP),
        }
    }
}

impl core::error::Error for SlcanError {}

/// Turns bytes into lines, one by one and in fixed memory. Any input is allowed.
#[derive(Clone, Debug)]
pub struct Parser {
    line: [u8; MAX_LINE - 1 + MAX_STAMP],
    /// Bytes of the line so far, kept or not.
    len: usize,
}

impl Default for Parser {
    fn default() -> Self {
        Self::new()
    }
}

impl Parser {
    /// Parser at the start of a line.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            line: [0; MAX_LINE - 1 + MAX_STAMP],
            len: 0,
        }
    }

    /// Takes one byte; returns the content of the line that the byte ends.
    pub fn push(&mut self, byte: u8) -> Option<Result<Line, SlcanError>> {
        match byte {
            CR => {
                let parsed = self
                    .line
                    .get(..self.len)
                    .map_or(Err(SlcanError::TooLong), parse);
                self.len = 0;
                Some(parsed)
            }
            b'\n' => None,
            // A refusal is complete by itself; anything before it was not a line.
            BEL => {
                self.len = 0;
                Some(Ok(Line::Refused))
            }
            _ => {
                if let Some(place) = self.line.get_mut(self.len) {
                    *place = byte;
                }
                self.len = self.len.saturating_add(1);
                None
            }
        }
    }
}

/// Reads a line without its end.
fn parse(line: &[u8]) -> Result<Line, SlcanError> {
    let Some((&command, rest)) = line.split_first() else {
        return Ok(Line::Empty);
    };
    match command {
        b't' | b'T' | b'r' | b'R' | b'd' | b'D' | b'b' | b'B' => {
            frame(command, rest).map(Line::Frame)
        }
        b'O' => bare(rest, Line::Open),
        b'L' => bare(rest, Line::Listen),
        b'C' => bare(rest, Line::Close),
        // The answer of some adapters to a frame that they have sent.
        b'z' | b'Z' if rest.is_empty() => Ok(Line::Empty),
        b'Z' => digit(rest, 1).map(|on| Line::Timestamps(on == 1)),
        b'X' => digit(rest, 1).map(|on| Line::AutoPoll(on == 1)),
        b'M' => exactly::<8>(rest).map(Line::AcceptanceCode),
        b'm' => exactly::<8>(rest).map(Line::AcceptanceMask),
        b's' if !rest.is_empty() => Ok(Line::Timing),
        b'N' if rest.is_empty() => Ok(Line::SerialNumber),
        b'N' => match rest.first_chunk::<4>() {
            Some(letters) if rest.len() == 4 => Ok(Line::SerialNumberIs(*letters)),
            _ => Err(SlcanError::WrongLength),
        },
        b'F' if rest.is_empty() => Ok(Line::Status),
        b'F' => exactly::<2>(rest).map(|flags| Line::StatusIs(flags as u8)),
        b'S' => digit(rest, 8).map(Line::Bitrate),
        b'Y' => digit(rest, 9).map(Line::DataBitrate),
        b'V' if rest.is_empty() => Ok(Line::Version),
        b'V' => {
            exactly::<4>(rest).map(|version| Line::VersionIs([(version >> 8) as u8, version as u8]))
        }
        _ => Err(SlcanError::UnknownCommand(command)),
    }
}

fn bare(rest: &[u8], line: Line) -> Result<Line, SlcanError> {
    if rest.is_empty() {
        Ok(line)
    } else {
        Err(SlcanError::WrongLength)
    }
}

fn digit(rest: &[u8], max: u8) -> Result<u8, SlcanError> {
    let &[digit] = rest else {
        return Err(SlcanError::WrongLength);
    };
    let value = nibble(digit, 1)?;
    if value <= max {
        Ok(value)
    } else {
        Err(SlcanError::OutOfRange(value))
    }
}

/// Number of exactly `N` hex digits, at most 8, after the letter of the command.
fn exactly<const N: usize>(rest: &[u8]) -> Result<u32, SlcanError> {
    if rest.len() == N {
        number(rest, 1)
    } else {
        Err(SlcanError::WrongLength)
    }
}

fn frame(command: u8, rest: &[u8]) -> Result<CanFrame, SlcanError> {
    let extended = command.is_ascii_uppercase();
    let id_digits = if extended { 8 } else { 3 };
    let (id, rest) = rest
        .split_at_checked(id_digits)
        .ok_or(SlcanError::WrongLength)?;
    let (&dlc, data) = rest.split_first().ok_or(SlcanError::WrongLength)?;
    let raw = number(id, 1)?;
    let id = if extended {
        ExtendedId::new(raw).map(Id::Extended)
    } else {
        u16::try_from(raw)
            .ok()
            .and_then(StandardId::new)
            .map(Id::Standard)
    }
    .ok_or(SlcanError::IdOutOfRange(raw))?;
    let dlc_at = 1 + id_digits;
    let dlc = nibble(dlc, dlc_at)?;
    let fd = matches!(command.to_ascii_lowercase(), b'd' | b'b');
    if !fd && usize::from(dlc) > CLASSICAL_MAX {
        return Err(SlcanError::OutOfRange(dlc));
    }
    let remote = command.eq_ignore_ascii_case(&b'r');
    let len = if remote {
        0
    } else {
        fd_length_of_dlc(dlc).unwrap_or(0)
    };
    let (data, stamp) = data
        .split_at_checked(2 * len)
        .ok_or(SlcanError::WrongLength)?;
    if !matches!(stamp.len(), 0 | 4 | MAX_STAMP) {
        return Err(SlcanError::WrongLength);
    }
    number(stamp, dlc_at + 1 + 2 * len)?;
    let mut bytes = [0; FD_MAX];
    for (k, (byte, &[high, low])) in bytes.iter_mut().zip(data.as_chunks().0).enumerate() {
        let at = dlc_at + 1 + 2 * k;
        *byte = nibble(high, at)? << 4 | nibble(low, at + 1)?;
    }
    let bytes = bytes.get(..len).unwrap_or_default();
    if remote {
        CanFrame::remote(id, usize::from(dlc))
    } else if fd {
        CanFrame::fd(id, bytes, command.eq_ignore_ascii_case(&b'b'))
    } else {
        CanFrame::classical(id, bytes)
    }
    .ok_or(SlcanError::WrongLength)
}

/// Number of at most 8 hex digits, the first being at this position in the line.
fn number(digits: &[u8], at: usize) -> Result<u32, SlcanError> {
    digits
        .iter()
        .enumerate()
        .try_fold(0, |number, (k, &digit)| {
            Ok(number << 4 | u32::from(nibble(digit, at + k)?))
        })
}

fn nibble(digit: u8, at: usize) -> Result<u8, SlcanError> {
    match digit {
        b'0'..=b'9' => Ok(digit - b'0'),
        b'a'..=b'f' => Ok(digit - b'a' + 10),
        b'A'..=b'F' => Ok(digit - b'A' + 10),
        _ => Err(SlcanError::NotHex { at }),
    }
}
