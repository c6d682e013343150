//! A trace as input: file or standard input, with progress and with bad lines named.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::process::ExitCode;
use std::rc::Rc;
use std::time::{Duration, Instant};

use trace::{Problem, ReadError, Reader, Record};

/// Unreadable lines that are shown; of more, only the number is.
const SHOWN: u64 = 10;
/// Records between two looks at the clock.
const LOOK: u64 = 1 << 14;

/// A trace that is read from front to end, with its progress on standard error.
pub(super) struct Source {
    name: String,
    reader: Reader<BufReader<Counted>>,
    /// Bytes read, and bytes there are if that is known.
    bytes: Rc<Cell<u64>>,
    size: Option<u64>,
    records: u64,
    unreadable: u64,
    shown: Instant,
}

/// An input that counts what is read from it.
struct Counted {
    input: Box<dyn Read>,
    bytes: Rc<Cell<u64>>,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.input.read(buffer)?;
        self.bytes.set(self.bytes.get() + read as u64);
        Ok(read)
    }
}

impl Source {
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        let mut name = path.display().to_string();
        let (input, size): (Box<dyn Read>, _) = if path == Path::new("-") {
            name = "standard input".into();
            (Box::new(io::stdin()), None)
        } else {
            let file = File::open(path).map_err(|error| format!("cannot read {name}: {error}"))?;
            let size = file.metadata().map(|data| data.len()).ok();
            (Box::new(file), size.filter(|&size| size > 0))
        };
        let bytes = Rc::new(Cell::new(0));
        let input = Counted {
            input,
            bytes: Rc::clone(&bytes),
        };
        Ok(Self {
            name,
            reader: Reader::new(BufReader::with_capacity(1 << 16, input)),
            bytes,
            size,
            records: 0,
            unreadable: 0,
            shown: Instant::now(),
        })
    }

    /// The next line as it is; `Err` if the file cannot be read.
    pub(super) fn line(&mut self) -> Result<Option<Result<Record, Problem>>, String> {
        self.progress();
        match self.reader.next() {
            None => Ok(None),
            Some(Ok(record)) => {
                self.records += 1;
                Ok(Some(Ok(record)))
            }
            Some(Err(ReadError::Line { problem, .. })) => Ok(Some(Err(problem))),
            Some(Err(error @ ReadError::Io { .. })) => Err(format!("{}: {error}", self.name)),
        }
    }

    /// The next record; lines that cannot be read are named on standard error and left out.
    pub(super) fn record(&mut self) -> Result<Option<Record>, String> {
        loop {
            match self.line()? {
                None => return Ok(None),
                Some(Ok(record)) => return Ok(Some(record)),
                Some(Err(problem)) => {
                    self.unreadable += 1;
                    if self.unreadable <= SHOWN {
                        eprintln!("plant-sim: {}: {problem}", self.place());
                    }
                }
            }
        }
    }

    /// File and line read last.
    pub(super) fn place(&self) -> String {
        format!("{}:{}", self.name, self.reader.line())
    }

    /// Success only if every line could be read.
    pub(super) fn verdict(&self) -> Result<ExitCode, String> {
        match self.unreadable {
            0 => Ok(ExitCode::SUCCESS),
            lines => Err(format!(
                "{}: {lines} of {} lines could not be read",
                self.name,
                self.reader.line() - 1
            )),
        }
    }

    fn progress(&mut self) {
        if !self.reader.line().is_multiple_of(LOOK) || self.shown.elapsed() < Duration::from_secs(2)
        {
            return;
        }
        self.shown = Instant::now();
        let share = self.size.map_or(String::new(), |size| {
            format!(" ({:.0} %)", self.bytes.get() as f64 / size as f64 * 100.0)
        });
        eprintln!("{}: {} frames{share}", self.name, self.records);
    }
}
