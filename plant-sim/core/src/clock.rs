//! The clock by which the drives take their samples, when it is broken.

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

impl ClockDefect {
    /// A clock with this defect.
    pub(crate) fn seeded(self, seed: u64) -> BrokenClock {
        BrokenClock {
            defect: self,
            random: Rand64::new(u128::from(seed) << 8 | 0xC1),
        }
    }
}

/// A clock that is broken.
#[derive(Clone, Debug)]
pub struct BrokenClock {
    defect: ClockDefect,
    random: Rand64,
}

impl BrokenClock {
    /// Time until the next tick, of which there is one a `period` while `clock` is sound.
    pub(crate) fn tick(clock: &Option<Self>, period: Duration) -> Duration {
        match clock {
            Some(Self {
                defect: ClockDefect::Drift(share),
                ..
            }) => Duration::from_nanos((period.nanos() as f64 / (1.0 + share)).round() as u64),
            _ => period,
        }
    }

    /// Whether the present tick is lost.
    pub(crate) fn misses(clock: &mut Option<Self>) -> bool {
        match clock {
            Some(Self {
                defect: ClockDefect::Misses(share),
                random,
            }) => random.rand_float() < *share,
            _ => false,
        }
    }
}
