//! What becomes of a fault: one row for each cause, with its limit, its reactions and what clears it.
//!
//! The reaction depends on what can still be trusted:
//!
//! * A controlled stop closes the loop through the encoders. An encoder that is lost or lies never gets one: a motor's
//!   commutation hangs on its encoder as well, so that not even an open-loop torque would go where it is meant. Brake and
//!   torque off, at once.
//! * A stop is watched like a move. What is found while the arm stops closes the brake in the same sample; torque carries
//!   the lift until the brake holds it.
//! * An axis that follows not even while the brake closes has shown that its loop does not work: torque off.
//! * A drive in fault may be that of the lift, whose load nothing but the brake holds then: brake first.
//!
//! The limits are the defaults of parameters. `docs/safety.md` has the same table; the test `faults` compares the two.

use protocol::messages::Cause;
use protocol::parameters::ControllerParameter as Parameter;

use super::states::{Event, Halt, State};

/// Longest gap in the feedback that the trajectory is continued through, ms. Within it an arm at full speed strays by less
/// than the following error allows: 60 rad/s² x (5 ms)² / 2 is 0.75 mrad at the shoulder.
pub const MAX_GAP_MS: u32 = milliseconds(Parameter::FeedbackGap);
/// Age of the feedback at which the drives count as silent, ms: the watchdog time of moteus and the heartbeat of ODrive.
/// The drives have let go long before, after 5 samples without a command.
pub const PEER_TIMEOUT_MS: u32 = milliseconds(Parameter::FeedbackTimeout);
/// Rejected, stale or repeated feedback frames in a row that stop the arm: two can be noise, and even at 500 Hz three last
/// no longer than a gap may.
pub const BAD_FRAMES: u8 = Parameter::BadFrames.initial(1.0) as u8;

/// Default of a parameter in s.
const fn milliseconds(parameter: Parameter) -> u32 {
    (parameter.initial(1.0) * 1e3 + 0.5) as u32
}

/// How much of something is a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Any of it.
    AtOnce,
    /// Longer than this, ms.
    Milliseconds(u32),
    /// So many frames in a row.
    Frames(u8),
    /// [`MonitorLimits`](super::monitor::MonitorLimits): a number for each axis, in so many samples in a row.
    EachAxis,
}

/// What is done about a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing more than what goes on.
    None,
    /// Controlled stop, brake, torque off.
    Stop,
    /// Brake at once; torque off when it has closed.
    Brake,
    /// Brake and torque off at once.
    Off,
    /// As a stop, into the state that only the end of the emergency leaves.
    EmergencyStop,
}

/// What ends a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Latch {
    /// An operator's reset.
    Reset,
    /// A new start of the controller.
    Restart,
}

/// A row of the fault table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// What is wrong.
    pub cause: Cause,
    /// How much of it is a fault.
    pub limit: Limit,
    /// Reaction of an arm that works.
    pub reaction: Reaction,
    /// Reaction while it stops for another fault.
    pub stopping: Reaction,
    /// Reaction while the brake closes for another fault.
    pub closing: Reaction,
    /// What ends it.
    pub latch: Latch,
}

const fn row(
    cause: Cause,
    limit: Limit,
    [reaction, stopping, closing]: [Reaction; 3],
    latch: Latch,
) -> Row {
    Row {
        cause,
        limit,
        reaction,
        stopping,
        closing,
        latch,
    }
}

/// Every cause that is raised.
pub static REACTIONS: [Row; 12] = {
    use Latch::{Reset, Restart};
    use Limit::{AtOnce, EachAxis, Frames, Milliseconds};
    use Reaction::{Brake, EmergencyStop, None, Off, Stop};
    [
        row(Cause::SelfTest, AtOnce, [None, None, None], Restart),
        row(
            Cause::FeedbackLost,
            Milliseconds(MAX_GAP_MS),
            [Stop, Brake, None],
            Reset,
        ),
        row(
            Cause::PeerSilent,
            Milliseconds(PEER_TIMEOUT_MS),
            [Off, Off, Off],
            Reset,
        ),
        row(
            Cause::Reordered,
            Frames(BAD_FRAMES),
            [Stop, Brake, None],
            Reset,
        ),
        row(
            Cause::Corrupted,
            Frames(BAD_FRAMES),
            [Stop, Brake, None],
            Reset,
        ),
        // The checksum was right: it is the sender that is wrong, or this controller's own arithmetic.
        row(Cause::BadValue, Frames(BAD_FRAMES), [Off, Off, Off], Reset),
        row(Cause::FollowingError, EachAxis, [Stop, Brake, Off], Reset),
        row(Cause::OverSpeed, EachAxis, [Stop, Brake, Off], Reset),
        // An arm beyond its range stays there while it stops: that says nothing new.
        row(Cause::SoftLimit, EachAxis, [Stop, None, None], Reset),
        row(
            Cause::EStop,
            AtOnce,
            [EmergencyStop, EmergencyStop, EmergencyStop],
            Reset,
        ),
        row(Cause::DriveFault, AtOnce, [Brake, Brake, None], Reset),
        row(Cause::EncoderFault, AtOnce, [Off, Off, Off], Reset),
    ]
};

/// What a fault of this cause leads to in `state`.
pub(super) fn event(cause: Cause, state: State) -> Option<Event> {
    let row = REACTIONS.iter().find(|row| row.cause == cause)?;
    let reaction = match state.halt() {
        None | Some(Halt::Off) => row.reaction,
        Some(Halt::Stopping) => row.stopping,
        Some(Halt::Closing(_)) => row.closing,
    };
    match reaction {
        Reaction::None => None,
        Reaction::Stop => Some(Event::FaultStop),
        Reaction::Brake => Some(Event::FaultBrake),
        Reaction::Off => Some(Event::FaultOff),
        Reaction::EmergencyStop => Some(Event::EmergencyStop),
    }
}
