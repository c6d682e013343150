//! Our own faults: a panic is reported in one line and has an exit code of its own.

use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::OWN_FAULT;

/// Does the `work` of a program of this name and version, which returns the exit code. Should it panic, the person at the terminal gets one line with what a report
/// needs, files under construction are removed as the stack unwinds, and the code is [`OWN_FAULT`].
pub fn guard(program: &'static str, version: &'static str, work: impl FnOnce() -> u8) -> u8 {
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
            crate::say!("{program}: {}", report(version, fault));
        }
    }));
    panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or(OWN_FAULT)
}

fn report(version: &str, fault: &PanicHookInfo<'_>) -> String {
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
        "this is a fault of the program itself, version {version}, at {place}: {}. Please report this line with the \
         command that you typed",
        what.join(" ")
    )
}
