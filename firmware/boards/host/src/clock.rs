//! What time it is for the controller.

use std::time::{Duration, Instant};

use firmware::cabinet::sample_clock::SampleClock;
use protocol::frame::CanFrame;
use protocol::table;

/// Silence of the drives after which a clock in lock-step runs by itself. Longer than any pause of a loaded machine: a
/// plant that only computes must not look as if it had died.
const LOCK_STEP_LIMIT: Duration = Duration::from_secs(1);

/// Source of the time that the node is given.
pub enum Clock {
    /// The machine's: for drives that sample in real time.
    RealTime {
        /// Origin.
        started: Instant,
    },
    /// The drives' samples: for a plant in lock-step.
    LockStep {
        /// Time.
        clock: SampleClock,
        /// Sampling period, ns.
        period_ns: u64,
        /// Last sign of the plant, or the last time that the clock was moved on without one.
        heard: Instant,
        /// Whether the plant is there.
        present: bool,
    },
}

impl Clock {
    pub fn real_time() -> Self {
        Self::RealTime {
            started: Instant::now(),
        }
    }

    pub fn lock_step(period_ns: u64) -> Self {
        Self::LockStep {
            clock: SampleClock::new(period_ns),
            period_ns,
            heard: Instant::now(),
            present: false,
        }
    }

    /// Present time, us.
    pub fn now(&self) -> u64 {
        match self {
            Self::RealTime { started } => started.elapsed().as_micros() as u64,
            Self::LockStep { clock, .. } => clock.now(),
        }
    }

    /// A node starts at 0 in lock-step, whoever asked for it: what follows is the same in every run.
    pub fn restart(&mut self) {
        if let Self::LockStep {
            clock,
            period_ns,
            heard,
            present,
        } = self
        {
            *clock = SampleClock::new(*period_ns);
            *heard = Instant::now();
            *present = true;
        }
    }

    /// Looks at a frame before the node does.
    pub fn observe(&mut self, frame: &CanFrame) {
        if let Self::LockStep {
            clock,
            heard,
            present,
            ..
        } = self
            && is_feedback(frame)
        {
            clock.observe(frame);
            *heard = Instant::now();
            *present = true;
        }
    }

    /// Time passes without frames. Returns whether the node is to look at its watchdogs.
    pub fn idle(&mut self) -> bool {
        match self {
            Self::RealTime { .. } => true,
            Self::LockStep {
                clock,
                heard,
                present,
                ..
            } => {
                let silent = heard.elapsed();
                if *present && silent < LOCK_STEP_LIMIT {
                    return false;
                }
                *present = false;
                *heard = Instant::now();
                clock.elapse(silent.as_nanos() as u64);
                true
            }
        }
    }
}

pub fn is_feedback(frame: &CanFrame) -> bool {
    table::FEEDBACK.identifies(frame)
}
