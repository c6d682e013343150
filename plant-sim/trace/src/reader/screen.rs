//! Screen output of candump: ` (1727438342.368435)  can0  RX B -  0C0  [12]  03 F5 ...`.
//!
//! The screen shows the bit rate switch only with `-x`; otherwise it is assumed to be set, as on nearly every FD bus.

use memchr::memchr2;
use protocol::frame::{CanFrame, FD_MAX};

use crate::line::{Problem, fd, id, split_at_byte, timestamp};
use crate::{Direction, ERROR_FLAG, Entry, ErrorFrame, Interface, Record};

/// Digits of a second since 1970. candump prints fewer for times since the start or since the previous frame.
const ABSOLUTE: usize = 10;

/// Whether a line is screen output: there is no `#` where a log has identifier and data.
pub(super) fn is_screen(line: &[u8]) -> bool {
    // A log has no brackets.
    if memchr2(b'[', b'{', line).is_none() {
        return false;
    }
    let frame = match split_at_byte(line, b')') {
        Some((_, rest)) => words(rest).nth(1),
        None => words(line).nth(1),
    };
    let brackets = words(line).any(|word| length(word).is_some());
    brackets && frame.is_some_and(|frame| !frame.contains(&b'#'))
}

/// Whether a line explains the error frame before it (`candump -e`).
pub(super) fn is_detail(line: &[u8]) -> bool {
    line.starts_with(b"\t")
}

/// Whether a long line is a CAN XL frame of a log: `can0 45123#81:00:...`.
pub(super) fn is_can_xl(line: &[u8]) -> bool {
    let content = split_at_byte(line, b'#').map_or(line, |(_, content)| content);
    content.get(2) == Some(&b':')
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Number in brackets and its count of digits.
fn length(word: &[u8]) -> Option<(usize, usize)> {
    let inner = match word {
        [b'[', inner @ .., b']'] | [b'{', inner @ .., b'}'] => inner,
        _ => return None,
    };
    let text = std::str::from_utf8(inner).ok()?;
    let digits = inner.iter().all(u8::is_ascii_digit);
    Some((text.parse().ok().filter(|_| digits)?, inner.len()))
}

pub(super) fn parse(line: &[u8]) -> Result<Record, Problem> {
    let line = line.trim_ascii_start();
    let stamped = line.strip_prefix(b"(").ok_or(Problem::Screen)?;
    let (stamp, rest) = split_at_byte(stamped, b')').ok_or(Problem::Timestamp)?;
    let (seconds, _) = split_at_byte(stamp, b'.').ok_or(Problem::Timestamp)?;
    if seconds.len() < ABSOLUTE || stamp.contains(&b' ') {
        return Err(Problem::Screen);
    }
    let mut words = words(rest).peekable();
    let name = words.next().ok_or(Problem::Interface)?;
    let mut record = Record {
        time_us: timestamp(stamp)?,
        interface: Interface::from_bytes(name).ok_or(Problem::Interface)?,
        direction: None,
        entry: Entry::Error(ErrorFrame::new(0, &[]).ok_or(Problem::Screen)?),
    };
    let (mut brs, mut esi) = (true, false);
    if let Some(&way @ (b"RX" | b"TX")) = words.peek() {
        record.direction = Some(if way == b"RX" {
            Direction::Received
        } else {
            Direction::Transmitted
        });
        words.next();
        brs = words.next() == Some(b"B");
        esi = words.next() == Some(b"E");
    }
    let digits = words.next().ok_or(Problem::IdDigits(0))?;
    let (len, width) = words.next().and_then(length).ok_or(Problem::Separator)?;
    if width > 2 {
        return Err(Problem::CanXl);
    }
    let raw = hex(digits, line)?;
    let mut words = words.peekable();
    if words.peek() == Some(&b"remote".as_slice()) {
        let id = id(raw, digits.len() == 8)?;
        let frame = CanFrame::remote(id, len).ok_or(Problem::Remote)?;
        record.entry = Entry::Frame(frame);
        return Ok(record);
    }
    let mut data = [0; FD_MAX];
    let allowed = "as many as the brackets say";
    let data = data.get_mut(..len).ok_or(Problem::Length {
        found: len,
        allowed: "0 to 64",
    })?;
    for (found, byte) in data.iter_mut().enumerate() {
        let word = words.next().ok_or(Problem::Length { found, allowed })?;
        *byte = u8::try_from(hex(word, line)?).map_err(|_| Problem::OddDigits)?;
    }
    // Text of the data (-a), or the mark of an error frame.
    let rest_is_known = |word: &[u8]| word.starts_with(b"'") || word == b"ERRORFRAME";
    if !words.peek().is_none_or(|word| rest_is_known(word)) {
        return Err(Problem::Length {
            found: len + words.count(),
            allowed,
        });
    }
    record.entry = if digits.len() == 8 && raw & ERROR_FLAG != 0 {
        Entry::Error(ErrorFrame::new(raw, data).ok_or(Problem::Screen)?)
    } else {
        let id = match digits.len() {
            3 => id(raw, false),
            8 => id(raw, true),
            digits => Err(Problem::IdDigits(digits)),
        }?;
        Entry::Frame(if width == 2 {
            fd(id, data, brs, esi)?
        } else {
            CanFrame::classical(id, data).ok_or(Problem::Length {
                found: len,
                allowed: "0 to 8",
            })?
        })
    };
    Ok(record)
}

/// Value of a word within `line`.
fn hex(word: &[u8], line: &[u8]) -> Result<u32, Problem> {
    let mut value: u32 = 0;
    for &byte in word.iter().take(8) {
        let found = char::from(byte);
        let digit = found.to_digit(16).ok_or_else(|| Problem::Hex {
            column: line
                .windows(word.len())
                .position(|w| w == word)
                .unwrap_or(0)
                + 1,
            found,
        })?;
        value = value << 4 | digit;
    }
    Ok(value)
}
