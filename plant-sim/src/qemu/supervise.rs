//! The thread that supervises the emulator.

use std::io::{self, Read};
use std::process::{Child, ExitStatus};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// Interval of checking on the child.
const LOOK: Duration = Duration::from_millis(20);
/// Checks without an answer after which the board counts as hung: 20 s. An answer takes microseconds.
const PATIENCE: u32 = 1000;
/// The same once the channel is closed, when somebody waits for the end.
const CLOSE_LOOK: Duration = Duration::from_millis(1);
/// Such checks for which a child may end by itself: 2 s.
const FAREWELL: u32 = 2000;

/// State shared with the supervising thread.
#[derive(Debug, Default)]
pub(super) struct Watch {
    pub(super) waiting: AtomicBool,
    pub(super) answers: AtomicU64,
    pub(super) closing: AtomicBool,
}

/// How the emulation ended.
#[derive(Debug)]
pub(super) enum Ended {
    ByItself(io::Result<ExitStatus>, String),
    Hung,
}

/// Waits for the child to end, and makes sure that it does.
pub(super) fn supervise(mut child: Child, watch: &Watch) -> Ended {
    let mut seen = (0, 0);
    let mut farewell = 0;
    loop {
        match child.try_wait() {
            Ok(None) => {}
            Ok(Some(status)) => break Ended::ByItself(Ok(status), said(&mut child)),
            Err(error) => break Ended::ByItself(Err(error), String::new()),
        }
        let answers = watch.answers.load(Ordering::Relaxed);
        seen = match seen {
            (last, looks) if last == answers && watch.waiting.load(Ordering::Relaxed) => {
                (last, looks + 1)
            }
            _ => (answers, 0),
        };
        let is_closing = watch.closing.load(Ordering::Relaxed);
        farewell += u32::from(is_closing);
        if seen.1 > PATIENCE || farewell > FAREWELL {
            // SIGKILL: a blocked emulator ignores anything less.
            let _ = child.kill();
            let _ = child.wait();
            break Ended::Hung;
        }
        thread::park_timeout(if is_closing { CLOSE_LOOK } else { LOOK });
    }
}

/// Standard error of a child that has ended.
fn said(child: &mut Child) -> String {
    let mut text = String::new();
    if let Some(stderr) = &mut child.stderr {
        let _ = stderr.read_to_string(&mut text);
    }
    text
}
