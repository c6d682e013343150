//! The clock by which the drives take their samples, and what is broken in it.

use oorandom::Rand64;
use protocol::time::Duration;

/// What is wrong with the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClockDefect {
    /// It is fast by this share; slow below 0.
    Drift(f64),
    /// It loses this share of its ticks.
    Misses(f64),
}

/// The clock. Defects are in effect together.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    defects: Vec<(ClockDefect, Rand64)>,
}

impl Clock {
    /// Breaks or repairs it; `seed` is that of the ticks it loses.
    pub(crate) fn set(&mut self, defect: ClockDefect, seed: u64, is_broken: bool) {
        let defects = &mut self.defects;
        if is_broken {
            let seed = (defects.len() as u128) << 72 | u128::from(seed) << 8 | 0xC1;
            defects.push((defect, Rand64::new(seed)));
        } else if let Some(at) = defects.iter().position(|(other, _)| *other == defect) {
            defects.remove(at);
        }
    }

    /// Time until the next tick, of which there is one a `period` while it is sound.
    pub(crate) fn tick(&self, period: Duration) -> Duration {
        let mut nanos = period.nanos() as f64;
        for (defect, _) in &self.defects {
            if let ClockDefect::Drift(share) = defect {
                nanos /= 1.0 + share;
            }
        }
        Duration::from_nanos(nanos.round() as u64)
    }

    /// Whether the present tick is lost.
    pub(crate) fn misses(&mut self) -> bool {
        let mut missed = false;
        for (defect, random) in &mut self.defects {
            if let ClockDefect::Misses(share) = defect {
                missed |= random.rand_float() < *share;
            }
        }
        missed
    }
}
