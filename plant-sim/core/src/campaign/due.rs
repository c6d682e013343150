//! By when faults have to be detected, by what the arm is doing: what is promised of one with torque is not promised of one without, and of
//! faults together one may hide another.
//!
//! | an arm | promise |
//! |---|---|
//! | that is not ready | nothing: it does not become ready |
//! | that is ready | what switches it off is told: a drive or an encoder in fault, values that are none, feedback that stays out for 100 ms |
//! | with torque | what [`expect`](super::expect) has, from when the fault meets it |

use protocol::messages::{Mode, Node};
use protocol::schema::Content;
use protocol::time::{Duration, Instant, Period};

use super::bounds::FOLLOWING_ERROR;
use super::expect::{Expected, HEART, of};
use super::reports::is_faulty;
use super::spells::Spell;
use crate::bus::ErrorKind;
use crate::clock::ClockDefect;
use crate::faults::{FrameFault, What};
use crate::plant::defect::{EncoderDefect, MotorDefect};

/// Age at which feedback is missed that nothing waits for.
const SILENCE: Duration = Duration::from_millis(100);
/// The longest period in which no axis makes two thirds of a jump that has to be told.
const SUDDEN: Duration = Duration::from_millis(4);

/// How many heartbeats there were of the nodes whose silence is told. Not the first one makes it missed: it comes before there is feedback.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Hearts {
    drives: u32,
    operator: u32,
}

impl Hearts {
    /// There is one.
    pub(super) fn hear(&mut self, node: Node) {
        match node {
            Node::Drives => self.drives += 1,
            Node::Operator => self.operator += 1,
            Node::Controller => {}
        }
    }

    fn are_missed(self, node: Node) -> bool {
        match node {
            Node::Drives => self.drives > 1,
            Node::Operator => self.operator > 1,
            Node::Controller => false,
        }
    }
}

/// What an arm is doing, and since when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Nothing that promises anything.
    Off,
    /// It is ready.
    Ready(Instant),
    /// It has torque.
    Powered(Instant),
}

impl Stage {
    /// What it does now, in this mode of its controller: whether torque `is_powered`, by command, and whether the drives have taken that.
    pub(super) fn after(
        self,
        now: Instant,
        mode: Mode,
        [is_powered, is_driven]: [bool; 2],
    ) -> Self {
        match self {
            Self::Powered(_) if is_powered => self,
            // Its drives may not have heard of it before.
            _ if is_powered && is_driven => Self::Powered(now),
            Self::Ready(_) if mode == Mode::Ready || is_faulty(mode) => self,
            _ if mode == Mode::Ready => Self::Ready(now),
            _ => Self::Off,
        }
    }
}

/// The time by which the first of these faults has to be detected, if there is one.
pub(super) fn due(
    faults: &[Spell],
    period: Period,
    stage: Stage,
    hearts: Hearts,
) -> Option<Instant> {
    let limit_of = |fault: &Spell| match stage {
        Stage::Off => None,
        Stage::Ready(since) => of_ready(&since_then(fault, since), period),
        Stage::Powered(since) => of_powered(fault, since, period, hearts),
    };
    let shown = faults.iter().enumerate().filter_map(|(number, fault)| {
        let mut due = limit_of(fault)?;
        for (_, other) in faults.iter().enumerate().filter(|(it, _)| *it != number) {
            let meets = other.from <= due && fault.from <= other.until;
            if !meets || !hides(other.what, fault.what) {
                continue;
            }
            let is_same = reach(fault.what) == reach(other.what);
            let later = match of(other, period) {
                Expected::Survived if is_same => due,
                // From when it can be seen again.
                Expected::Survived => limit_of(&since_then(fault, other.until))?,
                // Which of two that stop the same frames is seen first is left open.
                _ => limit_of(other).filter(|_| is_same)?,
            };
            due = due.max(later);
        }
        Some(due)
    });
    shown.min()
}

/// A fault as an arm meets it that has been as it is since then.
fn since_then(fault: &Spell, since: Instant) -> Spell {
    Spell {
        from: fault.from.max(since),
        ..*fault
    }
}

fn of_powered(fault: &Spell, since: Instant, period: Period, hearts: Hearts) -> Option<Instant> {
    let heart = match fault.what {
        What::Silent(Node::Operator) => Some(Node::Operator),
        What::Frames(info, _) => match info.content {
            Content::Heartbeat(node) => Some(node),
            _ => None,
        },
        _ => None,
    };
    if let Some(node) = heart {
        // One that was missed before is not waited for, nor one that was never heard.
        return limit(fault, period)
            .filter(|_| since < fault.from + HEART && hearts.are_missed(node));
    }
    let met = since_then(fault, since);
    limit(&met, period).filter(|_| met.from < met.until)
}

fn limit(fault: &Spell, period: Period) -> Option<Instant> {
    match of(fault, period) {
        Expected::DetectedBy(due) => Some(due),
        _ => None,
    }
}

fn of_ready(fault: &Spell, period: Period) -> Option<Instant> {
    let samples = |count: u32| period.duration() * count;
    let after = |enough: Duration, limit: Duration| {
        (fault.until.since(fault.from) >= enough && fault.from < fault.until)
            .then(|| fault.from + limit)
    };
    // Counted from the last feedback, and looked at in every second sample.
    let silence = SILENCE + samples(8);
    match fault.what {
        What::Motor(_, MotorDefect::Dip) => after(samples(2), samples(4)),
        What::Encoder(axis, EncoderDefect::Jump(by))
            if by.abs() > 2.0 * FOLLOWING_ERROR[axis] && period.duration() <= SUDDEN =>
        {
            after(samples(4), samples(4))
        }
        What::Frames(info, FrameFault::BadValue(1.0)) if info.content == Content::Feedback => {
            after(samples(4), samples(4))
        }
        What::Silent(Node::Drives)
        | What::Dead(Node::Drives)
        | What::Misreads(Node::Controller, 1.0)
        | What::Clock(ClockDefect::Misses(1.0)) => after(silence, silence),
        What::Frames(info, FrameFault::Loss(1.0) | FrameFault::Corrupt(1.0))
            if info.content == Content::Feedback =>
        {
            after(silence, silence)
        }
        What::Attempts(info, kind, 1.0)
            if info.content == Content::Feedback && kind != ErrorKind::Ack =>
        {
            after(silence, silence)
        }
        _ => None,
    }
}

/// What a fault changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reach {
    /// Whether the frames of the loop arrive, and when.
    Loop,
    /// Other frames.
    Others,
    /// An axis.
    Axis(usize),
    /// The arm, with its brake and its load.
    Arm,
}

/// What this fault changes.
pub(super) fn reach(what: What) -> Reach {
    match what {
        What::Frames(info, _) if !matches!(info.content, Content::Feedback | Content::Command) => {
            Reach::Others
        }
        What::Silent(Node::Operator) | What::NoRecovery(_) => Reach::Others,
        What::Frames(..)
        | What::Foreign(..)
        | What::Silent(_)
        | What::Dead(_)
        | What::Slow(_)
        | What::Babbling(_)
        | What::Attempts(..)
        | What::Misreads(..)
        | What::Wires(_)
        | What::Clock(_) => Reach::Loop,
        What::Encoder(axis, _) | What::Motor(axis, _) => Reach::Axis(axis),
        What::Brake(_) | What::Load(_) => Reach::Arm,
    }
}

/// Whether `one` may keep `other` from showing, or from being told.
fn hides(one: What, other: What) -> bool {
    match (reach(one), reach(other)) {
        (Reach::Loop, _) | (Reach::Others, Reach::Others) => true,
        (Reach::Others, _) | (_, Reach::Loop | Reach::Others) => false,
        (of_one, of_other) => match other {
            // The drive itself says so.
            What::Motor(_, MotorDefect::Dip) => false,
            // Another fault of the encoder decides on what it shows.
            What::Encoder(..) => of_one == of_other && matches!(one, What::Encoder(..)),
            _ => true,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Period = Period::of_rate(1000.0);
    const HEARD: Hearts = Hearts {
        drives: 2,
        operator: 2,
    };

    fn spell(text: &str) -> Spell {
        let fault: crate::faults::Fault = text.parse().unwrap();
        let (from, until) = fault.window.fixed(PERIOD).unwrap();
        Spell {
            what: fault.what,
            from,
            until,
        }
    }

    fn ms(ms: f64) -> Instant {
        Instant::ORIGIN + Duration::from_seconds(ms * 1e-3)
    }

    /// When a fault from 100 ms has to be detected, ms, as worked out by hand from docs/safety.md.
    #[test]
    fn what_is_promised_depends_on_what_the_arm_does() {
        let (off, ready) = (Stage::Off, Stage::Ready(ms(50.0)));
        let (on, later) = (Stage::Powered(ms(50.0)), Stage::Powered(ms(150.0)));
        for (fault, stage, at) in [
            ("feedback:corrupt@100ms", off, None),
            ("feedback:corrupt@100ms", ready, Some(208.0)),
            ("feedback:corrupt@100ms..150ms", ready, None),
            ("feedback:corrupt@100ms", on, Some(104.0)),
            ("feedback:corrupt@100ms", later, Some(154.0)),
            ("feedback:corrupt@100ms..152ms", later, None),
            ("feedback:corrupt@100ms..150ms", later, None),
            ("command:loss@100ms", ready, None),
            ("command:loss@100ms", later, Some(158.0)),
            ("motor:lift:dip@100ms", off, None),
            ("motor:lift:dip@100ms", ready, Some(104.0)),
            ("motor:lift:dip@100ms", Stage::Ready(ms(200.0)), Some(204.0)),
            ("drivesheartbeat:loss@100ms", ready, None),
            ("drivesheartbeat:loss@100ms", later, Some(363.0)),
            (
                "drivesheartbeat:loss@100ms",
                Stage::Powered(ms(400.0)),
                None,
            ),
        ] {
            let due = due(&[spell(fault)], PERIOD, stage, HEARD);
            assert_eq!(due, at.map(ms), "{fault} {stage:?}");
        }
    }

    #[test]
    fn a_heart_that_was_not_heard_is_not_missed() {
        let (silent, on) = (spell("operator:silent@100ms"), Stage::Powered(ms(50.0)));
        let mut hearts = Hearts::default();
        for (beats, at) in [(0, None), (1, None), (2, Some(363.0))] {
            let due = due(&[silent], PERIOD, on, hearts);
            assert_eq!(due, at.map(ms), "{beats}");
            hearts.hear(Node::Drives);
            hearts.hear(Node::Operator);
        }
    }

    #[test]
    fn of_faults_together_one_may_hide_the_other() {
        let on = Stage::Powered(ms(50.0));
        for (one, other, at) in [
            // What is lost cannot be damaged.
            ("feedback:loss@100ms", "feedback:corrupt@100ms", Some(108.0)),
            ("feedback:loss=0.5@100ms", "feedback:corrupt@100ms", None),
            // Who hears nothing sees no jump, and is told for that.
            (
                "drives:silent@100ms",
                "encoder:elbow:jump=0.5@100ms",
                Some(108.0),
            ),
            (
                "feedback:delay=0.001@100ms",
                "encoder:elbow:jump=0.5@100ms",
                None,
            ),
            (
                "encoder:elbow:stuck@100ms",
                "encoder:elbow:jump=0.5@100ms",
                None,
            ),
            (
                "encoder:lift:stuck@100ms",
                "encoder:elbow:jump=0.5@100ms",
                Some(104.0),
            ),
            ("motor:elbow:dead@100ms", "motor:elbow:runaway@100ms", None),
            (
                "motor:elbow:dead@100ms",
                "motor:elbow:dip@100ms",
                Some(104.0),
            ),
            // What hides nothing, what is over, and what comes too late for that.
            (
                "drives:no-recovery@100ms",
                "drives:silent@100ms",
                Some(108.0),
            ),
            ("state:loss@100ms", "drives:silent@100ms", Some(108.0)),
            (
                "feedback:loss=0.5@60ms..90ms",
                "feedback:corrupt@100ms",
                Some(104.0),
            ),
            (
                "feedback:loss=0.5@110ms",
                "feedback:corrupt@100ms",
                Some(104.0),
            ),
        ] {
            let (one, other) = (spell(one), spell(other));
            for faults in [[one, other], [other, one]] {
                assert_eq!(due(&faults, PERIOD, on, HEARD), at.map(ms), "{faults:?}");
            }
        }
    }
}
