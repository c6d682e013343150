//! What the drives report.

use nalgebra::Vector4;
use protocol::messages::{DriveStatus, Feedback};

use crate::mechanics::arm::Axis;

/// Speed of a motor up to which its encoder does not move, rad/s: some counts in a sample.
const STILL: f32 = 0.5;
/// How much faster a motor gets within some samples whose encoder makes its loop drive it away. One that is pushed with a force that the
/// torque resists does not.
const FASTER: f32 = 1.25;

/// Drive readings of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings {
    /// Samples since the last readings: 1, or more where feedback was lost.
    pub steps: u32,
    /// State of the drives.
    pub status: DriveStatus,
    /// Motor encoder counts.
    pub counts: [i32; 4],
    /// Motor velocities, rad/s, means over the last sample.
    pub velocity: Vector4<f32>,
    /// Motor torques, N m, means over the last sample.
    pub torque: Vector4<f32>,
}

impl Readings {
    /// Whether the encoder of an axis does not move. Asked of the motor: the lift moves with the wrist as well.
    pub fn is_still(&self, axis: Axis) -> bool {
        is_still(axis.of(&self.velocity))
    }

    /// The same of these readings and of those with the velocity `before`, rad/s. An axis that turns back stands for an instant only.
    pub fn stays_still(&self, axis: Axis, before: f32) -> bool {
        self.is_still(axis) && is_still(before)
    }

    /// Whether the velocities are what the encoders show, and not the greatest that can be said.
    pub fn is_measured(&self) -> bool {
        self.velocity.abs().max() < Feedback::MAX_VELOCITY
    }

    /// Whether the motor of an axis moves against its torque and faster than at `before`, rad/s.
    pub fn defies_torque(&self, axis: Axis, before: f32) -> bool {
        let velocity = axis.of(&self.velocity);
        velocity * axis.of(&self.torque) < 0.0 && velocity.abs() > before.abs()
    }

    /// The same for one that went the same way before and is quite some faster now.
    pub fn runs_away(&self, axis: Axis, before: f32) -> bool {
        let velocity = axis.of(&self.velocity);
        self.defies_torque(axis, FASTER * before) && velocity * before > 0.0
    }
}

fn is_still(velocity: f32) -> bool {
    velocity.abs() <= STILL
}
