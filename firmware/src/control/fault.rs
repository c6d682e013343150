//! The fault table: one row per cause, with its limit, its reactions and what clears it.
//!
//! The reaction depends on what can still be trusted:
//!
//! * A controlled stop closes the loop through the encoders. A lost or wrong encoder therefore rules it out: the
//!   motor's commutation depends on the encoder too, so not even an open-loop torque would act as intended. Brake and
//!   torque off, at once.
//! * A stop is watched like a move. A fault found while the arm stops closes the brake in the same sample; torque
//!   carries the lift until the brake holds it.
//! * An axis that does not follow even while the brake closes has a loop that does not work: torque off.
//! * A drive in fault may be the one of the lift, whose load then only the brake can hold: brake first.
//!
//! The limits are the defaults of parameters. The test `faults` compares this table with the one in `docs/safety.md`.

use protocol::messages::Cause;
use protocol::parameters::ControllerParameter as Parameter;

use super::states::{Event, Halt, State};

/// Longest gap in the feedback across which the trajectory continues, ms. Within it an arm at full speed strays by less
/// than the following error allows: 60 rad/s² x (5 ms)² / 2 is 0.75 mrad at the shoulder.
pub const MAX_GAP_MS: u32 = milliseconds(Parameter::FeedbackGap);
/// Age of the feedback at which the drives count as silent, ms: the watchdog time of moteus and the heartbeat of ODrive.
/// The drives have switched off long before, after 5 samples without a command.
pub const PEER_TIMEOUT_MS: u32 = milliseconds(Parameter::FeedbackTimeout);
/// Time without a heartbeat after which a node whose heartbeat was heard counts as silent, ms: two that are lost, and a third that
/// is late.
pub const HEARTBEAT_TIMEOUT_MS: u32 = milliseconds(Parameter::HeartbeatTimeout);
/// Time at a torque limit of an axis that hardly moves, ms: longer than any start or turning back takes, and short beside the
/// seconds in which a motor at its peak torque heats up.
pub const SATURATION_MS: u32 = milliseconds(Parameter::SaturationTime);
/// Consecutive rejected, stale or repeated feedback frames that stop the arm: two can be noise, and even at 500 Hz
/// three last no longer than an allowed gap.
pub const BAD_FRAMES: u16 = Parameter::BadFrames.initial(1.0) as u16;
/// Frames in a row that are no message, with no feedback in between, of a flooded bus: those of eight bytes fill one of 1 Mbit/s for 4 ms.
pub const FLOOD: u16 = 32;
/// And in a longer time, 1/s: other devices leave more of the bus free.
pub const FLOOD_RATE: f32 = 3000.0;
/// Samples in a row that take too long, and stop the arm: as many as samples for which the drives hold a command. A computer without a real-time
/// system is late now and then.
pub const OVERRUNS: u8 = 5;

/// Swing of the torques from sample to sample that stops the arm, %, as [`Chatter`](super::chatter::Chatter) counts it: a fifth of one motor's
/// limit to both sides. Encoders that are off by two counts make half of that at 2 kHz.
pub const CHATTER_PERCENT: u16 = 80;
/// Heat of a motor that stops the arm, % of what it may have for ever: see [`Heat`](super::heat::Heat).
pub const OVERLOAD_PERCENT: u16 = 120;

/// Default of a parameter given in s, in ms.
const fn milliseconds(parameter: Parameter) -> u32 {
    (parameter.initial(1.0) * 1e3 + 0.5) as u32
}

/// How much of a violation is a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Any of it.
    AtOnce,
    /// Longer than this, ms.
    Milliseconds(u32),
    /// This many frames in a row.
    Frames(u16),
    /// This many samples in a row.
    Samples(u8),
    /// More than this share, %.
    Percent(u16),
    /// [`MonitorLimits`](super::monitor::MonitorLimits): a limit per axis, for a number of consecutive samples.
    EachAxis,
}

/// Reaction to a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing beyond what is already going on.
    None,
    /// Controlled stop, brake, torque off.
    Stop,
    /// Brake at once; torque off once it has closed.
    Brake,
    /// Brake and torque off at once.
    Off,
    /// Like a stop, into the state that only the end of the emergency leaves.
    EmergencyStop,
}

/// What ends a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Latch {
    /// An operator's reset.
    Reset,
    /// A restart of the controller.
    Restart,
}

/// A row of the fault table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// What is wrong.
    pub cause: Cause,
    /// How much of it is a fault.
    pub limit: Limit,
    /// Reaction in normal operation.
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

/// Every cause that the controller raises.
pub static REACTIONS: [Row; 23] = {
    use Latch::{Reset, Restart};
    use Limit::{AtOnce, EachAxis, Frames, Milliseconds, Percent, Samples};
    use Reaction::{Brake, EmergencyStop, None, Off, Stop};
    [
        row(Cause::SelfTest, AtOnce, [None, None, None], Restart),
        row(
            Cause::FeedbackLost,
            Milliseconds(MAX_GAP_MS),
            [Stop, Brake, None],
            Reset,
        ),
        row(Cause::Babbling, Frames(FLOOD), [Stop, Brake, None], Reset),
        row(Cause::BusOff, AtOnce, [Stop, Brake, None], Reset),
        row(
            Cause::Overrun,
            Samples(OVERRUNS),
            [Stop, Brake, None],
            Reset,
        ),
        row(
            Cause::PeerSilent,
            Milliseconds(PEER_TIMEOUT_MS),
            [Off, Off, Off],
            Reset,
        ),
        // Nobody is there to see what the arm does, and nothing is wrong with it.
        row(
            Cause::OperatorSilent,
            Milliseconds(HEARTBEAT_TIMEOUT_MS),
            [Stop, None, None],
            Reset,
        ),
        row(
            Cause::Reordered,
            Frames(BAD_FRAMES),
            [Stop, Brake, None],
            Reset,
        ),
        // As long as it lasts, the stop meets it in every sample.
        row(Cause::Late, Frames(BAD_FRAMES), [Stop, None, None], Reset),
        row(
            Cause::Corrupted,
            Frames(BAD_FRAMES),
            [Stop, Brake, None],
            Reset,
        ),
        // As long as somebody else sends its commands, the stop meets them in every sample.
        row(Cause::DuplicateNode, AtOnce, [Stop, None, None], Reset),
        // The checksum was right: the sender is wrong, or this controller's own arithmetic.
        row(Cause::BadValue, Frames(BAD_FRAMES), [Off, Off, Off], Reset),
        row(Cause::FollowingError, EachAxis, [Stop, Brake, Off], Reset),
        row(Cause::StuckSensor, EachAxis, [Off, Off, Off], Reset),
        row(Cause::OverSpeed, EachAxis, [Stop, Brake, Off], Reset),
        row(
            Cause::OverTorque,
            Milliseconds(SATURATION_MS),
            [Stop, Brake, None],
            Reset,
        ),
        // An arm beyond its range stays there while it stops: no new information.
        row(Cause::SoftLimit, EachAxis, [Stop, None, None], Reset),
        row(
            Cause::EStop,
            AtOnce,
            [EmergencyStop, EmergencyStop, EmergencyStop],
            Reset,
        ),
        row(Cause::DriveFault, AtOnce, [Brake, Brake, None], Reset),
        row(Cause::EncoderFault, AtOnce, [Off, Off, Off], Reset),
        // Whatever it has met, it must not go on pressing against it.
        row(Cause::Collision, EachAxis, [Stop, Off, Off], Reset),
        // The loop that a stop would need is the one that does not work.
        row(
            Cause::Chatter,
            Percent(CHATTER_PERCENT),
            [Off, Off, Off],
            Reset,
        ),
        row(
            Cause::Overload,
            Percent(OVERLOAD_PERCENT),
            [Stop, None, None],
            Reset,
        ),
    ]
};

/// The event that a fault of this cause raises in `state`.
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
