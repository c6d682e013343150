//! Signals that ask a subcommand to end with what it has: Ctrl-C, SIGTERM, SIGHUP.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a process that its second Ctrl-C ended.
const INTERRUPTED: i32 = 130;

/// Whether a signal has asked for the end.
static STOP: AtomicBool = AtomicBool::new(false);

/// From now on the first signal is for [`has_come`]; a second one ends the process.
pub(super) fn end_on_signal() -> Result<(), String> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            process::exit(INTERRUPTED);
        }
    })
    .map_err(|error| format!("cannot take signals: {error}"))
}

/// Whether the subcommand is to end.
pub(super) fn has_come() -> bool {
    STOP.load(Ordering::Relaxed)
}
