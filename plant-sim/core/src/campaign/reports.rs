//! What the controller has told of faults.

use protocol::messages::{Cause, Mode};
use protocol::time::Instant;

use super::expect::stops_under_control;

/// The first report of each kind, and whether there were more.
#[derive(Clone, Debug, Default)]
pub(super) struct Reports {
    /// While torque was on: the fault is latched.
    latched: Option<(Instant, Cause)>,
    /// While it was off. That may be all that there is to it, as when the drives are gone.
    at_rest: Option<(Instant, Cause)>,
    /// Whether more was reported while the arm stopped, which closes the brake at once.
    escalated: bool,
}

impl Reports {
    /// Takes a report of a controller in this mode.
    pub(super) fn take(&mut self, time: Instant, cause: Cause, mode: Mode) {
        if is_at_rest(mode) {
            self.at_rest.get_or_insert((time, cause));
        } else {
            self.escalated |= self.latched.is_some();
            self.latched.get_or_insert((time, cause));
        }
    }

    /// When one was given that is latched.
    pub(super) fn latched(&self) -> Option<Instant> {
        self.latched.map(|(time, _)| time)
    }

    /// When the first was given, s.
    pub(super) fn first(&self) -> Option<f64> {
        let all = [self.latched, self.at_rest].into_iter().flatten();
        all.map(|(time, _)| time.seconds()).reduce(f64::min)
    }

    /// What was told.
    pub(super) fn told(&self) -> Option<Cause> {
        self.latched.or(self.at_rest).map(|(_, cause)| cause)
    }

    /// Whether that stops the arm under control.
    pub(super) fn ask_for_control(&self) -> bool {
        let told = self.latched.map(|(_, cause)| cause);
        !self.escalated && told.is_some_and(stops_under_control)
    }
}

/// Whether an arm is without torque in this mode, and no fault is latched.
pub(super) fn is_at_rest(mode: Mode) -> bool {
    matches!(mode, Mode::PreOperational | Mode::Ready)
}
