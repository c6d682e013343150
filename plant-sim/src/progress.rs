//! Progress of a run or a campaign on standard error.

use std::io::{self, IsTerminal as _};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sim::observer::Observer;
use sim::world::CellEvent;

use crate::say;

/// Runs that are over sooner need none.
const PATIENCE: Duration = Duration::from_secs(1);
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
    /// When the last line was written, where there is no terminal.
    said: Instant,
    bar: Option<ProgressBar>,
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
            bar: None,
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
        if io::stderr().is_terminal() {
            let (unit, total, begun) = (self.unit, self.total, self.begun);
            let bar = self.bar.get_or_insert_with(|| bar(unit, total, begun));
            bar.set_position(self.done);
        } else if self.said.elapsed() >= self.pause {
            self.said = Instant::now();
            let left = self.begun.elapsed().as_secs_f64() / self.done as f64
                * (self.total - self.done) as f64;
            say!(
                "{} {} of {}, {left:.0} s left",
                self.unit,
                self.done,
                self.total
            );
        }
    }
}

fn bar(unit: &str, total: u64, begun: Instant) -> ProgressBar {
    let template = format!("{{wide_bar}} {unit} {{human_pos}} of {{human_len}}, {{eta}} left");
    let style = ProgressStyle::with_template(&template)
        .expect("the template is valid")
        .progress_chars("=> ");
    ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr())
        .with_style(style)
        .with_elapsed(begun.elapsed())
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
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
