//! Where paths lead, and which of them lead to the same file.

use std::ffi::OsString;
use std::fs::{self, FileType, Metadata};
use std::io;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};

use super::OutputError;

/// Refuses a path from the home folder of which the shell has left the tilde, and which would make a folder of that name.
///
/// # Errors
/// [`OutputError::Taken`].
pub fn refuse_tilde(path: &Path) -> Result<(), OutputError> {
    let home = path
        .iter()
        .next()
        .filter(|first| first.as_encoded_bytes().starts_with(b"~"));
    match home {
        Some(home) if !Path::new(home).exists() => Err(OutputError::Taken {
            path: path.into(),
            what: "a path with a ~ that the shell has left as it is",
            hint: "write it without quotes and after a blank, or write $HOME",
        }),
        _ => Ok(()),
    }
}

/// Refuses outputs of a command that would replace one of its inputs or each other. Inputs that are no files do not matter.
///
/// # Errors
/// [`OutputError::Taken`].
pub fn distinct<'p>(
    inputs: impl IntoIterator<Item = &'p Path>,
    outputs: impl IntoIterator<Item = &'p Path>,
) -> Result<(), OutputError> {
    let inputs = inputs.into_iter().filter_map(identity);
    let mut known: Vec<_> = inputs
        .map(|file| (file, "an input of this command"))
        .collect();
    for path in outputs {
        let Some(file) = identity(path) else {
            continue;
        };
        if let Some(&(_, what)) = known.iter().find(|(other, _)| *other == file) {
            return Err(OutputError::Taken {
                path: path.into(),
                what,
                hint: "name another file",
            });
        }
        known.push((file, "another output of this command"));
    }
    Ok(())
}

/// What tells one regular file from another, whatever it is called, and one that is not there yet from others of its folder.
#[derive(PartialEq)]
enum Identity {
    There { device: u64, number: u64 },
    New { folder: PathBuf, name: OsString },
}

/// `None` for what is no regular file: several outputs may go to one device.
fn identity(path: &Path) -> Option<Identity> {
    match place(path).ok()? {
        Place::File(there) => Some(Identity::There {
            device: there.dev(),
            number: there.ino(),
        }),
        Place::Free => Some(Identity::New {
            folder: fs::canonicalize(folder(path)).ok()?,
            name: path.file_name()?.into(),
        }),
        Place::Stream | Place::Other(_) => None,
    }
}

/// Where a path leads.
pub(super) enum Place {
    /// To a regular file.
    File(Metadata),
    /// To nothing yet.
    Free,
    /// To what takes bytes as they come.
    Stream,
    /// To anything else, or to nothing through a link.
    Other(FileType),
}

pub(super) fn place(path: &Path) -> io::Result<Place> {
    match fs::metadata(path) {
        Ok(there) if there.is_file() => Ok(Place::File(there)),
        Ok(there) => Ok(match there.file_type() {
            kind if kind.is_char_device() || kind.is_fifo() => Place::Stream,
            kind => Place::Other(kind),
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Ok(fs::symlink_metadata(path)
                .map_or(Place::Free, |link| Place::Other(link.file_type())))
        }
        Err(error) => Err(error),
    }
}

/// The folder of a file.
pub(super) fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
