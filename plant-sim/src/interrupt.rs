//! Ctrl-C and SIGTERM: the first asks for an orderly end, the second ends the process.

use std::io;
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};

use protocol::time::Instant;
use sim::observer::Pace;

/// Exit code of a process that its second signal has ended.
const INTERRUPTED: i32 = 130;

static ASKED: AtomicBool = AtomicBool::new(false);

/// From now on the first signal is noted and the second ends the process.
///
/// # Errors
/// The system does not allow it, or this was called before.
pub fn listen() -> Result<(), String> {
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            process::exit(INTERRUPTED);
        }
    })
    .map_err(|error| format!("cannot take signals: {error}"))
}

/// Whether a signal has asked for the end.
pub fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// The error of work that a signal has ended.
pub fn error() -> io::Error {
    io::Error::other("ended by a signal (Ctrl-C, SIGTERM or SIGHUP)")
}

/// A pace that ends the run when a signal asks for it.
#[derive(Debug)]
pub struct Heeding<'p, P>(pub &'p mut P);

impl<P: Pace> Pace for Heeding<'_, P> {
    fn sample(&mut self, now: Instant) -> io::Result<()> {
        if asked() {
            return Err(error());
        }
        self.0.sample(now)
    }
}
