//! What can be changed while the controller runs, by requests and by parameters.

use protocol::messages::{Compensation, Law};
use protocol::parameters::ControllerParameter as Parameter;
use serde::{Deserialize, Serialize};

use crate::control::laws::{Gains, Selection};
use crate::control::monitor::MonitorLimits;
use crate::mechanics::arm::{ArmModel, Payload};

/// What can be changed while the controller runs. Plain fields, each written between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// What the flange carries.
    pub payload: Payload,
    /// Control law.
    pub selection: Selection,
    /// Time from a sample until its command acts at the drives, s.
    pub command_delay: f32,
    /// Time the brake takes to open or close, s.
    pub brake_delay: f32,
    /// What stops the arm.
    pub monitor: MonitorLimits,
    /// Age of the feedback at which the drives count as silent, s.
    pub feedback_timeout: f32,
    /// Time without a heartbeat after which a node whose heartbeat was heard counts as silent, s.
    pub heartbeat_timeout: f32,
    /// Time for which one hold lets moves go on in manual operation, s.
    pub hold_time: f32,
    /// Time at a torque limit of an axis that hardly moves that stops the arm, s.
    pub saturation_time: f32,
    /// Time constant with which a motor warms up and cools down, s.
    pub thermal_time: f32,
    /// Rejected, stale or duplicate feedback frames in a row that stop the arm.
    pub bad_frames: u32,
}

impl Setup {
    /// Defaults of the parameter table for a sampling period (s), with gains that the encoders of `arm` bear: no payload, computed torque
    /// with observer.
    pub fn new(arm: &ArmModel, period: f32) -> Self {
        Self {
            payload: Payload::NONE,
            selection: Selection {
                law: Law::ComputedTorqueJoint,
                compensation: Compensation::Observer,
                gains: Gains::for_arm(arm, period),
            },
            command_delay: const { Parameter::CommandDelay.initial(1.0) },
            brake_delay: const { Parameter::BrakeDelay.initial(1.0) },
            monitor: MonitorLimits::DEFAULT,
            feedback_timeout: const { Parameter::FeedbackTimeout.initial(1.0) },
            heartbeat_timeout: const { Parameter::HeartbeatTimeout.initial(1.0) },
            hold_time: const { Parameter::HoldTime.initial(1.0) },
            saturation_time: const { Parameter::SaturationTime.initial(1.0) },
            thermal_time: const { Parameter::ThermalTime.initial(1.0) },
            bad_frames: const { Parameter::BadFrames.initial(1.0) as u32 },
        }
    }
}
