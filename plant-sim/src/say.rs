//! Words for the person at the terminal, on standard error.
//!
//! A standard error that is full, closed or a pipe without a reader loses the words, never the work: `eprintln!` would panic.

use std::fmt::Arguments;
use std::io::{self, Write as _};

/// Writes one line.
pub fn line(words: Arguments<'_>) {
    let line = format!("{words}\n");
    // There is no other place for the message.
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

/// Writes one line to standard error, formatted as by `eprintln!`.
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => {
        $crate::say::line(format_args!($($words)*))
    };
}
