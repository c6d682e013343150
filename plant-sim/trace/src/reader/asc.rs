//! Vector ASC, as CANalyzer, CANoe, can-utils, python-can and this crate write it. Channel 1 is `can0`.

use chrono::{Local, NaiveDate, NaiveDateTime, TimeZone};
use protocol::frame::{CLASSICAL_MAX, CanFrame, FD_MAX, fd_length_of_dlc};

use crate::line::{Problem, fd, id, timestamp};
use crate::{Direction, Entry, ErrorFrame, Interface, Record};

/// How lines without a time begin, in lower case: header, blocks of a trigger, comments.
const HEADS: [&str; 6] = [
    "internal events",
    "no internal events",
    "begin trigger",
    "end trigger",
    "previous log file",
    "//",
];
/// Class for an error frame, of which ASC gives no details (`CAN_ERR_BUSERROR`, as in can-utils).
const BUS_ERROR: u32 = 0x80;

/// State between two lines.
#[derive(Default)]
pub(super) struct Asc {
    decimal: bool,
    /// Whether times count from the previous line instead of the start.
    relative: bool,
    /// Start time since 1970.
    start_us: u64,
    /// Time of the previous line, from the start.
    now_us: u64,
}

impl Asc {
    /// Whether a file that begins with this line is ASC.
    pub(super) fn begins(line: &[u8]) -> bool {
        line.starts_with(b"date ") || line.starts_with(b"base ")
    }

    /// Record of a line, if it is one; headers, statistics and events of other kinds are not. What is neither is damaged.
    pub(super) fn line(&mut self, line: &[u8]) -> Option<Result<Record, Problem>> {
        let text = String::from_utf8_lossy(line);
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["date", date @ ..] => {
                // With a date in an unknown language, times count from the start.
                self.start_us = date_us(date).unwrap_or(0);
                None
            }
            ["base", base, rest @ ..] => {
                self.decimal = *base == "dec";
                self.relative = rest.contains(&"relative");
                let is_known = ["dec", "hex"].contains(base);
                (!is_known).then_some(Err(Problem::Asc("a base that is neither hex nor dec")))
            }
            [time, rest @ ..] if time.starts_with(|c: char| c.is_ascii_digit()) => {
                let time_us = match timestamp(time.as_bytes()) {
                    Ok(time_us) => time_us,
                    Err(Problem::Timestamp) => {
                        return Some(Err(Problem::Asc("no time such as 0.012345 at the start")));
                    }
                    Err(problem) => return Some(Err(problem)),
                };
                self.now_us = if self.relative {
                    self.now_us.saturating_add(time_us)
                } else {
                    time_us
                };
                self.event(self.start_us.saturating_add(self.now_us), rest)
            }
            // CANoe has events from before its start; here times are not negative.
            [time, ..]
                if time.starts_with('-') && time[1..].starts_with(|c: char| c.is_ascii_digit()) =>
            {
                Some(Err(Problem::Asc("a time before the start")))
            }
            [] => None,
            _ => {
                let line = text.trim_start().to_lowercase();
                (!HEADS.iter().any(|head| line.starts_with(head))).then_some(Err(Problem::Asc(
                    "neither a time nor a line of the header at the start",
                )))
            }
        }
    }

    fn event(&self, time_us: u64, words: &[&str]) -> Option<Result<Record, Problem>> {
        let (fd, words) = match words {
            ["CANFD", rest @ ..] => (true, rest),
            _ => (false, words),
        };
        let [channel, rest @ ..] = words else {
            return Some(Err(Problem::Asc("nothing after the time")));
        };
        let channel = channel.parse().ok().filter(|&channel: &usize| channel > 0);
        let Some(channel) = channel else {
            // Only frames and their like begin with a channel.
            return fd.then_some(Err(Problem::Asc("no channel, counted from 1, after CANFD")));
        };
        let record = |direction, entry| Record {
            time_us,
            interface: Interface::numbered(channel - 1),
            direction,
            entry,
        };
        let is_error = |word: &&str| *word == "ErrorFrame";
        if rest.iter().take(2).any(is_error) {
            let error = ErrorFrame::new(BUS_ERROR, &[0; 8])?;
            return Some(Ok(record(None, Entry::Error(error))));
        }
        let (id, way, rest) = match (fd, rest) {
            (true, [way, id, rest @ ..]) => (id, way, rest),
            (false, [id, way, rest @ ..]) => (id, way, rest),
            // Other events have words that are no identifiers.
            (false, [cut]) if self.id(cut).is_ok() => {
                return Some(Err(Problem::Asc("nothing after the identifier")));
            }
            (true, _) => return Some(Err(Problem::Asc("no direction and identifier"))),
            _ => return None,
        };
        let direction = match *way {
            // Also written where the direction is unknown.
            "Rx" => None,
            "Tx" => Some(Direction::Transmitted),
            // A request to send, followed by the frame itself.
            "TxRq" => return None,
            _ if fd || self.id(id).is_ok() => {
                return Some(Err(Problem::Asc("no direction; Rx, Tx or TxRq is allowed")));
            }
            // Statistics and the like.
            _ => return None,
        };
        let frame = if fd {
            self.fd(id, rest)
        } else {
            self.classical(id, rest)
        };
        Some(frame.map(|frame| record(direction, Entry::Frame(frame))))
    }

    fn classical(&self, id: &str, rest: &[&str]) -> Result<CanFrame, Problem> {
        let id = self.id(id)?;
        let dlc = |text: Option<&&str>| {
            text.map_or(Ok(0), |text| {
                usize::from_str_radix(text, 16).map_err(|_| Problem::Asc("no length"))
            })
        };
        match rest {
            ["r", rest @ ..] => {
                // python-can and old files omit the length; what follows then is not a number.
                let len = dlc(rest.first()).unwrap_or(0);
                CanFrame::remote(id, len.min(CLASSICAL_MAX)).ok_or(Problem::Remote)
            }
            ["d", len, rest @ ..] => {
                let len = dlc(Some(len))?.min(CLASSICAL_MAX);
                let mut buffer = [0; FD_MAX];
                let data = self.data(rest, len, &mut buffer)?;
                CanFrame::classical(id, data).ok_or(Problem::Asc("too many bytes"))
            }
            _ => Err(Problem::Asc("neither data (d) nor remote (r)")),
        }
    }

    fn fd(&self, id: &str, rest: &[&str]) -> Result<CanFrame, Problem> {
        let id = self.id(id)?;
        // A symbolic name may precede the flags.
        let rest = match rest {
            ["0" | "1", ..] => rest,
            [_, rest @ ..] => rest,
            [] => return Err(Problem::Asc("no flags")),
        };
        let [brs, esi, dlc, len, rest @ ..] = rest else {
            return Err(Problem::Asc("no length"));
        };
        let dlc = u8::from_str_radix(dlc, 16).map_err(|_| Problem::Asc("no length code"))?;
        let len: usize = len.parse().map_err(|_| Problem::Asc("no length"))?;
        let mut buffer = [0; FD_MAX];
        let data = self.data(rest, len, &mut buffer)?;
        // Among the last words of the line, the flags show whether the frame is FD.
        let flags = rest
            .get(len + 2)
            .and_then(|flags| u32::from_str_radix(flags, 16).ok());
        match flags {
            Some(flags) if flags & (1 << 4) != 0 => {
                CanFrame::remote(id, usize::from(dlc)).ok_or(Problem::Remote)
            }
            Some(flags) if flags & (1 << 12) == 0 && len <= CLASSICAL_MAX => {
                CanFrame::classical(id, data).ok_or(Problem::Asc("too many bytes"))
            }
            _ if fd_length_of_dlc(dlc) != Some(len) => {
                Err(Problem::Asc("length code and length differ"))
            }
            _ => fd(id, data, *brs == "1", *esi == "1"),
        }
    }

    fn id(&self, text: &str) -> Result<protocol::frame::Id, Problem> {
        let (digits, extended) = match text.strip_suffix(['x', 'X']) {
            Some(digits) => (digits, true),
            None => (text, false),
        };
        let raw = u32::from_str_radix(digits, self.radix());
        id(raw.map_err(|_| Problem::Asc("no identifier"))?, extended)
    }

    fn radix(&self) -> u32 {
        if self.decimal { 10 } else { 16 }
    }

    fn data<'a>(
        &self,
        words: &[&str],
        len: usize,
        buffer: &'a mut [u8; FD_MAX],
    ) -> Result<&'a [u8], Problem> {
        let words = words
            .get(..len)
            .ok_or(Problem::Asc("fewer bytes than its length"))?;
        let data = buffer
            .get_mut(..len)
            .ok_or(Problem::Asc("too many bytes"))?;
        for (byte, word) in data.iter_mut().zip(words) {
            *byte = u8::from_str_radix(word, self.radix())
                .map_err(|_| Problem::Asc("data that is not a byte"))?;
        }
        Ok(data)
    }
}

/// Time since 1970 of a local date: `Fri Jul 10 06:17:32.249 2015`, or with am and pm before the year.
fn date_us(words: &[&str]) -> Option<u64> {
    let (month, day, time, half, year) = match words {
        [_, month, day, time, year] => (month, day, time, "", year),
        [_, month, day, time, half, year] => (month, day, time, *half, year),
        _ => return None,
    };
    let start: String = month.chars().take(3).collect::<String>().to_lowercase();
    let month = match start.as_str() {
        "jan" => 1,
        "feb" => 2,
        "mar" | "mär" | "mrz" => 3,
        "apr" => 4,
        "may" | "mai" => 5,
        "jun" => 6,
        "jul" => 7,
        "aug" => 8,
        "sep" => 9,
        "oct" | "okt" => 10,
        "nov" => 11,
        "dec" | "dez" => 12,
        _ => return None,
    };
    let date = NaiveDate::from_ymd_opt(year.parse().ok()?, month, day.parse().ok()?)?;
    let mut parts = time.split(':');
    let mut hour: u32 = parts.next()?.parse().ok()?;
    let minute = parts.next()?.parse().ok()?;
    let seconds = parts.next()?;
    let seconds = if seconds.contains('.') {
        seconds.into()
    } else {
        format!("{seconds}.0")
    };
    let second_us = u32::try_from(timestamp(seconds.as_bytes()).ok()?).ok()?;
    match half.to_lowercase().as_str() {
        "pm" if hour < 12 => hour += 12,
        "am" if hour == 12 => hour = 0,
        _ => {}
    }
    let local: NaiveDateTime =
        date.and_hms_micro_opt(hour, minute, second_us / 1_000_000, second_us % 1_000_000)?;
    let time = Local.from_local_datetime(&local).earliest()?;
    u64::try_from(time.timestamp_micros()).ok()
}
