//! Vector ASC: the text log of CANalyzer and CANoe. Times count from the date in the header. That is the date of the
//! first record in local time, as readers expect it, in whole milliseconds: the first time holds the rest.

use std::fmt::Write as _;
use std::io::{self, Write};

use chrono::{DateTime, Local};
use protocol::frame::{CanFrame, FrameKind};

use super::Interfaces;
use crate::decode::Seconds;
use crate::{Direction, Entry, Record};

/// Flags of a `CANFD` line: FD format, bit rate switch, error state indicator.
const FLAG_FDF: u32 = 1 << 12;
const FLAG_BRS: u32 = 1 << 13;
const FLAG_ESI: u32 = 1 << 14;

/// An ASC file.
pub(super) struct Asc<W> {
    pub(super) sink: W,
    interfaces: Interfaces,
    start_us: Option<u64>,
}

impl<W: Write> Asc<W> {
    pub(super) fn new(sink: W) -> Self {
        Self {
            sink,
            interfaces: Interfaces::default(),
            start_us: None,
        }
    }

    pub(super) fn record(&mut self, record: &Record) -> io::Result<()> {
        let start_us = match self.start_us {
            Some(start_us) => start_us,
            None => {
                let start_us = record.time_us / 1000 * 1000;
                self.start_us = Some(start_us);
                self.header(start_us)?;
                start_us
            }
        };
        // Channels are counted from 1. A clock set back to before the start stays at the start.
        let channel = self.interfaces.number(record.interface).0 + 1;
        let time = Seconds(record.time_us.saturating_sub(start_us)).to_string();
        let content = match &record.entry {
            Entry::Frame(frame) => frame_line(channel, record.direction, frame),
            Entry::Error(_) => format!("{channel}  ErrorFrame"),
        };
        writeln!(self.sink, "{time:>11} {content}")
    }

    pub(super) fn finish(mut self) -> io::Result<W> {
        if self.start_us.is_none() {
            self.header(0)?;
        }
        writeln!(self.sink, "End TriggerBlock")?;
        Ok(self.sink)
    }

    fn header(&mut self, start_us: u64) -> io::Result<()> {
        let date = date(&local(start_us));
        writeln!(
            self.sink,
            "date {date}\nbase hex  timestamps absolute\ninternal events logged\n\
             Begin Triggerblock {date}\n   0.000000 Start of measurement"
        )
    }
}

fn frame_line(channel: usize, direction: Option<Direction>, frame: &CanFrame) -> String {
    let way = direction.unwrap_or(Direction::Received).name();
    let extended = if frame.is_extended() { "x" } else { "" };
    let id = format!("{:X}{extended}", frame.raw_id());
    let length = frame.data().len();
    let mut line = match frame.kind() {
        FrameKind::Classical { remote: false } => {
            format!("{channel}  {id:<15} {way}   d {length:x}")
        }
        FrameKind::Classical { remote: true } => {
            return format!("{channel}  {id:<15} {way}   r {:x}", frame.dlc());
        }
        FrameKind::Fd { brs, esi } => format!(
            "CANFD {channel:>3} {way}   {id:>8} {:>32} {} {} {:x} {length:>2}",
            "",
            u8::from(brs),
            u8::from(esi),
            frame.dlc()
        ),
    };
    for byte in frame.data() {
        // Writing to a string cannot fail.
        let _ = write!(line, " {byte:02X}");
    }
    if let FrameKind::Fd { brs, esi } = frame.kind() {
        let flags = FLAG_FDF | (u32::from(brs) * FLAG_BRS) | (u32::from(esi) * FLAG_ESI);
        // Duration, length in bits, flags, CRC and four words of bit timing; unknown is 0.
        let _ = write!(
            line,
            " {:>8} {:>4} {flags:>8X} {:>8} {:>8} {:>8} {:>8} {:>8}",
            0, 0, 0, 0, 0, 0, 0
        );
    }
    line
}

/// Local time of a time since 1970; one beyond the calendar becomes its start.
fn local(time_us: u64) -> DateTime<Local> {
    let time = i64::try_from(time_us)
        .ok()
        .and_then(DateTime::from_timestamp_micros);
    time.unwrap_or_default().with_timezone(&Local)
}

/// `Thu Jan 01 00:00:00.000 1970`.
fn date(time: &DateTime<impl chrono::TimeZone<Offset: std::fmt::Display>>) -> String {
    time.format("%a %b %d %H:%M:%S%.3f %Y").to_string()
}

#[cfg(test)]
mod tests {
    use super::date;
    use chrono::DateTime;

    /// Values from GNU date: `date -u -d @SECONDS`.
    #[test]
    fn dates_are_those_of_the_calendar() {
        let utc = |time_us| date(&DateTime::from_timestamp_micros(time_us).unwrap());
        for (seconds, expected) in [
            (0, "Thu Jan 01 00:00:00.000 1970"),
            (951_782_399, "Mon Feb 28 23:59:59.000 2000"),
            (951_782_400, "Tue Feb 29 00:00:00.000 2000"),
            (1_735_689_599, "Tue Dec 31 23:59:59.000 2024"),
            (4_107_542_400, "Mon Mar 01 00:00:00.000 2100"),
        ] {
            assert_eq!(utc(seconds * 1_000_000), expected);
        }
        assert_eq!(utc(1_436_509_052_249_000), "Fri Jul 10 06:17:32.249 2015");
    }
}
