//! The observer that reports the progress of a run.

use std::time::Instant;

use sim::observer::Observer;
use sim::world::CellEvent;

/// Reports the progress of a long run on standard error.
pub struct Progress {
    total: u32,
    done: u32,
    shown: Instant,
}

impl Progress {
    /// At the start of a run of this many cycles.
    pub fn new(total: u32) -> Self {
        Self {
            total,
            done: 0,
            shown: Instant::now(),
        }
    }
}

impl Observer for Progress {
    fn cell_event(&mut self, event: &CellEvent) {
        if matches!(event, CellEvent::EndCycle) {
            self.done += 1;
            if self.shown.elapsed().as_secs() >= 2 {
                self.shown = Instant::now();
                eprintln!("cycle {} of {}", self.done, self.total);
            }
        }
    }
}
