//! The faults of a case, each with the time in which it is in effect.

use protocol::messages::{Cause, Node};
use protocol::time::{Duration, Instant, Period};

use super::causes;
use super::expect::{Expected, expected, lateness};
use super::verdict::Requirement;
use crate::faults::{Fault, What};
use crate::model::Payload;
use crate::observer::PlantState;
use crate::plant::defect::{BrakeDefect, LoadDefect, burdened};

/// What breaks, and when: at the end of time as long as that is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spell {
    /// What.
    pub what: What,
    /// Beginning.
    pub from: Instant,
    /// End; [`Instant::MAX`] for a fault that stays.
    pub until: Instant,
}

/// Everything that breaks in a case.
#[derive(Clone, Debug)]
pub(super) struct Spells {
    all: Vec<Spell>,
    period: Period,
    /// Beginning of the first; the end of time without one.
    onset: Instant,
    expected: Expected,
}

impl Spells {
    pub(super) fn new(faults: &[Fault], period: Period) -> Self {
        let spell = |fault: &Fault| {
            let never = (Instant::MAX, Instant::MAX);
            let (from, until) = fault.window.fixed(period).unwrap_or(never);
            let what = fault.what;
            Spell { what, from, until }
        };
        let mut spells = Self {
            all: faults.iter().map(spell).collect(),
            period,
            onset: Instant::MAX,
            expected: Expected::Survived,
        };
        spells.look_forward();
        spells
    }

    /// What follows from them, as far as their times are known.
    fn look_forward(&mut self) {
        let begins = self.all.iter().map(|spell| spell.from);
        self.onset = begins.min().unwrap_or(Instant::MAX).min(self.onset);
        self.expected = expected(&self.all, self.period);
    }

    /// The time of one is known, or changes.
    pub(super) fn retime(&mut self, number: usize, from: Instant, until: Instant) {
        if let Some(spell) = self.all.get_mut(number) {
            (spell.from, spell.until) = (from, until);
        }
        self.look_forward();
    }

    /// Beginning of the first; the end of time without one.
    pub(super) fn onset(&self) -> Instant {
        self.onset
    }

    /// Whether there are some, and none of them has begun at this end of the run.
    pub(super) fn begin_after(&self, end: Option<PlantState>) -> bool {
        !self.all.is_empty() && end.is_some_and(|end| self.onset.seconds() > end.t)
    }

    /// What has to follow.
    pub(super) fn expected(&self) -> Expected {
        self.expected
    }

    /// How late a command may be for them.
    pub(super) fn lateness(&self) -> Duration {
        lateness(&self.all, self.period)
    }

    /// What is wrong with what the controller has told in the end: the first cause, or none. If the arm `was_off`, what is wrong with the link is
    /// told as drives that are not heard.
    pub(super) fn judge_told(
        &self,
        told: Option<Cause>,
        was_off: bool,
        survived: bool,
    ) -> Option<Requirement> {
        let Some(cause) = told else {
            let may_be = |spell: &Spell| causes::may_be_untold(spell, was_off);
            let is_silent = !survived && !self.all.iter().any(may_be);
            return is_silent.then_some(Requirement::Detected);
        };
        let begun = self.all.iter().filter(|spell| spell.from < Instant::MAX);
        let mut causes = begun.map(|spell| causes::of(spell.what));
        // An emergency stop is the operator's.
        let may_be = cause == Cause::EStop
            || (cause == Cause::PeerSilent && was_off)
            || causes.any(|causes| causes.is_none_or(|causes| causes.contains(&cause)));
        (!may_be).then_some(Requirement::Cause)
    }

    fn any(&self, is: impl Fn(What) -> bool) -> bool {
        self.all.iter().any(|spell| is(spell.what))
    }

    /// Whether the brake may be open where it should hold, and torque has to go on holding the lift.
    pub(super) fn leave_the_brake_open(&self) -> bool {
        self.any(|what| {
            matches!(
                what,
                What::Brake(BrakeDefect::Stuck | BrakeDefect::StuckOpen | BrakeDefect::Slow(_))
            )
        })
    }

    /// Whether torque may be commanded for longer than a stop takes: to hold a lift whose brake is open, or as the time of the brake is
    /// counted in ticks that the drives miss, which then have let go by a clock of their own.
    pub(super) fn keep_torque_on(&self, have_let_go: bool) -> bool {
        self.leave_the_brake_open() || (have_let_go && self.lose_count())
    }

    /// Whether the number of a sample may not tell its time.
    pub(super) fn lose_count(&self) -> bool {
        self.any(|what| matches!(what, What::Clock(_) | What::Dead(Node::Drives)))
    }

    /// Whether something may hold the tool.
    pub(super) fn catch_the_tool(&self) -> bool {
        self.any(|what| matches!(what, What::Load(LoadDefect::Caught(_))))
    }

    /// From when on it does; the end of time if never.
    pub(super) fn caught_from(&self) -> Instant {
        let caught = |spell: &&Spell| matches!(spell.what, What::Load(LoadDefect::Caught(_)));
        let begins = self.all.iter().filter(caught).map(|spell| spell.from);
        begins.min().unwrap_or(Instant::MAX)
    }

    /// Whether something may move an arm without torque: a spring, or the weight of a lift that nothing holds.
    pub(super) fn move_the_arm(&self) -> bool {
        self.catch_the_tool() || self.open_the_brake()
    }

    /// Whether the brake may not hold, so that an arm without torque goes down.
    pub(super) fn open_the_brake(&self) -> bool {
        self.any(|what| matches!(what, What::Brake(BrakeDefect::StuckOpen)))
    }

    /// The most that may be at the flange, with this payload.
    pub(super) fn burden(&self, payload: Option<Payload>) -> Option<Payload> {
        let extra = self.all.iter().map(|spell| match spell.what {
            What::Load(LoadDefect::Heavier(kg)) => kg,
            _ => 0.0,
        });
        burdened(payload, extra.sum())
    }
}
