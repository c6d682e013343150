//! The faults of a case, each with the time in which it is in effect.

use protocol::messages::{Cause, Node};
use protocol::time::{Duration, Instant, Period};

use super::bounds::Reading;
use super::causes;
use super::due::{Hearts, Reach, Stage, due, reach};
use super::expect::{Expected, SOUND_NOISE, expected, lateness, loses_count};
use super::verdict::Requirement;
use crate::faults::{Fault, FrameFault, What};
use crate::model::Payload;
use crate::observer::PlantState;
use crate::plant::defect::{BrakeDefect, EncoderDefect, LoadDefect, burdened};

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
    /// As they were written.
    texts: Vec<String>,
    period: Period,
    /// Beginning of the first; the end of time without one.
    onset: Instant,
    expected: Expected,
    stage: Stage,
    hearts: Hearts,
    /// By when one has to be detected, as long as the arm does what it does.
    due: Option<Instant>,
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
            texts: faults.iter().map(|fault| fault.text.clone()).collect(),
            period,
            onset: Instant::MAX,
            expected: Expected::Survived,
            stage: Stage::Off,
            hearts: Hearts::default(),
            due: None,
        };
        spells.look_forward();
        spells
    }

    /// What follows from them, as far as their times are known.
    fn look_forward(&mut self) {
        let begins = self.all.iter().map(|spell| spell.from);
        self.onset = begins.min().unwrap_or(Instant::MAX).min(self.onset);
        self.expected = expected(&self.all, self.period);
        self.due = due(&self.all, self.period, self.stage, self.hearts);
    }

    /// The arm does this.
    pub(super) fn meet(&mut self, stage: Stage) {
        if self.stage != stage {
            self.stage = stage;
            self.look_forward();
        }
    }

    /// There is a heartbeat of this node.
    pub(super) fn hear(&mut self, node: Node) {
        self.hearts.hear(node);
        self.look_forward();
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

    /// By when one has to be detected, as long as the arm does what it does.
    pub(super) fn due(&self) -> Option<Instant> {
        self.due
    }

    /// How the run may end.
    pub(super) fn expected(&self) -> Expected {
        self.expected
    }

    /// How late a command may be for them.
    pub(super) fn lateness(&self) -> Duration {
        lateness(&self.all, self.period)
    }

    /// What is wrong with what the controller has told by the `end`: the first cause, or none. If the arm `was_off`, what is wrong with the link is
    /// told as drives that are not heard; what met an arm that got torque only later, or never, may have kept it from that; and of an encoder
    /// that is seen only now and then nobody can say how it got there.
    pub(super) fn judge_told(
        &self,
        told: Option<Cause>,
        [was_off, is_well]: [bool; 2],
        powered: Option<Instant>,
        end: Instant,
    ) -> Option<Requirement> {
        let Some(cause) = told else {
            let may_be = |spell: &Spell| causes::may_be_untold(spell, was_off, end);
            let is_silent = !is_well && !self.all.iter().any(may_be);
            return is_silent.then_some(Requirement::Detected);
        };
        let of_loop = |spell: &&Spell| reach(spell.what) == Reach::Loop;
        let loops = self.all.iter().filter(of_loop).count();
        let is_of = |spell: &Spell| {
            // What is sent again is of an arm that was not powered yet.
            let back = match spell.what {
                What::Frames(_, FrameFault::Replay(back)) => self.period.duration() * back as u32,
                _ => Duration::ZERO,
            };
            let is_early = powered.is_none_or(|powered| spell.from < powered + back);
            let is_of_loop = of_loop(&spell);
            let is_held_up = is_of_loop && (is_early || loops > 1);
            let is_late = loops > 0 && matches!(spell.what, What::Encoder(..));
            causes::of(spell.what).is_none_or(|causes| causes.contains(&cause))
                || (is_held_up && causes::OUT.contains(&cause))
                || (is_late && causes::LIE.contains(&cause))
                || (is_of_loop && self.is_slow() && causes::LEFT.contains(&cause))
                || (is_of_loop && self.is_fast() && cause == Cause::Late)
        };
        let mut begun = self.all.iter().filter(|spell| spell.from < Instant::MAX);
        // An emergency stop is the operator's.
        let may_be = cause == Cause::EStop
            || (cause == Cause::PeerSilent && was_off)
            // Whose frames are destroyed by what else disturbs the bus.
            || (cause == Cause::BusOff && loops > 1)
            || begun.any(is_of);
        (!may_be).then_some(Requirement::Cause)
    }

    /// Whether an arm may follow its last torques for so long that it leaves its reference, where commands stay out: below 1 kHz.
    fn is_slow(&self) -> bool {
        self.period.duration() > Duration::from_millis(1)
    }

    /// Whether a bus that has been held up may be so full of the loop's frames that they are late until it has caught up: above 1 kHz.
    fn is_fast(&self) -> bool {
        self.period.duration() < Duration::from_millis(1)
    }

    /// Those of several of which a run shows nothing: they have not acted, or another one had stopped the arm before, or was told.
    pub(super) fn unseen(
        &self,
        told: Option<Cause>,
        first: Option<f64>,
        acted: &[bool],
    ) -> Vec<String> {
        let is_seen = |spell: &Spell| {
            let causes = causes::of(spell.what);
            let is_told = told.is_none_or(|told| causes.is_none_or(|all| all.contains(&told)));
            is_told && first.is_none_or(|first| spell.from.seconds() <= first)
        };
        let each = self.all.iter().zip(&self.texts).zip(acted);
        let unseen = each.filter(|((spell, _), acted)| !**acted || !is_seen(spell));
        unseen
            .map(|((_, text), _)| text.clone())
            .filter(|_| self.all.len() > 1)
            .collect()
    }

    /// Whether the controller has forgotten by now what it told then, as it has been without power since.
    pub(super) fn forget(&self, told: Instant, now: Instant) -> bool {
        self.all.iter().any(|spell| {
            spell.what == What::Dead(Node::Controller) && spell.from <= now && spell.until > told
        })
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

    /// What the encoders show.
    pub(super) fn reading(&self) -> Reading {
        let of = |spell: &Spell| match spell.what {
            What::Encoder(_, EncoderDefect::Reversed) => Reading::Reversed,
            What::Encoder(_, EncoderDefect::Stuck | EncoderDefect::Slow(_)) => Reading::Wrong,
            What::Encoder(_, EncoderDefect::Noise(most)) if most > SOUND_NOISE => Reading::Noisy,
            _ => Reading::Right,
        };
        self.all.iter().map(of).max().unwrap_or(Reading::Right)
    }

    /// Whether so many frames may wait for the bus that a report finds no room among them, and State alone tells its cause.
    pub(super) fn pile_up(&self) -> bool {
        self.any(|what| {
            matches!(
                what,
                What::Attempts(..)
                    | What::Misreads(..)
                    | What::Babbling(_)
                    | What::Wires(_)
                    | What::Slow(_)
            )
        })
    }

    /// Whether the number of a sample may not tell its time.
    pub(super) fn lose_count(&self) -> bool {
        self.any(loses_count)
    }

    /// Whether the lift may go down without torque: nothing holds it then, or another fault has taken the torque that has to hold it in place of
    /// its brake.
    pub(super) fn let_the_lift_fall(&self) -> bool {
        self.open_the_brake() || (self.all.len() > 1 && self.leave_the_brake_open())
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
