//! Vector ASC: the text log of CANalyzer and CANoe. Times count from the date in the header. That is the date of the
//! first record in local time, as readers expect it, in whole milliseconds: the first time holds the rest.

use std::io::{self, Write};

use chrono::{DateTime, Local};
use protocol::frame::{CanFrame, FrameKind};

use super::Interfaces;
use crate::text::Line;
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
    line: Line,
    id: Line,
}

impl<W: Write> Asc<W> {
    pub(super) fn new(sink: W) -> Self {
        Self {
            sink,
            interfaces: Interfaces::default(),
            start_us: None,
            line: Line::default(),
            id: Line::default(),
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
        let line = &mut self.line;
        line.clear();
        // A clock set back to before the start stays at the start.
        let time_us = record.time_us.saturating_sub(start_us);
        line.padded(time_us / 1_000_000, 4, b' ');
        line.byte(b'.');
        line.padded(time_us % 1_000_000, 6, b'0');
        line.byte(b' ');
        // Channels are counted from 1.
        let channel = self.interfaces.number(record.interface).0 + 1;
        match &record.entry {
            Entry::Frame(frame) => self.put_frame(channel, record.direction, frame),
            Entry::Error(_) => {
                line.integer(channel);
                line.word("  ErrorFrame");
            }
        }
        self.line.byte(b'\n');
        self.sink.write_all(self.line.bytes())
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

/// Flags after the data of an FD line in front of which are duration and length in bits, and behind them the CRC and four words
/// of bit timing; unknown is 0.
fn flags(brs: bool, esi: bool) -> u32 {
    FLAG_FDF | (u32::from(brs) * FLAG_BRS) | (u32::from(esi) * FLAG_ESI)
}

impl<W> Asc<W> {
    fn put_frame(&mut self, channel: usize, direction: Option<Direction>, frame: &CanFrame) {
        let Self { line, id, .. } = self;
        let way = direction.unwrap_or(Direction::Received).name();
        id.clear();
        id.hex(frame.raw_id(), digits(frame.raw_id()));
        if frame.is_extended() {
            id.byte(b'x');
        }
        match frame.kind() {
            FrameKind::Classical { remote } => {
                line.integer(channel);
                line.word("  ");
                line.extend(id.bytes());
                line.blanks(15_usize.saturating_sub(id.bytes().len()));
                line.byte(b' ');
                line.word(way);
                line.word(if remote { "   r " } else { "   d " });
                line.hex(frame.dlc().into(), 1);
                line.spaced(frame.data());
            }
            FrameKind::Fd { brs, esi } => {
                line.word("CANFD ");
                line.padded(channel, 3, b' ');
                line.byte(b' ');
                line.word(way);
                line.word("   ");
                line.blanks(8_usize.saturating_sub(id.bytes().len()));
                line.extend(id.bytes());
                line.blanks(34);
                line.byte(b'0' + u8::from(brs));
                line.byte(b' ');
                line.byte(b'0' + u8::from(esi));
                line.byte(b' ');
                line.byte(b"0123456789abcdef"[usize::from(frame.dlc())]);
                line.byte(b' ');
                line.padded(frame.data().len(), 2, b' ');
                line.spaced(frame.data());
                line.word("        0    0 ");
                let flags = flags(brs, esi);
                line.blanks(8 - digits(flags) as usize);
                line.hex(flags, digits(flags));
                line.word("        0        0        0        0        0");
            }
        }
    }
}

/// Hexadecimal digits that a number takes.
fn digits(value: u32) -> u32 {
    value.checked_ilog2().map_or(1, |bits| bits / 4 + 1)
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
