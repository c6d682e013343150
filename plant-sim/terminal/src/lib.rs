//! The programs and the person at the terminal: words on standard error, exit codes (docs/exit-codes.md), and faults of the
//! program itself.
//!
//! A standard error that is full, closed or a pipe without a reader loses the words, never the work: `eprintln!` would panic.

#![forbid(unsafe_code)]
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod arguments;
mod guard;

use std::fmt::Arguments;
use std::io::{self, Write as _};

pub use arguments::only_shown;
pub use guard::guard;

/// A run or a check failed, or the machine did not allow it.
pub const FAILED: u8 = 1;
/// Wrong usage or input; clap ends with it as well.
pub const USAGE: u8 = 2;
/// A fault of the program itself (`EX_SOFTWARE` of sysexits.h).
pub const OWN_FAULT: u8 = 70;

/// Writes one line.
pub fn line(words: Arguments<'_>) {
    let line = format!("{words}\n");
    // There is nobody else to say it to.
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

/// Writes one line to standard error, formatted as by `eprintln!`.
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => {
        $crate::line(format_args!($($words)*))
    };
}
