//! Our own faults: a panic is reported in one line and has an exit code of its own.

use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a program that has run into a fault of its own (`EX_SOFTWARE` of sysexits.h).
pub const OWN_FAULT: u8 = 70;

/// Does `work`, which returns the exit code. Should it panic, the person at the terminal gets one line with what a report
/// needs, files under construction are removed as the stack unwinds, and the code is [`OWN_FAULT`].
pub fn guard(work: impl FnOnce() -> u8) -> u8 {
    let backtrace = std::env::var_os("RUST_BACKTRACE").is_some();
    let default = panic::take_hook();
    let reported = AtomicBool::new(false);
    panic::set_hook(Box::new(move |fault| {
        // Those who ask for a backtrace want it from every thread.
        if backtrace {
            default(fault);
        }
        // A panic in a thread makes the one that waits for it panic as well.
        if !reported.swap(true, Ordering::Relaxed) {
            crate::say!("{}", report(fault));
        }
    }));
    panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or(OWN_FAULT)
}

fn report(fault: &PanicHookInfo<'_>) -> String {
    let payload = fault.payload();
    let what = payload
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| payload.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    // An assertion has several lines.
    let what: Vec<&str> = what.split_whitespace().collect();
    let place = fault.location().map_or("an unknown place".into(), |place| {
        format!("{}:{}", place.file(), place.line())
    });
    format!(
        "plant-sim: this is a fault of the program itself, version {}, at {place}: {}. Please report this line with the \
         command that you typed",
        env!("VERSION_AND_COMMIT"),
        what.join(" ")
    )
}
