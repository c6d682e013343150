//! The observer that reports the progress of a run.

use std::io::{self, IsTerminal as _};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sim::observer::Observer;
use sim::world::CellEvent;

use crate::say;

/// Runs that are over sooner need none.
const PATIENCE: Duration = Duration::from_secs(1);
/// Between two lines where there is no terminal.
const PAUSE: Duration = Duration::from_secs(2);

/// Reports the progress of a long run on standard error.
pub struct Progress {
    total: u32,
    done: u32,
    begun: Instant,
    /// When the last line was written, where there is no terminal.
    said: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// At the start of a run of this many cycles.
    pub fn new(total: u32) -> Self {
        let now = Instant::now();
        Self {
            total,
            done: 0,
            begun: now,
            said: now,
            bar: None,
        }
    }

    fn show(&mut self) {
        if self.begun.elapsed() < PATIENCE {
            return;
        }
        if io::stderr().is_terminal() {
            let (total, begun) = (self.total, self.begun);
            let bar = self.bar.get_or_insert_with(|| bar(total, begun));
            bar.set_position(self.done.into());
        } else if self.said.elapsed() >= PAUSE {
            self.said = Instant::now();
            let left = self.begun.elapsed().as_secs_f64() / f64::from(self.done)
                * f64::from(self.total - self.done);
            say!("cycle {} of {}, {left:.0} s left", self.done, self.total);
        }
    }
}

fn bar(total: u32, begun: Instant) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{wide_bar} cycle {human_pos} of {human_len}, {eta} left")
            .expect("the template is valid")
            .progress_chars("=> ");
    ProgressBar::with_draw_target(Some(total.into()), ProgressDrawTarget::stderr())
        .with_style(style)
        .with_elapsed(begun.elapsed())
}

impl Observer for Progress {
    fn cell_event(&mut self, event: &CellEvent) {
        if matches!(event, CellEvent::EndCycle) {
            self.done += 1;
            self.show();
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
