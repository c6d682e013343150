//! The command that the drives obey.

use protocol::messages::{Command, ControlWord, DriveStatus};
use protocol::time::{Duration, Instant, Period};

use super::expect::{held, is_taken};

/// A command that is older than the newest by so many samples answers drives that have started anew.
const RESTARTED: u32 = 100;

/// The newest command, its sender being alive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Newest {
    /// What it switches.
    pub(super) control: ControlWord,
    /// Its time.
    pub(super) time: Instant,
    /// The sample that it answers.
    sample: Option<u32>,
    period: Period,
    /// Since when the brake is open that is to be closed.
    open: Option<Instant>,
    /// Whether the number of a sample tells its time.
    pub(super) counts: bool,
}

impl Newest {
    pub(super) fn new(period: Period) -> Self {
        Self {
            control: ControlWord::EMPTY,
            time: Instant::ORIGIN,
            sample: None,
            period,
            open: None,
            counts: true,
        }
    }

    /// Takes a command, unless it was overtaken or held up on its way, and does nothing any more.
    pub(super) fn take(&mut self, time: Instant, command: &Command) -> bool {
        let behind = |newest: u32| (1..RESTARTED).contains(&newest.wrapping_sub(command.sample));
        let is_overtaken = self.sample.is_some_and(behind);
        let answers = self.period.sample(command.sample.into());
        let is_late = self.counts && time.since(answers) > is_taken(self.period);
        if is_overtaken || is_late {
            return false;
        }
        self.sample = Some(command.sample);
        self.time = time;
        if command.control.contains(ControlWord::BRAKE_RELEASE) {
            self.open = None;
        }
        self.control = command.control;
        true
    }

    /// Whether the brake is to be open.
    pub(super) fn releases_brake(&self) -> bool {
        self.control.contains(ControlWord::BRAKE_RELEASE)
    }

    /// How long the brake has been open by then that is to be closed, by what the drives say.
    pub(super) fn brake_open(&mut self, time: Instant, status: DriveStatus) -> Duration {
        if self.releases_brake() || !status.contains(DriveStatus::BRAKE_RELEASED) {
            self.open = None;
            return Duration::ZERO;
        }
        time.since(*self.open.get_or_insert(time))
    }

    /// Whether at this time (s) it is still obeyed, and lets the motors have torque.
    pub(super) fn enables_torque(&self, now: f64) -> bool {
        let hold = f64::from(held(self.period)) * self.period.duration().seconds();
        now - self.time.seconds() < hold && self.control.contains(ControlWord::TORQUE_ENABLE)
    }
}
