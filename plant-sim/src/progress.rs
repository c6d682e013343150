//! Progress of a run or a campaign on standard error.

use std::io::{self, IsTerminal as _, Write as _};
use std::time::{Duration, Instant};

use sim::observer::Observer;
use sim::world::CellEvent;

use crate::say;

/// Runs that are over sooner need none.
const PATIENCE: Duration = Duration::from_secs(1);
/// Between two lines on a terminal, each over the last.
const BLINK: Duration = Duration::from_millis(100);
/// Between two lines of a run where there is no terminal.
const PAUSE: Duration = Duration::from_secs(2);
/// The same of a campaign, whose lines a log keeps.
const LONG_PAUSE: Duration = Duration::from_secs(60);

/// Reports the progress of something long on standard error.
pub struct Progress {
    /// What is counted.
    unit: &'static str,
    pause: Duration,
    total: u64,
    done: u64,
    begun: Instant,
    /// When the last line was written.
    said: Instant,
    /// Whether it stands on a terminal.
    is_shown: bool,
}

impl Progress {
    /// At the start of a run of this many cycles.
    pub fn new(total: u32) -> Self {
        Self::counting("cycle", PAUSE, total.into())
    }

    /// At the start of a campaign of this many cases.
    pub fn of_cases(total: u64) -> Self {
        Self::counting("case", LONG_PAUSE, total)
    }

    /// At the start of a benchmark of this many rows.
    pub fn of_rows(total: u64) -> Self {
        Self::counting("row", PAUSE, total)
    }

    fn counting(unit: &'static str, pause: Duration, total: u64) -> Self {
        let now = Instant::now();
        Self {
            unit,
            pause,
            total,
            done: 0,
            begun: now,
            said: now,
            is_shown: false,
        }
    }

    /// So many more are done.
    pub fn add(&mut self, done: u64) {
        self.done += done;
        self.show();
    }

    fn show(&mut self) {
        if self.begun.elapsed() < PATIENCE {
            return;
        }
        let is_terminal = io::stderr().is_terminal();
        if self.said.elapsed() < if is_terminal { BLINK } else { self.pause } {
            return;
        }
        self.said = Instant::now();
        let (unit, done, total) = (self.unit, self.done, self.total);
        let left = self.begun.elapsed().as_secs_f64() / done as f64 * (total - done) as f64;
        let line = format!("{unit} {done} of {total}, {left:.0} s left");
        if is_terminal {
            over(&line);
            self.is_shown = true;
        } else {
            say!("{line}");
        }
    }
}

/// Writes over the line of the terminal.
fn over(line: &str) {
    // There is nobody else to say it to.
    let _ = write!(io::stderr(), "\r{line}\x1b[K");
}

impl Observer for Progress {
    fn cell_event(&mut self, event: &CellEvent) {
        if matches!(event, CellEvent::EndCycle) {
            self.add(1);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        // The summary takes its place.
        if self.is_shown {
            over("");
        }
    }
}
