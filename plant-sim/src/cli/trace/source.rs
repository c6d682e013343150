//! A trace as input: file or standard input, with progress, and bad lines reported.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::os::fd::AsFd;
use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, Instant};

use flate2::read::MultiGzDecoder;
use memchr::memchr;
use plant_sim::{interrupt, say};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use trace::select::Selection;
use trace::{Interface, Problem, ReadError, Reader, Record};

use crate::cli::Failure;

/// Unreadable lines that are shown; of further ones only the number is.
const SHOWN: u64 = 10;
/// Records between two checks of the clock.
const LOOK: u64 = 1 << 14;
/// Interval of checking for a signal while there is nothing to read.
const WATCH: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 100_000_000,
};
/// First bytes of gzip.
const GZIP: &[u8] = b"\x1F\x8B";
/// A trace that is read from front to end, with its progress on standard error.
pub(super) struct Source {
    name: String,
    reader: Reader<BufReader<Box<dyn Read>>>,
    /// Whether it is gzipped.
    packed: bool,
    selection: Selection,
    /// Bytes read, and the total if known.
    bytes: Rc<Cell<u64>>,
    size: Option<u64>,
    /// Times of the first record and of the last one.
    span_us: Option<(u64, u64)>,
    interfaces: BTreeSet<Interface>,
    /// That of the last record.
    newest: Option<Interface>,
    records: u64,
    selected: u64,
    unreadable: u64,
    /// Why the file could not be read to its end.
    failure: Option<String>,
    shown: Instant,
}

/// An input that counts what is read from it, and that ends on a signal.
struct Counted {
    input: File,
    bytes: Rc<Cell<u64>>,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            if interrupt::asked() {
                return Ok(0);
            }
            let mut input = [PollFd::new(&self.input, PollFlags::IN)];
            match poll(&mut input, Some(&WATCH)) {
                Ok(0) | Err(rustix::io::Errno::INTR) => {}
                Ok(_) => break,
                Err(error) => return Err(error.into()),
            }
        }
        let read = self.input.read(buffer)?;
        self.bytes.set(self.bytes.get() + read as u64);
        Ok(read)
    }
}

impl Source {
    pub(super) fn open(path: &Path, selection: Selection) -> Result<Self, Failure> {
        if selection.is_backwards() {
            return Err(Failure::usage(
                "--to is before --from; allowed: a later time",
            ));
        }
        let mut name = path.display().to_string();
        let failed =
            |error: io::Error| Failure::usage(format!("cannot read {}: {error}", path.display()));
        let input = input(path).map_err(failed)?;
        if path == Path::new("-") {
            name = "standard input".into();
        }
        let data = input.metadata().map_err(failed)?;
        if data.is_dir() {
            return Err(Failure::usage(format!(
                "cannot read {name}: it is a folder"
            )));
        }
        let bytes = Rc::new(Cell::new(0));
        let mut input = Counted {
            input,
            bytes: Rc::clone(&bytes),
        };
        let mut head = Vec::new();
        input
            .by_ref()
            .take(GZIP.len() as u64)
            .read_to_end(&mut head)
            .map_err(failed)?;
        let packed = head == GZIP;
        let input = io::Cursor::new(head).chain(input);
        let input: Box<dyn Read> = if packed {
            Box::new(MultiGzDecoder::new(input))
        } else {
            Box::new(input)
        };
        Ok(Self {
            name,
            reader: Reader::new(BufReader::with_capacity(1 << 16, input)),
            packed,
            selection,
            bytes,
            size: Some(data.len()).filter(|&size| size > 0),
            span_us: None,
            interfaces: BTreeSet::new(),
            newest: None,
            records: 0,
            selected: 0,
            unreadable: 0,
            failure: None,
            shown: Instant::now(),
        })
    }

    /// The next line of a selected interface; `None` at the end.
    pub(super) fn line(&mut self) -> Option<Result<Record, Problem>> {
        loop {
            self.progress();
            match self.reader.next()? {
                Ok(record) => {
                    self.records += 1;
                    let (first, _) = self.span_us.unwrap_or((record.time_us, 0));
                    self.span_us = Some((first, record.time_us));
                    if self.newest != Some(record.interface) {
                        self.newest = Some(record.interface);
                        self.interfaces.insert(record.interface);
                    }
                    if self.selection.interface(&record) {
                        self.selected += u64::from(self.counts(&record));
                        return Some(Ok(record));
                    }
                }
                Err(_) if interrupt::asked() => return None,
                Err(ReadError::Line {
                    problem: problem @ Problem::Unterminated,
                    ..
                }) => {
                    say!("plant-sim: {}: {problem}; it is left out", self.place());
                }
                Err(ReadError::Line { problem, .. }) => return Some(Err(problem)),
                Err(error @ ReadError::Io { .. }) => {
                    let what = if self.packed {
                        ", in a gzip file that is cut off or damaged from here on"
                    } else {
                        ""
                    };
                    self.failure = Some(format!("{}: {error}{what}", self.name));
                    return None;
                }
            }
        }
    }

    /// The next record of a selected interface; unreadable lines are reported on standard error and skipped.
    pub(super) fn record_of_interface(&mut self) -> Option<Record> {
        loop {
            match self.line()? {
                Ok(record) => return Some(record),
                Err(problem) => {
                    self.unreadable += 1;
                    if self.unreadable <= SHOWN {
                        say!("plant-sim: {}: {problem}", self.place());
                    }
                }
            }
        }
    }

    /// The next selected record.
    pub(super) fn record(&mut self) -> Option<Record> {
        loop {
            let record = self.record_of_interface()?;
            if self.counts(&record) {
                return Some(record);
            }
        }
    }

    /// Whether the record's identifier and time are selected.
    pub(super) fn counts(&self, record: &Record) -> bool {
        let first_us = self.span_us.map_or(record.time_us, |(first, _)| first);
        self.selection.id(record) && self.selection.time(record, first_us)
    }

    /// Whether the next record has to be waited for.
    pub(super) fn is_drained(&self) -> bool {
        memchr(b'\n', self.reader.source().buffer()).is_none()
    }

    /// File and line read last.
    pub(super) fn place(&self) -> String {
        format!("{}:{}", self.name, self.reader.line())
    }

    /// Success only if the trace was not empty and every line could be read.
    pub(super) fn verdict(&self) -> Result<(), Failure> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone().into());
        }
        match self.unreadable {
            0 if self.selected == 0 => Err(self.nothing("the log is empty")),
            0 => Ok(()),
            lines => Err(Failure::failed(format!(
                "{}: {lines} lines could not be read, {} could",
                self.name, self.records
            ))),
        }
    }

    /// Reports that nothing was judged, and why: the selection is empty, or `what`.
    pub(super) fn nothing(&self, what: &str) -> Failure {
        let name = &self.name;
        match (self.selected, self.records) {
            (0, records @ 1..) => {
                let (first, last) = self.span_us.unwrap_or_default();
                let interfaces: Vec<String> =
                    self.interfaces.iter().map(Interface::to_string).collect();
                Failure::nothing_judged(format!(
                    "{name}: nothing judged: none of {records} records is selected; they are of {} and from {} to {} s",
                    interfaces.join(", "),
                    seconds(first),
                    seconds(last),
                ))
            }
            _ => Failure::nothing_judged(format!("{name}: nothing judged: {what}")),
        }
    }

    fn progress(&mut self) {
        if !self.records.is_multiple_of(LOOK) || self.shown.elapsed() < Duration::from_secs(2) {
            return;
        }
        self.shown = Instant::now();
        let share = self.size.map_or(String::new(), |size| {
            format!(" ({:.0} %)", self.bytes.get() as f64 / size as f64 * 100.0)
        });
        say!("{}: {} frames{share}", self.name, self.records);
    }
}

/// The file, or standard input for `-`: unbuffered, so that it can be waited for.
fn input(path: &Path) -> io::Result<File> {
    if path == Path::new("-") {
        io::stdin().as_fd().try_clone_to_owned().map(File::from)
    } else {
        File::open(path)
    }
}

/// Seconds as in the trace: a double has too few digits for microseconds since 1970.
fn seconds(time_us: u64) -> String {
    format!("{}.{:06}", time_us / 1_000_000, time_us % 1_000_000)
}
