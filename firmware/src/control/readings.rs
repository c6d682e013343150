//! What the drives report.

use nalgebra::Vector4;
use protocol::messages::DriveStatus;

use crate::mechanics::arm::Axis;

/// Speed of a motor up to which its encoder does not move, rad/s: some counts in a sample.
const STILL: f32 = 0.5;

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
        axis.of(&self.velocity).abs() <= STILL
    }

    /// Whether the motor of an axis moves against its torque and faster than at `before`, rad/s.
    pub fn defies_torque(&self, axis: Axis, before: f32) -> bool {
        let velocity = axis.of(&self.velocity);
        velocity * axis.of(&self.torque) < 0.0 && velocity.abs() > before.abs()
    }
}
