//! Grammar of one line of a log.

use protocol::frame::{CLASSICAL_MAX, CanFrame, ExtendedId, FD_MAX, Id, StandardId, fd_length};

use super::{
    Direction, ERROR_FLAG, Entry, ErrorFrame, FLAG_BRS, FLAG_ESI, FLAG_FDF, Interface, Record,
};

/// Longest line without its line feed, bytes. The longest valid one, an FD frame in ASC or on a screen, has fewer than
/// 500.
pub(super) const MAX_LINE: usize = 1024;

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// Longer than any line of a log.
    #[error("longer than {MAX_LINE} bytes, the longest line of a log")]
    TooLong,
    /// Several lines that only carriage returns separate.
    #[error("lines end with a carriage return alone; convert it: tr '\\r' '\\n' < FILE")]
    CarriageReturn,
    /// The file ends within the line.
    #[error("the log was cut off within this frame")]
    Unterminated,
    /// The capture itself lost frames here.
    #[error("candump reports that it dropped frames here")]
    Dropped,
    /// No timestamp in parentheses, or not one number with a point.
    #[error(
        "no timestamp at the start; (seconds.microseconds) is allowed, such as (0000000012.345678)"
    )]
    Timestamp,
    /// Wrong number of decimals.
    #[error("timestamp has {0} decimals; 1 to 9 are allowed")]
    Decimals(usize),
    /// Screen output with unknown time origin.
    #[error(
        "candump's output for the screen with times other than seconds since 1970: a date lacks its time zone, and other times their start; record with candump -L (or candump -t a)"
    )]
    Screen,
    /// CAN XL frame.
    #[error("CAN XL frames are not supported; classical CAN and CAN FD are")]
    CanXl,
    /// Classical frame with a length code above 8.
    #[error(
        "length code {0:X} above 8 of a classical frame is not supported; record without candump -8"
    )]
    LengthCode(u8),
    /// Line of an ASC file that begins like a frame but is not one.
    #[error("{0}; not a frame of Vector ASC")]
    Asc(&'static str),
    /// Packet of a pcapng file that is not a CAN frame.
    #[error("{0}")]
    Packet(&'static str),
    /// More microseconds than fit in 64 bits.
    #[error("timestamp does not fit 64 bits of us; {} seconds are allowed", u64::MAX / 1_000_000 - 1)]
    TimestampRange,
    /// No interface name, or a wrong one.
    #[error(
        "no interface name of 1 to {} printable ASCII characters after the timestamp",
        Interface::MAX
    )]
    Interface,
    /// No `#`.
    #[error("no '#' between identifier and data")]
    Separator,
    /// Wrong number of identifier digits.
    #[error("identifier has {0} digits; 3 (standard) or 8 (extended, error frame) are allowed")]
    IdDigits(usize),
    /// Identifier out of range.
    #[error("identifier {id:X} is above {max:X}")]
    IdRange {
        /// The identifier.
        id: u32,
        /// Highest of its kind; of an error frame with the error flag.
        max: u32,
    },
    /// Not a hexadecimal digit.
    #[error("column {column}: {found:?} where a hexadecimal digit is expected")]
    Hex {
        /// Byte of the line, counted from 1.
        column: usize,
        /// What was found.
        found: char,
    },
    /// Half a byte at the end.
    #[error("odd number of data digits; a byte has two")]
    OddDigits,
    /// Length that no frame of this kind has.
    #[error("{found} data bytes; {allowed} are allowed")]
    Length {
        /// Data bytes on the line.
        found: usize,
        /// What is allowed for this kind.
        allowed: &'static str,
    },
    /// Remote frame with more than a length.
    #[error("remote frame with something after R; nothing or one digit 0 to 8 is allowed")]
    Remote,
    /// FD flags that do not exist.
    #[error("FD flags {0:X}; the sum of 1 (BRS), 2 (ESI) and 4 (FDF) is allowed")]
    Flags(u8),
    /// FD frame without flags.
    #[error("FD frame without flags; one hexadecimal digit is expected after ##")]
    NoFlags,
    /// Something after the frame.
    #[error("text after the frame; nothing, R (received) or T (transmitted) is allowed")]
    Trailing,
}

/// Parses one line without its end.
pub(super) fn parse(line: &[u8]) -> Result<Record, Problem> {
    if line.starts_with(b"DROPCOUNT:") {
        return Err(Problem::Dropped);
    }
    let rest = line.strip_prefix(b"(").ok_or(Problem::Timestamp)?;
    let (stamp, rest) = split_at_byte(rest, b')').ok_or(Problem::Timestamp)?;
    let time_us = timestamp(stamp)?;

    // candump aligns names of several interfaces with blanks.
    let (b"", rest) = split_at_blanks(rest).ok_or(Problem::Interface)? else {
        return Err(Problem::Interface);
    };
    let (name, rest) = split_at_blanks(rest).ok_or(Problem::Interface)?;
    let interface = Interface::from_bytes(name).ok_or(Problem::Interface)?;

    let column = line.len() - rest.len() + 1;
    let rest = rest.trim_ascii_end();
    let text = |bytes| Text { bytes, column };
    let (entry, direction) = match entry(text(rest)) {
        Ok(entry) => (entry, b"".as_slice()),
        // Something is behind the frame, or it is wrong. To look for a blank in every line would take as long as to read it.
        Err(problem) => {
            let (frame, direction) = split_at_blanks(rest).ok_or(problem)?;
            (entry(text(frame))?, direction)
        }
    };
    let direction = match direction {
        b"" => None,
        b"R" => Some(Direction::Received),
        b"T" => Some(Direction::Transmitted),
        _ => return Err(Problem::Trailing),
    };
    Ok(Record {
        time_us,
        interface,
        direction,
        entry,
    })
}

/// What is before the first blanks and what is after them.
fn split_at_blanks(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let at = text.iter().position(u8::is_ascii_whitespace)?;
    let (before, after) = text.split_at(at);
    Some((before, after.trim_ascii_start()))
}

/// Microseconds of `seconds.decimals`; finer digits are cut off.
pub(super) fn timestamp(text: &[u8]) -> Result<u64, Problem> {
    let (seconds, decimals) = split_at_byte(text, b'.').ok_or(Problem::Timestamp)?;
    let (Some(whole), Some(_)) = (number(seconds), number(decimals)) else {
        return Err(Problem::Timestamp);
    };
    if seconds.is_empty() {
        return Err(Problem::Timestamp);
    }
    if !(1..=9).contains(&decimals.len()) {
        return Err(Problem::Decimals(decimals.len()));
    }
    let decimals = &decimals[..decimals.len().min(6)];
    let part = number(decimals).unwrap_or(0) * 10_u64.pow(6 - decimals.len() as u32);
    (whole.checked_mul(1_000_000))
        .and_then(|whole| whole.checked_add(part))
        .ok_or(Problem::TimestampRange)
}

/// The number of these digits, or the greatest if it is beyond; `None` if anything else is among them.
fn number(digits: &[u8]) -> Option<u64> {
    digits.iter().try_fold(0_u64, |value, digit| {
        let digit = digit.wrapping_sub(b'0');
        (digit <= 9).then(|| value.saturating_mul(10).saturating_add(digit.into()))
    })
}

/// Value of each hexadecimal digit; more than 15 of any other byte.
const DIGITS: [u8; 256] = {
    let mut digits = [0xFF; 256];
    let mut byte = 0;
    while byte < 256 {
        if let Some(digit) = (byte as u8 as char).to_digit(16) {
            digits[byte] = digit as u8;
        }
        byte += 1;
    }
    digits
};

/// Part of a line that knows its position.
#[derive(Clone, Copy)]
struct Text<'a> {
    bytes: &'a [u8],
    /// Column of the first byte, counted from 1.
    column: usize,
}

impl<'a> Text<'a> {
    /// The first `count` bytes and what follows; `count` is at most the length.
    fn split(self, count: usize) -> (Self, Self) {
        let (head, tail) = self.bytes.split_at(count);
        let at = |bytes, column| Self { bytes, column };
        (at(head, self.column), at(tail, self.column + count))
    }

    fn after(self, prefix: u8) -> Option<Self> {
        (self.bytes.first() == Some(&prefix)).then(|| self.split(1).1)
    }

    /// Value of the hexadecimal digits; at most eight.
    fn number(self) -> Result<u32, Problem> {
        let mut value = 0;
        for (offset, &byte) in self.bytes.iter().enumerate() {
            let found = char::from(byte);
            let column = self.column + offset;
            let digit = found.to_digit(16).ok_or(Problem::Hex { column, found })?;
            value = value << 4 | digit;
        }
        Ok(value)
    }

    /// Data bytes into `buffer`, and how many of them.
    fn data(self, buffer: &'a mut [u8], allowed: &'static str) -> Result<&'a [u8], Problem> {
        let (pairs, odd) = self.bytes.as_chunks::<2>();
        let mut all = 0;
        for (byte, [high, low]) in buffer.iter_mut().zip(pairs) {
            let (high, low) = (DIGITS[usize::from(*high)], DIGITS[usize::from(*low)]);
            all |= high | low;
            *byte = high << 4 | low;
        }
        let found = pairs.len();
        if all > 0xF || found > buffer.len() || !odd.is_empty() {
            return Err(self.wrong(Problem::Length { found, allowed }));
        }
        Ok(&buffer[..found])
    }

    /// What is wrong with these digits, the first of it first; `otherwise` if that is not the digits.
    #[cold]
    fn wrong(self, otherwise: Problem) -> Problem {
        for (offset, &byte) in self.bytes.iter().enumerate() {
            if DIGITS[usize::from(byte)] > 0xF {
                return Problem::Hex {
                    column: self.column + offset,
                    found: char::from(byte),
                };
            }
        }
        if self.bytes.len().is_multiple_of(2) {
            otherwise
        } else {
            Problem::OddDigits
        }
    }
}

const CLASSICAL_LENGTHS: &str = "0 to 8";
const FD_LENGTHS: &str = "0 to 8, 12, 16, 20, 24, 32, 48 or 64";

fn entry(text: Text<'_>) -> Result<Entry, Problem> {
    let digits = text
        .bytes
        .iter()
        .position(|&byte| byte == b'#')
        .ok_or(Problem::Separator)?;
    let (id, rest) = text.split(digits);
    let rest = rest.split(1).1;
    // Priority and virtual network, then flags, type and acceptance field with colons between.
    if rest.bytes.get(2) == Some(&b':') {
        return Err(Problem::CanXl);
    }
    if digits == 8 {
        let raw = id.number()?;
        if raw & !(ERROR_FLAG - 1) == ERROR_FLAG {
            return error_frame(raw, rest).map(Entry::Error);
        }
    }
    let id = identifier(id)?;
    if let Some(fd) = rest.after(b'#') {
        return fd_frame(id, fd).map(Entry::Frame);
    }
    if let Some(length) = rest.after(b'R').or_else(|| rest.after(b'r')) {
        return remote_frame(id, length).map(Entry::Frame);
    }
    if let [.., b'_', code] = rest.bytes
        && let Some(code) = char::from(*code).to_digit(16)
    {
        return Err(Problem::LengthCode(code as u8));
    }
    let mut buffer = [0; CLASSICAL_MAX];
    let data = rest.data(&mut buffer, CLASSICAL_LENGTHS)?;
    CanFrame::classical(id, data)
        .map(Entry::Frame)
        .ok_or(Problem::Length {
            found: data.len(),
            allowed: CLASSICAL_LENGTHS,
        })
}

fn identifier(text: Text<'_>) -> Result<Id, Problem> {
    match text.bytes.len() {
        3 => id(text.number()?, false),
        8 => id(text.number()?, true),
        digits => Err(Problem::IdDigits(digits)),
    }
}

/// The identifier of this number, 29 bits or 11.
pub(super) fn id(raw: u32, extended: bool) -> Result<Id, Problem> {
    let (id, max) = if extended {
        let id = ExtendedId::new(raw).map(Id::Extended);
        (id, ExtendedId::MAX.as_raw())
    } else {
        let id = u16::try_from(raw).ok().and_then(StandardId::new);
        (id.map(Id::Standard), StandardId::MAX.as_raw().into())
    };
    id.ok_or(Problem::IdRange { id: raw, max })
}

fn error_frame(raw: u32, text: Text<'_>) -> Result<ErrorFrame, Problem> {
    let mut buffer = [0; 8];
    let details = text.data(&mut buffer, CLASSICAL_LENGTHS)?;
    ErrorFrame::new(raw, details).ok_or(Problem::Length {
        found: details.len(),
        allowed: CLASSICAL_LENGTHS,
    })
}

fn remote_frame(id: Id, length: Text<'_>) -> Result<CanFrame, Problem> {
    let length = match length.bytes {
        [] => 0,
        [digit @ b'0'..=b'8'] => digit - b'0',
        _ => return Err(Problem::Remote),
    };
    CanFrame::remote(id, length.into()).ok_or(Problem::Remote)
}

fn fd_frame(id: Id, text: Text<'_>) -> Result<CanFrame, Problem> {
    if text.bytes.is_empty() {
        return Err(Problem::NoFlags);
    }
    let (flags, data) = text.split(1);
    let flags = flags.number()? as u8;
    if flags & !(FLAG_BRS | FLAG_ESI | FLAG_FDF) != 0 {
        return Err(Problem::Flags(flags));
    }
    let mut buffer = [0; FD_MAX];
    let data = data.data(&mut buffer, FD_LENGTHS)?;
    fd(id, data, flags & FLAG_BRS != 0, flags & FLAG_ESI != 0)
}

/// An FD frame of exactly this data.
pub(super) fn fd(id: Id, data: &[u8], brs: bool, esi: bool) -> Result<CanFrame, Problem> {
    let found = data.len();
    // The frame would pad to the next length, but a log has frames as they were, so no frame has another length.
    if fd_length(found) != Some(found) {
        return Err(Problem::Length {
            found,
            allowed: FD_LENGTHS,
        });
    }
    CanFrame::fd(id, data, brs)
        .map(|frame| frame.with_esi(esi))
        .ok_or(Problem::Length {
            found,
            allowed: FD_LENGTHS,
        })
}

/// The text before and after the first `byte`.
pub(super) fn split_at_byte(text: &[u8], byte: u8) -> Option<(&[u8], &[u8])> {
    let at = text.iter().position(|&b| b == byte)?;
    Some((&text[..at], &text[at + 1..]))
}
