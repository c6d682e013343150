//! Messages of every sample, and the controller's report.

use serde::{Deserialize, Serialize};

use super::{Cause, Compensation, Fault, FaultAxis, Law, Mode, Operation};
use crate::codes::bits;

/// Drives to controller, every sample: state of the motors at the sampling instant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Feedback {
    /// Number of the sample, counting up and wrapping.
    pub sample: u32,
    /// What the drives report about themselves.
    pub status: DriveStatus,
    /// Multi-turn encoder position, counts, per motor.
    pub position: [i32; 4],
    /// Shaft speed, rad/s, per motor.
    pub velocity: [f32; 4],
    /// Torque per thousand of rated torque, averaged over the sample just ended, per motor (CiA 402 object 6077h).
    pub torque: [i16; 4],
}

bits! {
    /// What the drives report about themselves.
    pub struct DriveStatus: u8 {
        /// Powered, no fault, ready for torque.
        READY = 0, "ready";
        /// Power stage on.
        TORQUE_ON = 1, "torque-on";
        /// Holding brake of the lift released.
        BRAKE_RELEASED = 2, "brake-released";
        /// At least one motor could not give the commanded torque.
        TORQUE_SATURATED = 3, "torque-saturated";
        /// Emergency stop input active.
        ESTOP_INPUT = 4, "estop-input";
        /// A drive is in fault.
        FAULT = 5, "fault";
        /// Positions come from the encoders and are referenced.
        ENCODER_VALID = 6, "encoder-valid";
        /// The newest command was late: it answers a sample of 2 ms before, or older.
        COMMAND_LATE = 7, "command-late";
    }
}

/// Controller to drives, every sample: applied when it arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Command {
    /// Sample number of the feedback that this answers.
    pub sample: u32,
    /// Switch commands for the drives.
    pub control: ControlWord,
    /// Torque, N m, per motor.
    pub torque: [f32; 4],
}

bits! {
    /// Switch commands for the drives.
    pub struct ControlWord: u8 {
        /// Power stage on; without it the motors give no torque, whatever is commanded.
        TORQUE_ENABLE = 0, "torque-enable";
        /// Release the holding brake of the lift.
        BRAKE_RELEASE = 1, "brake-release";
        /// A controlled stop is under way.
        QUICK_STOP = 2, "quick-stop";
        /// The controller is in emergency stop.
        ESTOP = 3, "estop";
    }
}

/// Controller to all, 50 Hz: report of the cabinet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct State {
    /// State of the system.
    pub mode: Mode,
    /// First cause of the latched fault, or none.
    pub cause: Cause,
    /// Saturations since the last report; a saturation is not a fault.
    pub limits: LimitFlags,
    /// Motions accepted and not yet completed.
    pub queue: u8,
    /// Sequence number of the last motion completed.
    pub completed: u8,
    /// Samples that took longer than the sampling period; saturates.
    #[serde(with = "postcard::fixint::le")]
    pub overruns: u16,
    /// Frames dropped by decoding or for their counter; saturates.
    #[serde(with = "postcard::fixint::le")]
    pub rejected: u16,
    /// Most expensive sample so far in the board's cycle unit; 0 if it has no cycle counter.
    #[serde(with = "postcard::fixint::le")]
    pub worst_tick: u32,
    /// Control law in use.
    pub law: Law,
    /// Compensation in use.
    pub compensation: Compensation,
    /// Reference minus measurement, joint units (rad, rad, m, rad).
    pub tracking_error: [f32; 4],
    /// Axis of the latched fault. This field and those after it were added later in place of padding: 0 in frames
    /// of older nodes.
    pub fault_axis: FaultAxis,
    /// Value that led to the latched fault, in the unit of [`Fault::unit`].
    pub fault_value: f32,
    /// Limit, in the same unit; 0 if the cause has none.
    pub fault_limit: f32,
    /// Share of its planned speed at which a move passes or would pass now, %: less than 100 with a speed override, and where the
    /// controller has slowed down by itself.
    pub pace: u8,
    /// How the arm is operated.
    pub operation: Operation,
    /// Mass that the lift feels beyond the announced payload, by its weight, 10 g.
    #[serde(with = "postcard::fixint::le")]
    pub burden: i16,
}

impl State {
    /// The latched fault.
    #[must_use]
    pub const fn fault(&self) -> Fault {
        Fault {
            cause: self.cause,
            axis: self.fault_axis,
            value: self.fault_value,
            limit: self.fault_limit,
        }
    }
}

bits! {
    /// Saturations of the control step.
    pub struct LimitFlags: u16 {
        /// Torque of the shoulder motor.
        TORQUE_SHOULDER = 0, "torque-shoulder";
        /// Torque of the elbow motor.
        TORQUE_ELBOW = 1, "torque-elbow";
        /// Torque of the lift motor.
        TORQUE_LIFT = 2, "torque-lift";
        /// Torque of the wrist motor.
        TORQUE_WRIST = 3, "torque-wrist";
        /// Speed of the shoulder. Reserved: not raised yet.
        VELOCITY_SHOULDER = 4, "velocity-shoulder";
        /// Speed of the elbow. Reserved: not raised yet.
        VELOCITY_ELBOW = 5, "velocity-elbow";
        /// Speed of the lift. Reserved: not raised yet.
        VELOCITY_LIFT = 6, "velocity-lift";
        /// Speed of the wrist. Reserved: not raised yet.
        VELOCITY_WRIST = 7, "velocity-wrist";
        /// Shoulder at its soft limit. Reserved: not raised yet.
        POSITION_SHOULDER = 8, "position-shoulder";
        /// Elbow at its soft limit. Reserved: not raised yet.
        POSITION_ELBOW = 9, "position-elbow";
        /// Lift at its soft limit. Reserved: not raised yet.
        POSITION_LIFT = 10, "position-lift";
        /// Wrist at its soft limit. Reserved: not raised yet.
        POSITION_WRIST = 11, "position-wrist";
        /// Jacobian inverse damped near the stretched arm. Reserved: not raised yet.
        DAMPED = 12, "damped";
        /// A lost sample was bridged by prediction.
        PREDICTED = 13, "predicted";
        /// Moves begin more slowly than they were planned, because a motor is warm.
        WARM = 14, "warm";
    }
}
