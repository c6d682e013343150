//! By when a fault of an arm with torque has to be detected, and which faults a sound system survives: written by hand from docs/safety.md,
//! docs/protocol.md and the fault table of the design, for a link at the default parameters.
//!
//! | fault | promise | why |
//! |---|---|---|
//! | nothing; noise of a sound encoder; frames doubled | the scenario ends as without it | no reason to stop |
//! | feedback lost for so few samples that it is back within 5 ms: for 1 at 400 and 500 Hz, 2 at 600 Hz, 4 at 1 kHz, none below 400 Hz | the same | a gap of so long is bridged (`feedback-gap`) |
//! | the same, and 2 samples at the most, of feedback that is damaged | the same | three bad frames stop |
//! | the same, and 3 samples at the most, of commands lost or damaged | the same | the drives hold a command for 5 samples, and 5 ms at least; below 1 kHz an arm may leave its reference meanwhile |
//! | 3 feedback frames damaged in a row | 4 samples | three bad frames, and one sample to answer |
//! | feedback or commands gone | 8 samples, above 1 kHz 5 ms and 3 samples | the drives switch off after 5 samples, and 5 ms at least, without a command, seen 2 samples later, and a frame may have been on its way |
//! | feedback or commands that stay late, by whole samples that make 2 ms or more | 7 samples, and twice as late | a command that answers a sample of 2 ms before is late; three samples of drives that have it, each of which may be as late, and one to answer |
//! | 4 old feedback frames in a row | 5 samples | the third repeated or old frame |
//! | an encoder that jumps further than the following error allows | 4 samples | three samples beyond a limit, and one to answer |
//! | every attempt to send feedback fails for up to 2 samples that a gap may have; what the controller receives is unreadable for as long; a node babbles | the same as without it | frames wait and are repeated: even after 32 attempts (bus-off of the drives) and 1.4 ms of recovery the next feedback is there within 5 samples |
//! | every attempt to send commands fails for as long; what the drives receive is unreadable | the same, or the arm stops for a bus-off | as before, unless 32 attempts have failed |
//! | the wires are held for as long | the same, or the arm stops | two nodes may be off the bus, and what the third sends without acknowledgement delays their return |
//! | any of these but babbling for 9 samples or more | 8 samples | nothing gets through: the drives switch off as if it were lost |
//! | nobody acknowledges feedback for 9 samples or more | 8 samples | after 16 attempts the drives are passive, and the same frame comes again and again: three repeated frames |
//! | nobody acknowledges commands for 9 samples or more | 9 samples | one more command gets through once the controller is passive; it is repeated, and keeps all later ones waiting |
//! | a node babbles for 9 samples or more | 8 samples | nothing gets through |
//! | drives or controller without power for 9 samples or more | 8 samples | as if they were silent: they start with torque off |
//! | a controller that needs longer than its period for 14 samples or more | 13 samples | it says so in the sixth answer, each of which waits for the one before, unless the drives have let go by then |
//! | a drive without power for 2 samples or more | 4 samples | the next feedback says so, and one sample to answer |
//! | the clock of the drives stands still for 9 samples or more | 8 samples | no feedback, so no commands: the drives let go by a clock of their own |
//! | a clock within 100 ppm, as every crystal is | the same as without it | nobody else counts on a time |
//! | a foreign node sends a right frame of the controller for 17 samples or more | 16 samples | the controller hears it; on the beat of its own frames only after 32 attempts |
//! | heartbeats of drives or operator gone for up to 100 ms | the same as without it | the next one is there after 200 ms at most |
//! | the same for 350 ms or more; the operator silent for as long | 250 ms and 13 samples | one that was heard is waited for so long, looked at in every tenth sample |
//! | nobody tells a CAN controller to recover | the same as without it | nothing by itself: only after a bus-off |
//!
//! What is detected within 8 samples because the drives let go takes 5 ms and 3 samples above 1 kHz, of a fault that lasts for a sample more.
//!
//! | a motor that gives its peak torque for 600 ms or more | 600 ms | no plan accelerates for longer than 0.47 s |
//!
//! Whatever else breaks has no limit of time of its own, because a sound system may survive it: an encoder that is stuck, slow, reversed or lacks
//! a bit lies only as far as its axis moves; a motor that is dead or weak is missed only where torque is needed, and the plan slows down for what
//! it lacks; a load within the margins of the model is carried; a brake is told where it does not go where it is told to, or leaves that place; what a foreign node sends without the
//! right CRC is dropped. Their limit is that of the effect, which is stricter: the controller closes its loops on the readings, so that an axis whose
//! reading or torque is wrong leaves its reference in truth, and 4 samples later that has to be reported (see [`super::bounds`]). What is
//! reported has to be a cause that they can have, and a run that ends early must not end untold (see `causes`).

use protocol::messages::{Cause, Node};
use protocol::parameters::ControllerParameter;
use protocol::schema::Content;
use protocol::time::{Duration, Instant, Period};

use super::bounds::FOLLOWING_ERROR;
use super::spells::Spell;
use crate::bus::ErrorKind;
use crate::clock::ClockDefect;
use crate::faults::{Disguise, FrameFault, What};
use crate::plant::defect::{EncoderDefect, MotorDefect};

/// Age from which on a feedback is old: from the fault table of docs/safety.md.
const OLD: Duration = Duration::from_millis(2);

/// Time in which a transmitter of feedback that nobody acknowledges gets passive, and repeats what the others have taken: 16 attempts.
const PASSIVE: Duration = Duration::from_millis(2);

/// Noise of a sound encoder, rad and m: two of its counts at the shoulder.
pub(super) const SOUND_NOISE: f64 = 1.2e-6;

/// What a crystal may be off by.
const SOUND_CLOCK: f64 = 1e-4;

/// From rest to full speed at peak torque takes the slowest axis 0.47 s; as long a plan may do the same. Then 100 ms lead away from it.
const RUNAWAY: Duration = Duration::from_millis(600);

/// Time without a heartbeat after which a node that was heard is missed.
pub(super) const HEART: Duration = Duration::from_millis(250);

/// Samples of feedback that a controller may miss: with the one that is there again, they take no longer than the gap across which it
/// goes on.
fn bridged(period: Period) -> u32 {
    let gap = f64::from(ControllerParameter::FeedbackGap.initial(1.0));
    // Rounded down, but for what a period in whole nanoseconds is off by.
    let samples = gap / period.duration().seconds() + 1e-3;
    (samples as u32).saturating_sub(1)
}

/// Samples for which the drives hold a command: 5, and 5 ms at least.
pub(super) fn held(period: Period) -> u32 {
    // Rounded up, but for what a period in whole nanoseconds is off by.
    let enough = 0.005 / period.duration().seconds() + 0.999;
    (enough as u32).max(5)
}

/// What has to follow from a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// Nothing: the scenario ends as if it had not been there.
    Survived,
    /// That, or it is reported as this.
    SurvivedOr(Cause),
    /// It is detected by then.
    DetectedBy(Instant),
    /// It may be detected or survived; its effect is what counts.
    Either,
}

impl Expected {
    /// Whether the end of a run is that of one with such a fault: its scenario has ended as it should, or this was reported.
    pub(super) fn allows(self, survived: bool, reported: Option<Cause>) -> bool {
        match self {
            Self::Survived => survived,
            Self::SurvivedOr(cause) => survived || reported == Some(cause),
            Self::DetectedBy(_) | Self::Either => true,
        }
    }
}

/// How a run may end with these faults together.
pub fn expected(faults: &[Spell], period: Period) -> Expected {
    let begun = faults.iter().filter(|fault| fault.from < Instant::MAX);
    let each = begun.map(|fault| of(fault, period));
    each.fold(Expected::Survived, |all, one| match (all, one) {
        (Expected::Survived, other) | (other, Expected::Survived) => other,
        (Expected::SurvivedOr(one), Expected::SurvivedOr(other)) if one == other => all,
        _ => Expected::Either,
    })
}

/// What has to follow from a fault, as far as it meets an arm with torque.
pub(super) fn of(fault: &Spell, period: Period) -> Expected {
    let lasts = fault.until.since(fault.from);
    let samples = |count: u32| period.duration() * count;
    // A fault of up to `few` samples is survived, one of `enough` is detected within `limit`.
    let by_length = |few, enough, limit| {
        if lasts <= samples(few) {
            Expected::Survived
        } else if lasts >= samples(enough) {
            Expected::DetectedBy(fault.from + samples(limit))
        } else {
            Expected::Either
        }
    };
    // Of the loop's frames, so many may be missed or damaged in a row.
    let most = bridged(period);
    let (two, three) = (most.min(2), most.min(3));
    // Nothing gets through: by then the drives have let go, and have said so.
    let silent = held(period) + 3;
    let gone = |few| by_length(few, silent + 1, silent);
    // A heartbeat comes every 100 ms, and is waited for for 250.
    let of_heart = || {
        if lasts <= Duration::from_millis(100) {
            Expected::Survived
        } else if lasts >= Duration::from_millis(350) {
            // Looked at in every tenth sample.
            Expected::DetectedBy(fault.from + HEART + samples(13))
        } else {
            Expected::Either
        }
    };
    match fault.what {
        What::Silent(Node::Operator) => no_survival(of_heart()),
        What::Foreign(info, Disguise::Perfect)
            if info.sender == Some(Node::Controller) && !is_rare(info.content) =>
        {
            no_survival(by_length(0, 17, 16))
        }
        What::Silent(Node::Drives) => gone(two),
        What::Silent(Node::Controller) | What::Dead(_) => no_survival(gone(0)),
        What::Slow(seconds) if Duration::from_seconds(seconds) >= period.duration() => {
            no_survival(by_length(0, silent + 6, silent + 5))
        }
        What::Babbling(_) => gone(two),
        What::Wires(_) => no_survival(gone(two)),
        What::Motor(_, MotorDefect::Runaway) if lasts >= RUNAWAY => {
            Expected::DetectedBy(fault.from + RUNAWAY)
        }
        What::Motor(_, MotorDefect::Dip) => no_survival(by_length(0, 2, 4)),
        What::Clock(ClockDefect::Misses(1.0)) => no_survival(gone(0)),
        What::Clock(ClockDefect::Drift(share)) if share.abs() <= SOUND_CLOCK => Expected::Survived,
        What::Frames(info, kind) => match (info.content, kind) {
            (_, FrameFault::Duplicate) => Expected::Survived,
            (Content::Feedback, FrameFault::Loss(1.0)) => gone(most),
            (Content::Feedback, FrameFault::Corrupt(1.0) | FrameFault::BadValue(1.0)) => {
                by_length(two, 4, 4)
            }
            (Content::Feedback, FrameFault::Replay(back)) if back >= 4 => {
                no_survival(by_length(0, 5, 5))
            }
            (
                Content::Heartbeat(Node::Drives | Node::Operator),
                FrameFault::Loss(1.0) | FrameFault::Corrupt(1.0),
            ) => of_heart(),
            (
                Content::Command,
                FrameFault::Loss(1.0) | FrameFault::Corrupt(1.0) | FrameFault::BadValue(1.0),
            ) => gone(three),
            (Content::Feedback | Content::Command, FrameFault::Delay(late))
                if Duration::from_seconds(late) >= samples(silent + 1) =>
            {
                no_survival(gone(0))
            }
            (Content::Feedback | Content::Command, FrameFault::Delay(late)) => {
                let late = Duration::from_seconds(late);
                let due = late * 2 + samples(7);
                // In whole samples, as the drives count it.
                let missed = (late.seconds() / period.duration().seconds() + 1e-3) as u32;
                if samples(missed) >= OLD && lasts >= due {
                    Expected::DetectedBy(fault.from + due)
                } else {
                    Expected::Either
                }
            }
            (Content::Command, FrameFault::Replay(back)) => {
                let late = period.duration() * back as u32;
                let due = late + samples(7);
                if late >= OLD && lasts >= due {
                    Expected::DetectedBy(fault.from + due)
                } else {
                    Expected::Either
                }
            }
            _ => Expected::Either,
        },
        What::Attempts(info, kind, 1.0) => match (info.content, kind) {
            (Content::Command, ErrorKind::Ack) => by_length(two, silent + 1, silent + 1),
            (Content::Command, _) => or_bus_off(gone(two)),
            (Content::Feedback, ErrorKind::Ack) if lasts > PASSIVE => no_survival(gone(0)),
            (Content::Feedback, _) => gone(two),
            _ => Expected::Either,
        },
        What::Misreads(Node::Drives, 1.0) => or_bus_off(gone(two)),
        What::Misreads(Node::Controller, 1.0) => gone(two),
        What::NoRecovery(_) => Expected::Survived,
        What::Encoder(axis, EncoderDefect::Jump(by)) if by.abs() > 2.0 * FOLLOWING_ERROR[axis] => {
            no_survival(by_length(0, 4, 4))
        }
        What::Encoder(_, EncoderDefect::Noise(most)) if most <= SOUND_NOISE => Expected::Survived,
        _ => Expected::Either,
    }
}

/// What a foreign node may never have heard, and cannot repeat.
fn is_rare(content: Content) -> bool {
    matches!(
        content,
        Content::Emergency(_) | Content::ParameterRequest(_) | Content::ParameterReply(_)
    )
}

/// A short one may be enough to take the controller off the bus, which stops the arm.
fn or_bus_off(expected: Expected) -> Expected {
    match expected {
        Expected::Survived => Expected::SurvivedOr(Cause::BusOff),
        other => other,
    }
}

/// A short one may be survived, but need not.
fn no_survival(expected: Expected) -> Expected {
    match expected {
        Expected::Survived => Expected::Either,
        other => other,
    }
}

/// Whether the number of a sample may not tell its time.
pub(super) fn loses_count(what: What) -> bool {
    matches!(what, What::Clock(_) | What::Dead(Node::Drives))
}

/// How late a fault of the link makes a command that its sender sent in time and the drives still take.
pub(super) fn lateness(faults: &[Spell], period: Period) -> Duration {
    let late = |fault: &Spell| match fault.what {
        What::Attempts(..)
        | What::Misreads(..)
        | What::Babbling(_)
        | What::Wires(_)
        | What::Foreign(..)
        | What::Dead(_)
        | What::Slow(_)
        | What::Clock(_) => is_taken(period),
        What::Frames(info, kind) if info.content == Content::Command => match kind {
            FrameFault::Delay(s) | FrameFault::Jitter(s) => Duration::from_seconds(s),
            FrameFault::Reorder(_) => period.duration() * 2,
            FrameFault::Replay(back) => period.duration() * back as u32,
            _ => Duration::ZERO,
        },
        _ => Duration::ZERO,
    };
    let together = faults
        .iter()
        .map(late)
        .fold(Duration::ZERO, |all, one| all + one);
    // Where the drives do not count, nor can the age of a command be told.
    let uncounted = faults.iter().any(|fault| loses_count(fault.what));
    if uncounted {
        together
    } else {
        together.min(is_taken(period))
    }
}

/// How old the sample may be that a command answers: from docs/protocol.md, and the one that is under way.
pub(super) fn is_taken(period: Period) -> Duration {
    period.duration() * (held(period) + 1)
}

/// Causes that leave the loops to be trusted: the arm has stopped before the brake closes, and the brake has closed before torque goes
/// off. A drive in fault gets the brake at once, which may still have to stop the lift when torque goes off.
pub(super) fn stops_under_control(cause: Cause) -> bool {
    matches!(
        cause,
        Cause::FeedbackLost
            | Cause::Babbling
            | Cause::BusOff
            | Cause::Overrun
            | Cause::OperatorSilent
            | Cause::Reordered
            | Cause::Late
            | Cause::Corrupted
            | Cause::SoftLimit
            | Cause::EStop
            | Cause::Overload
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What ends well, and what is a false alarm, by what was reported.
    #[test]
    fn a_bus_off_is_told_as_such_or_survived() {
        let own = Expected::SurvivedOr(Cause::BusOff);
        for (expected, survived, reported, allowed) in [
            (own, true, None, true),
            (own, false, Some(Cause::BusOff), true),
            (own, false, Some(Cause::DriveFault), false),
            (own, false, None, false),
            (Expected::Survived, false, Some(Cause::BusOff), false),
            (Expected::Survived, true, None, true),
            (Expected::Either, false, None, true),
        ] {
            let is = expected.allows(survived, reported);
            assert_eq!(is, allowed, "{expected:?} {survived} {reported:?}");
        }
    }

    #[test]
    fn of_faults_together_one_that_need_not_be_survived_counts() {
        let period = Period::of_rate(1000.0);
        let spell = |text: &str, ms: f64| {
            let fault: crate::faults::Fault = text.parse().unwrap();
            Spell {
                what: fault.what,
                from: Instant::ORIGIN,
                until: Instant::ORIGIN + Duration::from_seconds(ms * 1e-3),
            }
        };
        let sent = spell("command:bit-error@0s", 2.0);
        let heard = spell("feedback:bit-error@0s", 2.0);
        let long = spell("feedback:loss@0s", 60.0);
        let both = |a: Spell, b: Spell| [expected(&[a, b], period), expected(&[b, a], period)];
        assert_eq!(
            expected(&[sent], period),
            Expected::SurvivedOr(Cause::BusOff)
        );
        assert_eq!(expected(&[heard], period), Expected::Survived);
        assert_eq!(both(sent, heard), [Expected::SurvivedOr(Cause::BusOff); 2]);
        assert_eq!(both(sent, long), [Expected::Either; 2]);
        assert!(matches!(
            both(heard, long),
            [Expected::DetectedBy(_), Expected::DetectedBy(_)]
        ));
    }
}
