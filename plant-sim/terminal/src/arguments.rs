//! Help, the version, and what is wrong with a command line.

use std::io::{self, Write as _};

use crate::{FAILED, USAGE, say};

/// The exit code of a program of this name that has only `shown` something, and ends with `code` if that arrived. On standard
/// output it has to.
pub fn only_shown(program: &str, code: i32, shown: io::Result<()>, is_error: bool) -> u8 {
    match shown.and_then(|()| io::stdout().flush()) {
        // A reader that has closed the pipe (`| head`) is not an error.
        Err(lost) if !is_error && lost.kind() != io::ErrorKind::BrokenPipe => {
            say!("{program}: cannot write to standard output: {lost}");
            FAILED
        }
        _ => u8::try_from(code).unwrap_or(USAGE),
    }
}
