//! What a fault may be told as: written by hand from docs/safety.md and docs/faults.md, by what breaks and what follows from it.
//!
//! A cause that is not among those of its faults sends whoever mends the robot to the wrong place.

use protocol::messages::{Cause, Node};
use protocol::schema::Content;
use protocol::time::{Duration, Instant};

use super::bounds::FOLLOWING_ERROR;
use super::spells::Spell;
use crate::bus::ErrorKind;
use crate::clock::ClockDefect;
use crate::faults::{Disguise, FrameFault, What};
use crate::plant::defect::{EncoderDefect, LoadDefect, MotorDefect};

/// No feedback comes. The drives have let go by the time at which they are heard again, but the gap is what is felt first.
const GAP: &[Cause] = &[Cause::FeedbackLost, Cause::PeerSilent];
/// Nor anything of the operator.
const HEARS_NOTHING: &[Cause] = &[
    Cause::FeedbackLost,
    Cause::PeerSilent,
    Cause::OperatorSilent,
];
/// No command arrives. Feedback goes on, and says that the drives have let go.
const LET_GO: &[Cause] = &[Cause::DriveFault];
/// Feedback is held up, its sender does not miss it: what is told depends on how long, and on which frame comes first.
const HELD_UP: &[Cause] = &[
    Cause::Late,
    Cause::FeedbackLost,
    Cause::PeerSilent,
    Cause::DriveFault,
];
/// Commands are held up: late for the drives, or too late.
const LATE: &[Cause] = &[Cause::Late, Cause::DriveFault];
/// Attempts in vain take a node off the bus; its frames are held up.
const OFF_THE_BUS: &[Cause] = &[
    Cause::BusOff,
    Cause::FeedbackLost,
    Cause::PeerSilent,
    Cause::DriveFault,
];
/// Counter or sample of the feedback stand or go backwards; at 500 Hz, one from a sample before is late already, and below 400 Hz each takes the
/// place of one that is missed.
const OLD: &[Cause] = &[Cause::Reordered, Cause::Late, Cause::FeedbackLost];
/// An arm that nobody commands has left its reference.
pub(super) const LEFT: &[Cause] = &[Cause::FollowingError, Cause::OverSpeed, Cause::SoftLimit];
/// Frames stay out while the arm is to get its torque, or for several reasons: what is told depends on how far it has come, and on which is there
/// again first.
pub(super) const OUT: &[Cause] = &[
    Cause::DriveFault,
    Cause::Late,
    Cause::FeedbackLost,
    Cause::PeerSilent,
    Cause::Reordered,
];
/// The loop closes on a reading that is not so.
pub(super) const LIE: &[Cause] = &[
    Cause::EncoderFault,
    Cause::StuckSensor,
    Cause::Collision,
    Cause::Chatter,
    Cause::FollowingError,
    Cause::OverSpeed,
    Cause::SoftLimit,
    // Readings off by as much as the axis moves in a whole number of samples look like ticks that were missed.
    Cause::FeedbackLost,
];
/// An axis does not do what its torque should. One that stands at its limit, or goes away against its torque, looks like one whose encoder
/// does, and gets the same stop.
const FORCE: &[Cause] = &[
    Cause::FollowingError,
    Cause::OverSpeed,
    Cause::OverTorque,
    Cause::SoftLimit,
    Cause::Overload,
    Cause::Collision,
    Cause::StuckSensor,
    Cause::EncoderFault,
];
/// The same of an arm that carries another load than its model: its gains are wrong as well.
const LOAD: &[Cause] = &[
    Cause::FollowingError,
    Cause::OverSpeed,
    Cause::OverTorque,
    Cause::Overload,
    Cause::Collision,
    Cause::StuckSensor,
    Cause::EncoderFault,
    Cause::Chatter,
];

/// Causes that may be told of this fault; `None` for what is not judged by its cause.
pub(super) fn of(what: What) -> Option<&'static [Cause]> {
    Some(match what {
        What::Frames(info, kind) => return of_frames(info.content, kind),
        What::Foreign(info, disguise) => match (info.content, disguise) {
            (Content::Feedback, Disguise::Poor) => {
                // On the beat of the drives' own, both read other bits than they send.
                &[Cause::Corrupted, Cause::FeedbackLost, Cause::DriveFault]
            }
            (Content::Feedback, Disguise::Perfect) => {
                &[Cause::Reordered, Cause::FeedbackLost, Cause::DriveFault]
            }
            (Content::Command, Disguise::Poor) => &[Cause::BusOff, Cause::DriveFault],
            (_, Disguise::Perfect) if info.sender == Some(Node::Controller) => {
                &[Cause::DuplicateNode]
            }
            _ => return None,
        },
        What::Silent(Node::Operator) => &[Cause::OperatorSilent],
        What::Silent(Node::Drives) => GAP,
        What::Silent(Node::Controller) | What::Misreads(Node::Controller, _) => HEARS_NOTHING,
        // Drives that start anew begin with sample 0, and without torque.
        What::Dead(Node::Drives) => &[Cause::DriveFault, Cause::FeedbackLost, Cause::PeerSilent],
        What::Dead(_) => &[],
        // The drives may see before the controller's own clock does that its answers are late.
        What::Slow(_) => &[Cause::Overrun, Cause::Late, Cause::DriveFault],
        // No node hears itself.
        What::Babbling(Node::Controller) => HELD_UP,
        What::Babbling(_) => &[Cause::Babbling],
        What::Wires(_) => OFF_THE_BUS,
        What::Attempts(info, kind, share) => match (info.content, kind) {
            (Content::Command, ErrorKind::Ack) => LATE,
            // 32 attempts take less than the 5 ms for which the drives hold a command.
            (Content::Command, _) if share >= 1.0 => &[Cause::BusOff],
            (Content::Command, _) => &[Cause::BusOff, Cause::DriveFault],
            // A passive transmitter repeats what the others have taken.
            (Content::Feedback, ErrorKind::Ack) => OLD,
            (Content::Feedback, _) => HELD_UP,
            _ => return None,
        },
        What::Misreads(Node::Drives, _) => &[Cause::BusOff, Cause::DriveFault],
        // After some ten error flags it is passive, and spoils nothing; one that reads the frames in between stays active, and every
        // frame that it spoils counts for its sender.
        What::Misreads(Node::Operator, share) if share < 1.0 => OFF_THE_BUS,
        What::Misreads(Node::Operator, _) => &[],
        What::NoRecovery(_) => &[],
        // All speeds and times are wrong by as much, at once: what a crystal is off by nobody feels, and hundredths look like a blow.
        What::Clock(ClockDefect::Drift(_)) => &[
            Cause::Collision,
            Cause::EncoderFault,
            Cause::FollowingError,
            Cause::OverSpeed,
            Cause::Chatter,
        ],
        // A few can be told from the readings, many near each other cannot.
        What::Clock(ClockDefect::Misses(_)) => &[
            Cause::FeedbackLost,
            Cause::PeerSilent,
            Cause::DriveFault,
            Cause::Collision,
            Cause::EncoderFault,
            Cause::StuckSensor,
            Cause::Chatter,
            Cause::OverSpeed,
        ],
        // Further than any axis gets in a sample.
        What::Encoder(axis, EncoderDefect::Jump(by)) if by.abs() > 2.0 * FOLLOWING_ERROR[axis] => {
            &[Cause::EncoderFault]
        }
        What::Encoder(..) => LIE,
        What::Motor(_, MotorDefect::Dip) => LET_GO,
        What::Motor(..) => FORCE,
        // The drives see where it is before any axis does.
        What::Brake(_) => &[Cause::DriveFault],
        What::Load(LoadDefect::Dropped | LoadDefect::Heavier(_) | LoadDefect::Caught(_)) => LOAD,
    })
}

fn of_frames(content: Content, kind: FrameFault) -> Option<&'static [Cause]> {
    Some(match (content, kind) {
        (_, FrameFault::Duplicate) => &[],
        (Content::Feedback, FrameFault::Loss(_) | FrameFault::Burst(..)) => GAP,
        (Content::Feedback, FrameFault::Corrupt(_)) => &[Cause::Corrupted, Cause::FeedbackLost],
        // Below 800 Hz two bad ones make the gap too long.
        (Content::Feedback, FrameFault::BadValue(_)) => &[Cause::BadValue, Cause::FeedbackLost],
        (Content::Feedback, FrameFault::Replay(_) | FrameFault::Reorder(_)) => OLD,
        (Content::Feedback, FrameFault::Delay(_)) => HELD_UP,
        (Content::Feedback, FrameFault::Jitter(_)) => &[
            Cause::Reordered,
            Cause::Late,
            Cause::FeedbackLost,
            Cause::PeerSilent,
            Cause::DriveFault,
        ],
        (
            Content::Command,
            FrameFault::Delay(_)
            | FrameFault::Jitter(_)
            | FrameFault::Replay(_)
            | FrameFault::Reorder(_),
        ) => LATE,
        (Content::Command, _) => LET_GO,
        (Content::Heartbeat(Node::Drives), _) => &[Cause::PeerSilent],
        (Content::Heartbeat(Node::Operator), _) => &[Cause::OperatorSilent],
        _ => return None,
    })
}

/// Longest time until a report that waits for nothing but its turn is there.
const REPORT: Duration = Duration::from_millis(40);

/// Whether such a fault may end a run without a word of the controller: nobody is there to command the arm, or to be told; or the arm `was_off`, and
/// what the controller says of that waits behind a command that nobody acknowledges.
pub(super) fn may_be_untold(spell: &Spell, was_off: bool, end: Instant) -> bool {
    let stays = spell.until == Instant::MAX;
    match spell.what {
        What::Silent(Node::Operator)
        | What::Misreads(Node::Operator, _)
        // Passive, it does not ask for frames to be repeated that it could not read. Of its requests, the operator misses the reply.
        | What::Misreads(Node::Controller, _)
        | What::NoRecovery(Node::Controller)
        | What::Silent(Node::Controller)
        | What::Dead(Node::Controller) => true,
        // It says so in its sixth answer, and the drives have let go long before.
        What::Slow(seconds) => spell.from + Duration::from_seconds(6.0 * seconds) + REPORT > end,
        // A word gets through once the bus is free.
        What::Babbling(_) | What::Wires(_) => stays,
        What::Attempts(info, ErrorKind::Ack, _) if info.content == Content::Command => stays && was_off,
        What::Frames(info, _) | What::Foreign(info, _) | What::Attempts(info, ..) => !matches!(
            info.content,
            Content::Feedback | Content::Command | Content::Heartbeat(_)
        ),
        _ => false,
    }
}
