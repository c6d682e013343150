//! Signals that end a subcommand with its results so far: Ctrl-C, SIGTERM, SIGHUP.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a process ended by a second Ctrl-C.
const INTERRUPTED: i32 = 130;

/// Whether a signal has requested the end.
static STOP: AtomicBool = AtomicBool::new(false);

/// From now on the first signal is for [`has_come`]; a second one ends the process.
pub(super) fn end_on_signal() -> Result<(), String> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            process::exit(INTERRUPTED);
        }
    })
    .map_err(|error| format!("cannot handle signals: {error}"))
}

/// Whether the subcommand has to end.
pub(super) fn has_come() -> bool {
    STOP.load(Ordering::Relaxed)
}
