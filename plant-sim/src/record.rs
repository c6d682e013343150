//! A bus recorded into files: whole lines at any moment, a new file by size, and no existing file is replaced.
//!
//! A file grows as `NAME.part` and takes its name when it is complete, so that a file with its name is complete, and
//! the rest after a crash can still be read.

use std::cell::Cell;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use trace::convert::{Converter, Target};
use trace::{Entry, Record};

/// Why nothing, or nothing more, is recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The name is for a format that is not supported.
    #[error(
        "{} ends in {extension}; record writes candump logs (.log or any other name), Vector ASC (.asc) and pcapng (.pcapng)",
        path.display()
    )]
    Format {
        /// Requested name.
        path: PathBuf,
        /// Its extension.
        extension: String,
    },
    /// A device, a pipe, a folder or a link has this name.
    #[error("{} is not a regular file; record creates a new one: name another", .0.display())]
    NoFile(PathBuf),
    /// A recording has this name.
    #[error("{} exists, and a recording is never replaced; name another file or move it away", .0.display())]
    Exists(PathBuf),
    /// A file under construction has this name.
    #[error(
        "{} exists: it is being recorded, or left by a recording that was killed; its lines are whole, move it away",
        .0.display()
    )]
    Unfinished(PathBuf),
    /// The file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// File.
        path: PathBuf,
        /// Reason.
        source: io::Error,
    },
}

/// What has been recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Frames.
    pub frames: u64,
    /// Error frames reported by the CAN controller.
    pub error_frames: u64,
    /// Bytes.
    pub bytes: u64,
    /// Files, including the growing one.
    pub files: u32,
}

/// Writes records into a file, or into several one after another.
pub struct Recording {
    name: PathBuf,
    target: Target,
    /// Size at which the next file begins.
    rotate: Option<u64>,
    part: Option<Part>,
    recorded: Recorded,
}

/// The file that grows.
struct Part {
    converter: Converter<Counted>,
    bytes: Rc<Cell<u64>>,
    /// Name when it is complete.
    path: PathBuf,
}

impl Recording {
    /// Begins the first file. With `rotate` every file has its number before the extension, and the next begins when one
    /// has reached that many bytes.
    ///
    /// # Errors
    /// The file cannot be made, or something has its name.
    pub fn create(name: &Path, rotate: Option<u64>) -> Result<Self, RecordError> {
        let mut recording = Self {
            target: target(name)?,
            name: name.into(),
            rotate,
            part: None,
            recorded: Recorded::default(),
        };
        recording.part()?;
        Ok(recording)
    }

    /// Appends a record.
    ///
    /// # Errors
    /// It cannot be written, or the next file cannot be made.
    pub fn record(&mut self, record: &Record) -> Result<(), RecordError> {
        let part = self.part()?;
        let before = part.bytes.get();
        part.converter
            .record(record)
            .map_err(failed(&part.growing()))?;
        let size = part.bytes.get();
        self.recorded.bytes += size - before;
        match record.entry {
            Entry::Frame(_) => self.recorded.frames += 1,
            Entry::Error(_) => self.recorded.error_frames += 1,
        }
        if self.rotate.is_some_and(|rotate| size >= rotate) {
            self.close()?;
        }
        Ok(())
    }

    /// Flushes the file, so that its readers see everything so far.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        match &mut self.part {
            Some(part) => part.converter.flush().map_err(failed(&part.growing())),
            None => Ok(()),
        }
    }

    /// Counts so far.
    #[must_use]
    pub fn recorded(&self) -> Recorded {
        self.recorded
    }

    /// Completes the last file.
    ///
    /// # Errors
    /// It cannot be written, or something has taken its name.
    pub fn finish(mut self) -> Result<Recorded, RecordError> {
        self.close()?;
        Ok(self.recorded)
    }

    /// The growing file; the next one if the previous is complete.
    fn part(&mut self) -> Result<&mut Part, RecordError> {
        let part = match self.part.take() {
            Some(part) => part,
            None => {
                self.recorded.files += 1;
                let path = match self.rotate {
                    Some(_) => numbered(&self.name, self.recorded.files),
                    None => self.name.clone(),
                };
                let part = Part::create(path, self.target)?;
                self.recorded.bytes += part.bytes.get();
                part
            }
        };
        Ok(self.part.insert(part))
    }

    fn close(&mut self) -> Result<(), RecordError> {
        let Some(part) = self.part.take() else {
            return Ok(());
        };
        let before = part.bytes.get();
        let bytes = Rc::clone(&part.bytes);
        part.complete()?;
        self.recorded.bytes += bytes.get() - before;
        Ok(())
    }
}

impl Part {
    fn create(path: PathBuf, target: Target) -> Result<Self, RecordError> {
        refuse_taken(&path)?;
        let growing = growing(&path);
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&growing)
            .map_err(|source| match source.kind() {
                io::ErrorKind::AlreadyExists => RecordError::Unfinished(growing.clone()),
                _ => failed(&growing)(source),
            })?;
        let bytes = Rc::new(Cell::new(0));
        let sink = Counted {
            file: BufWriter::with_capacity(1 << 16, file),
            bytes: Rc::clone(&bytes),
        };
        let converter = Converter::new(sink, target).map_err(failed(&growing))?;
        Ok(Self {
            converter,
            bytes,
            path,
        })
    }

    fn growing(&self) -> PathBuf {
        growing(&self.path)
    }

    /// Syncs the file to disk before it takes its name.
    fn complete(self) -> Result<(), RecordError> {
        let growing = self.growing();
        let write = |converter: Converter<Counted>| converter.finish()?.file.get_ref().sync_all();
        write(self.converter).map_err(failed(&growing))?;
        refuse_taken(&self.path)?;
        fs::rename(&growing, &self.path).map_err(failed(&self.path))
    }
}

/// The format that goes with a name.
fn target(name: &Path) -> Result<Target, RecordError> {
    let extension = name.extension().unwrap_or_default().to_string_lossy();
    match extension.to_ascii_lowercase().as_str() {
        "asc" => Ok(Target::Asc),
        "pcapng" => Ok(Target::Pcapng),
        "blf" | "gz" | "pcap" | "mf4" | "trc" | "csv" => Err(RecordError::Format {
            path: name.into(),
            extension: format!(".{extension}"),
        }),
        _ => Ok(Target::Candump),
    }
}

/// Only an empty file may exist, as left by mktemp.
fn refuse_taken(path: &Path) -> Result<(), RecordError> {
    match fs::symlink_metadata(path) {
        Ok(data) if !data.is_file() => Err(RecordError::NoFile(path.into())),
        Ok(data) if data.len() > 0 => Err(RecordError::Exists(path.into())),
        _ => Ok(()),
    }
}

/// Name of a file while it grows.
fn growing(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// `trace-0001.log` for `trace.log`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number:04}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

fn failed(path: &Path) -> impl Fn(io::Error) -> RecordError {
    let path = path.to_path_buf();
    move |source| RecordError::Write {
        path: path.clone(),
        source,
    }
}

/// A file that counts what is written to it. The count is shared, since the file is inside a converter.
struct Counted {
    file: BufWriter<File>,
    bytes: Rc<Cell<u64>>,
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.bytes.set(self.bytes.get() + written as u64);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
