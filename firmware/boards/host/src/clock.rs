//! The controller's time.

use std::time;

use firmware::cabinet::sample_clock::SampleClock;
use protocol::frame::CanFrame;
use protocol::table;
use protocol::time::{Duration, Instant, Period};

/// Silence of the drives after which a clock in lock-step runs by itself. Longer than any pause of a loaded machine: a
/// plant that is computing must not look dead.
const LOCK_STEP_LIMIT: time::Duration = time::Duration::from_secs(1);

/// Source of the node's time.
pub(crate) enum Clock {
    /// The machine's clock, for drives that sample in real time.
    RealTime {
        /// Origin.
        started: time::Instant,
    },
    /// The drives' samples, for a plant in lock-step.
    LockStep {
        /// Time.
        clock: SampleClock,
        /// Sampling period.
        period: Period,
        /// Last sign of the plant, or the last time the clock was advanced without one.
        heard: time::Instant,
        /// Whether the plant is there.
        present: bool,
    },
}

impl Clock {
    pub(crate) fn real_time() -> Self {
        Self::RealTime {
            started: time::Instant::now(),
        }
    }

    pub(crate) fn lock_step(period: Period) -> Self {
        Self::LockStep {
            clock: SampleClock::new(period),
            period,
            heard: time::Instant::now(),
            present: false,
        }
    }

    /// Present time.
    pub(crate) fn now(&self) -> Instant {
        match self {
            Self::RealTime { started } => Instant::from_nanos(started.elapsed().as_nanos() as u64),
            Self::LockStep { clock, .. } => clock.now(),
        }
    }

    /// A node starts at 0 in lock-step, whatever the cause, so that every run is the same from there.
    pub(crate) fn restart(&mut self) {
        if let Self::LockStep {
            clock,
            period,
            heard,
            present,
        } = self
        {
            *clock = SampleClock::new(*period);
            *heard = time::Instant::now();
            *present = true;
        }
    }

    /// Looks at a frame before the node does. Returns whether the node has to be polled for the
    /// time first.
    pub(crate) fn observe(&mut self, frame: &CanFrame) -> bool {
        if let Self::LockStep {
            clock,
            heard,
            present,
            ..
        } = self
            && is_feedback(frame)
        {
            *heard = time::Instant::now();
            *present = true;
            return clock.observe(frame);
        }
        false
    }

    /// Time passes without frames. Returns whether the node has to check its watchdogs.
    pub(crate) fn idle(&mut self) -> bool {
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
                *heard = time::Instant::now();
                clock.elapse(Duration::from_nanos(silent.as_nanos() as u64));
                true
            }
        }
    }
}

pub(crate) fn is_feedback(frame: &CanFrame) -> bool {
    table::FEEDBACK.identifies(frame)
}
