//! Files that appear under their names once complete, all of a run together, or not at all.
//!
//! What is no regular file stays what it is: a character device and a FIFO are written to, everything else is refused.

mod place;

use std::fs::{self, FileType, Permissions, TryLockError};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use tempfile::NamedTempFile;

use place::{Place, folder, place};
pub use place::{distinct, refuse_tilde};

/// Bytes that are written at once: a trace and its truth take half a kilobyte per sample.
const BUFFER: usize = 1 << 16;

/// Results cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The system refuses.
    #[error("cannot write to {}: {source}", path.display())]
    Write {
        /// Where.
        path: PathBuf,
        /// Reason.
        #[source]
        source: io::Error,
    },
    /// Something else has this name.
    #[error("cannot write to {}: it is {what}; {hint}", path.display())]
    Taken {
        /// Where.
        path: PathBuf,
        /// What is there.
        what: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// Another run writes into the folder.
    #[error("another run is writing into {}; wait for it, or choose another folder by --out", path.display())]
    Locked {
        /// Folder.
        path: PathBuf,
    },
}

impl OutputError {
    fn at(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Write { path, source }
    }
}

/// A file under construction beside its destination. Dropped, it leaves no trace.
#[derive(Debug)]
pub struct File {
    sink: Sink,
    path: PathBuf,
}

#[derive(Debug)]
enum Sink {
    /// To be put in the place of a regular file, or where there was none.
    New(BufWriter<NamedTempFile>),
    /// What is there takes bytes as they come.
    Through(BufWriter<fs::File>),
}

impl File {
    /// An empty file destined for `path`.
    ///
    /// # Errors
    /// Its folder does not accept files.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        if path == Path::new("-") {
            return Err(OutputError::Taken {
                path: path.into(),
                what: "no name for a file here",
                hint: "leave the option out to write to standard output",
            });
        }
        refuse_tilde(path)?;
        let place = match place(path).map_err(OutputError::at(path))? {
            Place::File(_) => fs::canonicalize(path).map_err(OutputError::at(path))?,
            Place::Free => path.into(),
            Place::Stream => {
                return Ok(Self {
                    sink: Sink::Through(through(path)?),
                    path: path.into(),
                });
            }
            Place::Other(there) => return Err(taken(path, there, "name another file")),
        };
        Self::beside(place, ".partial-")
    }

    fn beside(path: PathBuf, prefix: &str) -> Result<Self, OutputError> {
        let file = tempfile::Builder::new()
            .prefix(prefix)
            // As with `std::fs::File::create`; the umask of the process applies.
            .permissions(Permissions::from_mode(0o666))
            .tempfile_in(folder(&path))
            .map_err(without_path)
            .map_err(OutputError::at(&path))?;
        Ok(Self {
            sink: Sink::New(BufWriter::with_capacity(BUFFER, file)),
            path,
        })
    }

    /// Moves the file to its destination.
    ///
    /// # Errors
    /// The rest could not be written, or a file at the destination cannot be replaced.
    pub fn persist(self) -> Result<(), OutputError> {
        let Self { sink, path } = self;
        match sink {
            Sink::Through(mut sink) => sink.flush(),
            Sink::New(file) => file
                .into_inner()
                .map_err(io::IntoInnerError::into_error)
                .and_then(|file| file.persist(&path).map_err(|error| error.error))
                .map(drop),
        }
        .map_err(OutputError::at(&path))
    }
}

impl Write for File {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.sink {
            Sink::New(sink) => sink.write(bytes),
            Sink::Through(sink) => sink.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.sink {
            Sink::New(sink) => sink.flush(),
            Sink::Through(sink) => sink.flush(),
        }
    }
}

/// An error of `tempfile`, which names the file under construction: nobody knows that one.
fn without_path(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path ") {
        Some((what, _)) => io::Error::new(error.kind(), what.to_owned()),
        None => error,
    }
}

/// A device or FIFO, opened. A FIFO that nobody reads would keep the program waiting.
fn through(path: &Path) -> Result<BufWriter<fs::File>, OutputError> {
    fs::OpenOptions::new()
        .write(true)
        .custom_flags(OFlags::NONBLOCK.bits().cast_signed())
        .open(path)
        .and_then(|file| {
            let flags = rustix::fs::fcntl_getfl(&file)?;
            rustix::fs::fcntl_setfl(&file, flags - OFlags::NONBLOCK)?;
            Ok(BufWriter::with_capacity(BUFFER, file))
        })
        .map_err(|error| match rustix::io::Errno::from_io_error(&error) {
            Some(rustix::io::Errno::NXIO) => OutputError::Taken {
                path: path.into(),
                what: "a FIFO or device with nobody at its other end",
                hint: "start its reader first",
            },
            _ => OutputError::at(path)(error),
        })
}

fn taken(path: &Path, there: FileType, hint: &'static str) -> OutputError {
    let what = match there {
        there if there.is_dir() => "a folder",
        there if there.is_symlink() => "a link",
        there if there.is_fifo() => "a FIFO",
        there if there.is_socket() => "a socket",
        there if there.is_block_device() || there.is_char_device() => "a device",
        _ => "a file",
    };
    OutputError::Taken {
        path: path.into(),
        what,
        hint,
    }
}

/// Writes a whole text to `path`, or nothing.
///
/// # Errors
/// See [`OutputError`].
pub fn write(path: &Path, text: &str) -> Result<(), OutputError> {
    finish(File::create(path)?, text)
}

/// Writes a whole text to a file that was created for it.
///
/// # Errors
/// See [`OutputError`].
pub fn finish(mut file: File, text: &str) -> Result<(), OutputError> {
    match file.write_all(text.as_bytes()) {
        Ok(()) => file.persist(),
        Err(source) => Err(OutputError::at(&file.path)(source)),
    }
}

/// What files under construction of a run are called; only a run that was killed leaves one.
const UNFINISHED: &str = ".unfinished-";

/// The folder of a run's results, locked against every other run.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    names: &'static [&'static str],
    /// Keeps the lock, which ends with the process at the latest.
    _lock: fs::File,
}

impl Folder {
    /// Creates the folder if missing.
    ///
    /// # Errors
    /// It cannot be created.
    pub fn open(path: &Path, names: &'static [&'static str]) -> Result<Self, OutputError> {
        refuse_tilde(path)?;
        if let Ok(there) = fs::metadata(path)
            && !there.is_dir()
        {
            return Err(taken(path, there.file_type(), "--out names a folder"));
        }
        if let (Err(_), Ok(link)) = (fs::metadata(path), fs::symlink_metadata(path)) {
            let hint = "it leads nowhere; --out names a folder";
            return Err(taken(path, link.file_type(), hint));
        }
        fs::create_dir_all(path).map_err(OutputError::at(path))?;
        let lock = fs::File::open(path).map_err(OutputError::at(path))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(OutputError::Locked { path: path.into() }),
            // Some network file systems have no locks of folders.
            Err(TryLockError::Error(error)) => crate::say!(
                "plant-sim: {} cannot be locked ({error}): see to it that no second run writes into it",
                path.display()
            ),
        }
        for name in names {
            let file = path.join(name);
            if let Ok(there) = fs::symlink_metadata(&file)
                && !there.is_file()
            {
                return Err(taken(
                    &file,
                    there.file_type(),
                    "remove it, or choose another folder by --out",
                ));
            }
        }
        Ok(Self {
            path: path.into(),
            names,
            _lock: lock,
        })
    }

    /// Removes the results of an older run, and what a run that was killed has left. What is here from now on is of one run.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn clear(&self) -> Result<(), OutputError> {
        let entries = fs::read_dir(&self.path).map_err(OutputError::at(&self.path))?;
        for entry in entries.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if self.names.contains(&&*name) || name.starts_with(UNFINISHED) {
                fs::remove_file(entry.path()).map_err(OutputError::at(&entry.path()))?;
            }
        }
        Ok(())
    }

    /// A file of this name, which has to be one of those that the folder was opened for.
    ///
    /// # Errors
    /// See [`File::create`].
    pub fn create(&self, name: &str) -> Result<File, OutputError> {
        debug_assert!(self.names.contains(&name), "{name} would not be cleared");
        File::beside(self.path.join(name), UNFINISHED)
    }

    /// A file of this name with a whole text in it, not yet in its place.
    ///
    /// # Errors
    /// See [`OutputError`].
    pub fn prepare(&self, name: &str, text: &str) -> Result<File, OutputError> {
        let mut file = self.create(name)?;
        file.write_all(text.as_bytes())
            .and_then(|()| file.flush())
            .map_err(|source| self.failed(source))?;
        Ok(file)
    }

    /// Writes a whole text to a file of this name, or nothing.
    ///
    /// # Errors
    /// See [`OutputError`].
    pub fn write(&self, name: &str, text: &str) -> Result<(), OutputError> {
        self.prepare(name, text)?.persist()
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The error that something in this folder could not be written.
    pub fn failed(&self, source: io::Error) -> OutputError {
        OutputError::at(&self.path)(source)
    }
}
