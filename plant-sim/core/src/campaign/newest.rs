//! The command that the drives obey.

use protocol::messages::{Command, ControlWord};
use protocol::time::{Instant, Period};

use super::expect::is_taken;

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
    /// Whether the number of a sample tells its time.
    counts: bool,
}

impl Newest {
    pub(super) fn new(period: Period, counts: bool) -> Self {
        Self {
            control: ControlWord::EMPTY,
            time: Instant::ORIGIN,
            sample: None,
            period,
            counts,
        }
    }

    /// Takes a command; what the one before it switched. One that was overtaken or held up on its way does nothing any more.
    pub(super) fn take(&mut self, time: Instant, command: &Command) -> Option<ControlWord> {
        let behind = |newest: u32| (1..RESTARTED).contains(&newest.wrapping_sub(command.sample));
        let is_overtaken = self.sample.is_some_and(behind);
        let answers = self.period.sample(command.sample.into());
        let is_late = self.counts && time.since(answers) > is_taken(self.period);
        if is_overtaken || is_late {
            return None;
        }
        self.sample = Some(command.sample);
        self.time = time;
        Some(std::mem::replace(&mut self.control, command.control))
    }
}
