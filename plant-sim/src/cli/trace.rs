//! `plant-sim trace`: looks into recorded traces.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::rc::Rc;
use std::time::{Duration, Instant};

use clap::{Args, Subcommand, ValueEnum};
use plant_sim::trace::decode::{Decoder, Format};
use plant_sim::trace::{Problem, ReadError, Reader, Record};

/// Subcommands of `trace`.
#[derive(Subcommand)]
pub enum TraceCommand {
    /// Name every field of every frame, with its unit.
    Decode(DecodeArgs),
}

/// Arguments of `decode`.
#[derive(Args)]
pub struct DecodeArgs {
    /// candump log, or - for standard input.
    file: PathBuf,
    /// How it is written.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    format: FormatChoice,
}

#[derive(Clone, Copy, ValueEnum)]
enum FormatChoice {
    /// A line for each frame.
    Text,
    /// A row for each field.
    Csv,
    /// An object for each frame.
    Jsonl,
}

/// Does what the subcommand says.
pub fn run(command: &TraceCommand) -> Result<ExitCode, String> {
    match command {
        TraceCommand::Decode(args) => decode(args),
    }
}

fn decode(args: &DecodeArgs) -> Result<ExitCode, String> {
    let format = match args.format {
        FormatChoice::Text => Format::Text,
        FormatChoice::Csv => Format::Csv,
        FormatChoice::Jsonl => Format::JsonLines,
    };
    let mut source = Source::open(&args.file)?;
    let mut decoder = or_gone(Decoder::new(stdout(), format))?;
    while let Some(record) = source.record()?
        && let Some(open) = &mut decoder
    {
        if or_gone(open.record(&record))?.is_none() {
            decoder = None;
        }
    }
    if let Some(decoder) = decoder {
        or_gone(decoder.finish())?;
    }
    source.verdict()
}

fn stdout() -> impl Write {
    BufWriter::with_capacity(1 << 16, io::stdout().lock())
}

/// The result, or `None` when the reader of standard output has seen enough and gone (`| head`).
fn or_gone<T>(result: io::Result<T>) -> Result<Option<T>, String> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(None),
        Err(error) => Err(format!("cannot write to standard output: {error}")),
    }
}

/// Unreadable lines that are shown; of more, only the number is.
const SHOWN: u64 = 10;
/// Records between two looks at the clock.
const LOOK: u64 = 1 << 14;

/// A trace that is read from front to end, with its progress on standard error.
struct Source {
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
    fn open(path: &Path) -> Result<Self, String> {
        let name = path.display().to_string();
        let (input, size): (Box<dyn Read>, _) = if path == Path::new("-") {
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
    fn line(&mut self) -> Result<Option<Result<Record, Problem>>, String> {
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
    fn record(&mut self) -> Result<Option<Record>, String> {
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
    fn place(&self) -> String {
        format!("{}:{}", self.name, self.reader.line())
    }

    /// Success only if every line could be read.
    fn verdict(&self) -> Result<ExitCode, String> {
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
