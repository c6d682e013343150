//! Network management, emergency stop, emergency, heartbeat, and the codes they share with the rest.

use serde::{Deserialize, Serialize};

use super::Fault;
use crate::codes::codes;

codes! {
    /// Participants of the link, by CANopen node id.
    pub enum Node {
        /// Drives of the four axes, on one node.
        Drives = 0x40, "drives";
        /// Controller.
        Controller = 0x41, "controller";
        /// Operator: command line, panel or test bench.
        Operator = 0x42, "operator";
    }
}

/// Network management command (CiA 301), unprotected because CANopen fixes its two bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Nmt {
    /// What to do.
    pub command: NmtCommand,
    /// Node addressed; 0 addresses all.
    pub node: u8,
}

impl Nmt {
    /// Command to `node` to restart.
    #[must_use]
    pub const fn reset(node: Node) -> Self {
        Self {
            command: NmtCommand::ResetNode,
            node: node.code(),
        }
    }
}

codes! {
    /// Command specifiers of CiA 301.
    pub enum NmtCommand {
        /// Enter operational.
        Start = 1, "start";
        /// Enter stopped.
        Stop = 2, "stop";
        /// Enter pre-operational.
        PreOperational = 128, "pre-operational";
        /// Restart the application.
        ResetNode = 129, "reset-node";
        /// Restart the communication.
        ResetCommunication = 130, "reset-communication";
    }
}

/// Emergency stop, from any node, repeated until acted upon.
///
/// Unprotected on purpose: a frame on this identifier stops the robot even if it is empty, because one stop too many
/// costs less than one too few.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EStop {
    /// Origin. For the log only: every value stops.
    pub reason: EStopReason,
    /// Counts the repetitions. For the log only.
    pub counter: u8,
}

/// Origin of an emergency stop: a byte of which any value is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EStopReason(pub u8);

impl EStopReason {
    /// Not given, as in an empty frame.
    pub const UNSPECIFIED: Self = Self(0);
    /// A person pressed a button.
    pub const BUTTON: Self = Self(1);
    /// Requested by the sender's software.
    pub const SOFTWARE: Self = Self(2);
}

/// Emergency object (CiA 301): sent once when a fault is latched, and once with cause none when all are cleared.
///
/// Its eight bytes are fixed by CANopen and leave no room for counter or CRC: nothing may act on it. The
/// controller acts on its own observation, and the protected [`Heartbeat`] repeats the cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Emergency {
    /// Emergency error code of CiA 301 and CiA 402.
    #[serde(with = "postcard::fixint::le")]
    pub code: u16,
    /// Error register (object 1001h).
    pub error_register: u8,
    /// Latched cause.
    pub cause: Cause,
    /// Value that led to the fault, as the bits of an f32 in the unit of [`Fault::unit`].
    #[serde(with = "postcard::fixint::le")]
    pub data: u32,
}

impl Emergency {
    /// Value that led to the fault; 0 if the bits are not a finite number. Its unit is that of [`Emergency::fault`].
    #[must_use]
    pub const fn value(&self) -> f32 {
        let value = f32::from_bits(self.data);
        if value.is_finite() { value } else { 0.0 }
    }

    /// The fault, as far as eight bytes can describe it: the [`State`](super::State) that follows adds axis and limit.
    #[must_use]
    pub const fn fault(&self) -> Fault {
        Fault::value(self.cause, self.value(), 0.0)
    }

    /// Emergency of this cause, with the code and error register that CiA 301 and CiA 402 give it.
    #[must_use]
    pub const fn new(cause: Cause, data: u32) -> Self {
        Self {
            code: cause.error_code(),
            error_register: cause.error_register(),
            cause,
            data,
        }
    }
}

/// Sign of life, from each node at 10 Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Heartbeat {
    /// State of the node.
    pub state: Mode,
    /// Latched cause.
    pub cause: Cause,
    /// Reason of the node's last start.
    pub reset: ResetReason,
}

codes! {
    /// Why a node started.
    pub enum ResetReason {
        /// Supply switched on.
        PowerOn = 0, "power-on";
        /// Reset pin.
        Pin = 1, "pin";
        /// Requested by software or network management.
        Software = 2, "software";
        /// Watchdog expired.
        Watchdog = 3, "watchdog";
        /// Supply too low.
        BrownOut = 4, "brown-out";
        /// Panic handler.
        Panic = 5, "panic";
        /// Hard fault or stack overflow.
        HardFault = 6, "hard-fault";
    }
}

codes! {
    /// State of the system.
    pub enum Mode {
        /// Started, nothing checked yet.
        Boot = 0, "boot";
        /// Self-test; stays here on failure.
        SelfTest = 1, "self-test";
        /// Passed the self-test; waiting for its peers.
        PreOperational = 2, "pre-operational";
        /// Ready to be enabled.
        Ready = 3, "ready";
        /// Torque on, brake opening.
        Enabling = 4, "enabling";
        /// Under torque, holding position.
        Enabled = 5, "enabled";
        /// Under torque, on a motion.
        Moving = 6, "moving";
        /// Controlled stop requested.
        QuickStop = 7, "quick-stop";
        /// Controlled stop after a fault.
        FaultReaction = 8, "fault-reaction";
        /// Torque off after a fault; latched.
        Fault = 9, "fault";
        /// Torque off after an emergency stop; latched.
        EStop = 10, "estop";
        /// The brake closes while torque still holds the arm; then torque goes off.
        Disabling = 11, "disabling";
    }
}

codes! {
    /// First cause of a latched fault.
    pub enum Cause {
        /// No fault.
        None = 0, "none";
        /// A known answer or the robot model was wrong at start.
        SelfTest = 1, "self-test";
        /// Too many feedback frames in a row did not arrive.
        FeedbackLost = 2, "feedback-lost";
        /// A peer has been silent for longer than its watchdog allows.
        PeerSilent = 3, "peer-silent";
        /// Frames arrived late or in the wrong order.
        Reordered = 4, "reordered";
        /// Frames arrived with a wrong end-to-end checksum.
        Corrupted = 5, "corrupted";
        /// Another node sends what only the controller sends: a second controller, or a log that is played.
        DuplicateNode = 6, "duplicate-node";
        /// A position does not change although the axis is off its reference or at its torque limit: encoder or axis is stuck.
        StuckSensor = 7, "stuck-sensor";
        /// A node floods the bus, so that feedback does not arrive.
        Babbling = 8, "babbling";
        /// The CAN controller has taken itself off the bus after too many errors.
        BusOff = 9, "bus-off";
        /// Values that are not numbers or out of range: in frames that arrived, or as the result of a control law.
        BadValue = 10, "bad-value";
        /// An axis is too far from its reference.
        FollowingError = 11, "following-error";
        /// An axis is faster than allowed.
        OverSpeed = 12, "over-speed";
        /// An axis that hardly moves has been at its torque limit for too long: it is blocked, or its loop chatters.
        OverTorque = 13, "over-torque";
        /// An axis has left its range.
        SoftLimit = 14, "soft-limit";
        /// The control step took longer than a sample several times in a row.
        Overrun = 15, "overrun";
        /// The emergency stop was pressed or sent.
        EStop = 16, "estop";
        /// The drives report a fault, that they have switched off by themselves, or that the brake has not closed.
        DriveFault = 17, "drive-fault";
        /// An encoder is not valid, jumps further than the axis can move, or moves against its torque, as with a wrong sign.
        EncoderFault = 19, "encoder-fault";
        /// The operator's heartbeat was heard, and has stopped.
        OperatorSilent = 20, "operator-silent";
        /// An axis moves otherwise than by its torque and the model: it has met something, or its encoder is late.
        Collision = 21, "collision";
        /// The torque of an axis swings from sample to sample: its loop is not stable.
        Chatter = 22, "chatter";
        /// A motor is hotter than it may be for ever, and moving more slowly has not helped.
        Overload = 23, "overload";
        /// The answers of the controller reach the drives too late, with the feedback or the command held up on its way.
        Late = 24, "late";
    }
}

impl Cause {
    /// Emergency error code (CiA 301 table of codes; 2310h, 7300h, 83xxh, 84xxh and 86xxh from CiA 402).
    #[must_use]
    pub const fn error_code(self) -> u16 {
        match self {
            Self::None => 0x0000,
            Self::Overload => 0x2310,
            Self::DriveFault => 0x5000,
            Self::SelfTest | Self::Overrun => 0x6100,
            Self::StuckSensor | Self::EncoderFault => 0x7300,
            Self::Babbling => 0x8110,
            Self::PeerSilent | Self::OperatorSilent => 0x8130,
            Self::BusOff => 0x8140,
            Self::DuplicateNode => 0x8150,
            Self::Reordered | Self::Late | Self::Corrupted | Self::BadValue => 0x8200,
            Self::FeedbackLost => 0x8250,
            Self::Chatter => 0x8300,
            Self::OverTorque => 0x8311,
            Self::Collision => 0x8331,
            Self::OverSpeed => 0x8400,
            Self::FollowingError => 0x8611,
            Self::SoftLimit => 0x8612,
            Self::EStop => 0x9000,
        }
    }

    /// Error register (CiA 301 object 1001h): bit 0 generic, bit 1 current, bit 4 communication, bit 5 device profile.
    #[must_use]
    pub const fn error_register(self) -> u8 {
        match self.error_code() {
            0x0000 => 0,
            0x2310 => 1 | 1 << 1,
            0x8100..=0x82FF => 1 | 1 << 4,
            0x7300 | 0x8300..=0x86FF => 1 | 1 << 5,
            _ => 1,
        }
    }
}
