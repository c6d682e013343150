//! Files that appear under their names once complete, all of a run together, or not at all.

use std::fs::{self, Permissions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Results cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write to {}: {source}", path.display())]
pub struct OutputError {
    /// Path.
    pub path: PathBuf,
    /// Reason.
    #[source]
    pub source: io::Error,
}

impl OutputError {
    fn at(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self { path, source }
    }
}

/// A file under construction beside its destination. Dropped, it leaves no trace.
#[derive(Debug)]
pub struct File {
    file: BufWriter<NamedTempFile>,
    path: PathBuf,
}

impl File {
    /// An empty file destined for `path`.
    ///
    /// # Errors
    /// Its folder does not accept files.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let file = tempfile::Builder::new()
            .prefix(".partial-")
            // As with `std::fs::File::create`; the umask of the process applies.
            .permissions(Permissions::from_mode(0o666))
            .tempfile_in(folder)
            .map_err(OutputError::at(path))?;
        Ok(Self {
            file: BufWriter::new(file),
            path: path.into(),
        })
    }

    /// Moves the file to its destination.
    ///
    /// # Errors
    /// The rest could not be written, or a file at the destination cannot be replaced.
    pub fn persist(self) -> Result<(), OutputError> {
        let Self { file, path } = self;
        file.into_inner()
            .map_err(io::IntoInnerError::into_error)
            .and_then(|file| file.persist(&path).map_err(|error| error.error))
            .map_err(OutputError::at(&path))?;
        Ok(())
    }
}

impl Write for File {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Writes a whole text to `path`, or nothing.
///
/// # Errors
/// See [`OutputError`].
pub fn write(path: &Path, text: &str) -> Result<(), OutputError> {
    let mut file = File::create(path)?;
    file.write_all(text.as_bytes())
        .map_err(OutputError::at(path))?;
    file.persist()
}

/// The folder of a run's results.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// Creates the folder if missing.
    ///
    /// # Errors
    /// It cannot be created.
    pub fn open(path: &Path) -> Result<Self, OutputError> {
        fs::create_dir_all(path).map_err(OutputError::at(path))?;
        Ok(Self(path.into()))
    }

    /// A file of this name.
    ///
    /// # Errors
    /// See [`File::create`].
    pub fn create(&self, name: &str) -> Result<File, OutputError> {
        File::create(&self.0.join(name))
    }

    /// Writes a whole text to a file of this name, or nothing.
    ///
    /// # Errors
    /// See [`OutputError`].
    pub fn write(&self, name: &str, text: &str) -> Result<(), OutputError> {
        write(&self.0.join(name), text)
    }

    /// The error that something in this folder could not be written.
    pub fn failed(&self, source: io::Error) -> OutputError {
        OutputError {
            path: self.0.clone(),
            source,
        }
    }
}
