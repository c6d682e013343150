//! Log reader: record by record, in bounded memory. The format is detected from the first bytes.

mod asc;
mod pcapng;
mod screen;

use std::io::{self, BufRead, Chain, Cursor, Read};

use memchr::memchr;
use protocol::codec;
use protocol::table;

use super::{
    Entry, Record,
    line::{self, MAX_LINE, Problem},
};
use asc::Asc;
use pcapng::Pcapng;

/// Byte order mark of UTF-8, which editors on other systems prepend.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
/// First bytes of compressed files, and the program that reads them.
const PACKED: [(&[u8], &str); 3] = [
    (b"\xFD7zX", "xz"),
    (b"BZh", "bzip2"),
    (b"\x28\xB5\x2F\xFD", "zstd"),
];

/// First bytes of formats that python-can converts.
const FOREIGN: [(&[u8], &str, &str); 3] = [
    (b"LOGG", "Vector BLF", "blf"),
    (b"MDF ", "ASAM MDF", "mf4"),
    (b";$FI", "PEAK TRC", "trc"),
];
/// Bytes that identify the format.
const MAGIC: u64 = 4;

/// A line that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The line, or packet of a pcapng file, holds no frame. Reading continues with the next.
    #[error("line {line}: {problem}")]
    Line {
        /// Counted from 1.
        line: u64,
        /// What is wrong, and what is allowed.
        problem: Problem,
    },
    /// The source failed.
    #[error("{}{source}", if *line > 0 { format!("line {line}: ") } else { String::new() })]
    Io {
        /// Counted from 1; 0 where the format could not be detected.
        line: u64,
        /// The failure.
        source: io::Error,
    },
}

/// Reads a log; an iterator over its records. Empty lines and comments (`#`) are skipped.
pub struct Reader<R> {
    source: Chain<Cursor<Vec<u8>>, R>,
    format: Option<Format>,
    line: u64,
    /// Whether any record could be read.
    has_records: bool,
    buffer: Vec<u8>,
}

enum Format {
    /// candump, log or screen: every line is independent.
    Candump,
    Asc(Asc),
    Pcapng(Pcapng),
}

impl<R: BufRead> Reader<R> {
    /// Starts at the first line.
    pub fn new(source: R) -> Self {
        Self {
            source: Cursor::new(Vec::new()).chain(source),
            format: None,
            line: 0,
            has_records: false,
            buffer: Vec::with_capacity(MAX_LINE + 1),
        }
    }

    /// Number of the line or packet read last, counted from 1; 0 before the first.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// Source of the bytes.
    pub fn source(&self) -> &R {
        self.source.get_ref().1
    }

    /// Detects the format.
    fn begin(&mut self) -> io::Result<Format> {
        let (head, source) = self.source.get_mut();
        let bytes = head.get_mut();
        source.by_ref().take(MAGIC).read_to_end(bytes)?;
        if bytes.starts_with(BYTE_ORDER_MARK) {
            bytes.drain(..BYTE_ORDER_MARK.len());
        }
        Ok(if pcapng::begins(bytes) {
            Format::Pcapng(Pcapng::default())
        } else if pcapng::begins_classic(bytes) {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "pcap, not pcapng; convert it with: editcap -F pcapng FILE OUT",
            ));
        } else if let Some((_, format, ending)) = FOREIGN.iter().find(|(magic, ..)| bytes == magic)
        {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                format!(
                    "{format}, which is not read; python-can converts it: python3 -m can.logconvert FILE.{ending} OUT.log"
                ),
            ));
        } else if let Some((_, program)) = PACKED.iter().find(|(magic, _)| bytes.starts_with(magic))
        {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                format!(
                    "compressed, and of that only .gz is read; unpack it: {program} -dc FILE | plant-sim trace ... -"
                ),
            ));
        } else if bytes.starts_with(b"\x1F\x8B") {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "compressed twice; unpack it once: gzip -dc FILE | plant-sim trace ... -",
            ));
        } else if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "text in UTF-16, as PowerShell writes it with >; convert it: iconv -f UTF-16 -t UTF-8 FILE > OUT",
            ));
        } else {
            Format::Candump
        })
    }

    /// Fills the buffer with the next line, including its line feed, or with as much of it as any good line can have.
    fn fill(&mut self) -> io::Result<()> {
        self.buffer.clear();
        let limit = MAX_LINE as u64 + 1;
        Read::take(&mut self.source, limit).read_until(b'\n', &mut self.buffer)?;
        Ok(())
    }

    fn read(&mut self) -> io::Result<Option<Result<Record, Problem>>> {
        let mut format = match self.format.take() {
            Some(format) => format,
            None => self.begin()?,
        };
        let read = match &mut format {
            Format::Pcapng(pcapng) => pcapng.read(&mut self.source, &mut self.line),
            _ => self.read_text(&mut format),
        };
        self.format = Some(format);
        read
    }

    fn read_text(&mut self, format: &mut Format) -> io::Result<Option<Result<Record, Problem>>> {
        loop {
            self.line += 1;
            self.fill()?;
            if self.buffer.is_empty() {
                return Ok(None);
            }
            let ended = self.buffer.ends_with(b"\n");
            let line = self.buffer.trim_ascii_end();
            let is_joined = line.starts_with(b"(") && memchr(b'\r', line).is_some();
            if !ended && self.buffer.len() > MAX_LINE {
                let problem = if screen::is_can_xl(line) {
                    Problem::CanXl
                } else if is_joined {
                    Problem::CarriageReturn
                } else {
                    Problem::TooLong
                };
                self.source.skip_until(b'\n')?;
                return Ok(Some(Err(problem)));
            }
            if is_joined {
                return Ok(Some(Err(Problem::CarriageReturn)));
            }
            if let Format::Candump = format
                && Asc::begins(line)
            {
                *format = Format::Asc(Asc::default());
            }
            let read = match format {
                Format::Asc(asc) => asc.line(line),
                _ if line.trim_ascii_start().is_empty()
                    || line.starts_with(b"#")
                    || screen::is_detail(line) =>
                {
                    None
                }
                _ if screen::is_screen(line) => Some(screen::parse(line)),
                _ => Some(line::parse(line)),
            };
            match read {
                None => {}
                Some(read) if ended || read.as_ref().is_ok_and(is_whole) => {
                    self.has_records |= read.is_ok();
                    return Ok(Some(read));
                }
                // A file that begins otherwise was no log when it was cut off.
                Some(Err(problem)) if !self.has_records && !line.starts_with(b"(") => {
                    return Ok(Some(Err(problem)));
                }
                Some(_) => return Ok(Some(Err(Problem::Unterminated))),
            }
        }
    }
}

/// Whether a frame at the end of a log without its line feed is complete: one in the table must match it.
fn is_whole(record: &Record) -> bool {
    match &record.entry {
        Entry::Frame(frame) => table::of_frame(frame).is_none() || codec::decode(frame).is_ok(),
        Entry::Error(_) => true,
    }
}

impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<Record, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        let read = self.read();
        let line = self.line;
        match read {
            Ok(read) => {
                read.map(|record| record.map_err(|problem| ReadError::Line { line, problem }))
            }
            Err(source) => Some(Err(ReadError::Io { line, source })),
        }
    }
}
