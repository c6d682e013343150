//! What the controller has told of faults.

use protocol::messages::{Cause, Mode};
use protocol::time::Instant;

use super::expect::stops_under_control;

/// The first report of each kind, and whether there were more.
#[derive(Clone, Debug, Default)]
pub(super) struct Reports {
    /// The fault is latched.
    latched: Option<(Instant, Cause)>,
    /// Whether it was told of an arm without torque. That may be all that there is to it, as when the drives are gone.
    at_rest: bool,
    /// Whether the arm was without torque before any fault.
    is_off: bool,
    /// Whether more was reported while the arm stopped, which closes the brake at once.
    escalated: bool,
}

impl Reports {
    /// Looks at the mode of the controller in a sample.
    pub(super) fn look(&mut self, mode: Mode) {
        // That of a fault may be there before its report.
        if !is_faulty(mode) {
            self.is_off = is_at_rest(mode);
        }
    }

    /// Takes a report.
    pub(super) fn take(&mut self, time: Instant, cause: Cause) {
        self.escalated |= self.latched.is_some();
        self.repeat(time, cause);
    }

    /// Takes what State says of the first cause: where its own report was lost, that tells it.
    pub(super) fn repeat(&mut self, time: Instant, cause: Cause) {
        self.at_rest |= self.latched.is_none() && self.is_off;
        self.latched.get_or_insert((time, cause));
    }

    /// When one was given that is latched.
    pub(super) fn latched(&self) -> Option<Instant> {
        self.latched.map(|(time, _)| time)
    }

    /// The same, s.
    pub(super) fn first(&self) -> Option<f64> {
        self.latched().map(Instant::seconds)
    }

    /// What was told.
    pub(super) fn told(&self) -> Option<Cause> {
        self.latched.map(|(_, cause)| cause)
    }

    /// Whether that was of an arm without torque.
    pub(super) fn is_at_rest(&self) -> bool {
        self.at_rest
    }

    /// Whether that stops the arm under control.
    pub(super) fn ask_for_control(&self) -> bool {
        let told = self.latched.map(|(_, cause)| cause);
        !self.escalated && told.is_some_and(stops_under_control)
    }
}

/// Whether an arm is without torque in this mode, and no fault is latched yet.
pub(super) fn is_at_rest(mode: Mode) -> bool {
    matches!(mode, Mode::PreOperational | Mode::Ready)
}

/// Whether a fault is latched in this mode.
pub(super) fn is_faulty(mode: Mode) -> bool {
    matches!(mode, Mode::FaultReaction | Mode::Fault | Mode::EStop)
}
