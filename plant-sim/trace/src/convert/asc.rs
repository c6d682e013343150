//! Vector ASC: the text log of CANalyzer and CANoe. Times count from the first record, whose date is in the header.

use std::fmt::Write as _;
use std::io::{self, Write};

use protocol::frame::{CanFrame, FrameKind};
use time::{Duration, UtcDateTime};

use super::Interfaces;
use crate::decode::Seconds;
use crate::{Entry, Record};

/// Flags of a `CANFD` line: FD format, bit rate switch, error state indicator.
const FLAG_FDF: u32 = 1 << 12;
const FLAG_BRS: u32 = 1 << 13;
const FLAG_ESI: u32 = 1 << 14;

/// An ASC file.
pub(super) struct Asc<W> {
    sink: W,
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
                self.start_us = Some(record.time_us);
                self.header(record.time_us)?;
                record.time_us
            }
        };
        // Channels are counted from 1. A clock that was set back before the start stays at the start.
        let channel = self.interfaces.number(record.interface).0 + 1;
        let time = Seconds(record.time_us.saturating_sub(start_us)).to_string();
        let content = match &record.entry {
            Entry::Frame(frame) => frame_line(channel, frame),
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
        let date = date(start_us);
        writeln!(
            self.sink,
            "date {date}\nbase hex  timestamps absolute\ninternal events logged\n\
             Begin Triggerblock {date}\n   0.000000 Start of measurement"
        )
    }
}

fn frame_line(channel: usize, frame: &CanFrame) -> String {
    let extended = if frame.is_extended() { "x" } else { "" };
    let id = format!("{:X}{extended}", frame.raw_id());
    let length = frame.data().len();
    let mut line = match frame.kind() {
        FrameKind::Classical { remote: false } => {
            format!("{channel}  {id:<15} Rx   d {length:x}")
        }
        FrameKind::Classical { remote: true } => {
            return format!("{channel}  {id:<15} Rx   r {:x}", frame.dlc());
        }
        FrameKind::Fd { brs, esi } => format!(
            "CANFD {channel:>3} Rx   {id:>8} {:>32} {} {} {:x} {length:>2}",
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

/// UTC date of a time since 1970: `Thu Jan 01 00:00:00.000 1970`.
fn date(time_us: u64) -> String {
    // A log's time may be anything; the calendar ends with the year 9999.
    let since = Duration::microseconds(i64::try_from(time_us).unwrap_or(i64::MAX));
    let date = UtcDateTime::UNIX_EPOCH.saturating_add(since);
    let (weekday, month) = (date.weekday().to_string(), date.month().to_string());
    format!(
        "{weekday:.3} {month:.3} {:02} {:02}:{:02}:{:02}.{:03} {}",
        date.day(),
        date.hour(),
        date.minute(),
        date.second(),
        date.millisecond(),
        date.year()
    )
}

#[cfg(test)]
mod tests {
    use super::date;

    /// Values of GNU date: `date -u -d @SECONDS`.
    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, expected) in [
            (0, "Thu Jan 01 00:00:00.000 1970"),
            (951_782_399, "Mon Feb 28 23:59:59.000 2000"),
            (951_782_400, "Tue Feb 29 00:00:00.000 2000"),
            (951_868_800, "Wed Mar 01 00:00:00.000 2000"),
            (1_735_689_599, "Tue Dec 31 23:59:59.000 2024"),
            (4_107_542_400, "Mon Mar 01 00:00:00.000 2100"),
        ] {
            assert_eq!(date(seconds * 1_000_000), expected);
        }
        assert!(date(u64::MAX).ends_with(" 9999"));
        assert_eq!(date(1_436_509_052_249_713), "Fri Jul 10 06:17:32.249 2015");
    }
}
