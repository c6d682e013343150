//! Torque limits: what a law asks for, cut to what joints and motors can give.
//!
//! Limited is not failed: a cut is a flag in the state message and holds the integrals, no more.

use nalgebra::Vector4;

use crate::arm::ArmModel;
use crate::dynamics::drive::Drive;
use crate::math::clamp;

/// Torques within every limit, and what that took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limited {
    /// Motor torques, N m.
    pub motor_torque: Vector4<f32>,
    /// Sign of the axes whose torque was cut, 0 where none was.
    pub saturated: Vector4<f32>,
    /// Bit i: axis i was cut.
    pub flags: u16,
}

/// Cuts joint torques (N m, lift N) to the limits of the joints, then of the motors.
pub fn cut(arm: &ArmModel, drive: &Drive, torque: &Vector4<f32>) -> Limited {
    let within = |t: f32, limit: f32| clamp(t, -limit, limit);
    let joint = torque.zip_map(&arm.limits.effort, within);
    let wanted = drive.motor_torque(&joint);
    let motor_torque = wanted.zip_map(&arm.drive.motor_torque_limit, within);
    let sign = |asked: f32, given: f32| {
        if asked > given {
            1.0
        } else if asked < given {
            -1.0
        } else {
            0.0
        }
    };
    let by_joint = torque.zip_map(&joint, sign);
    let by_motor = wanted.zip_map(&motor_torque, sign);
    let saturated = by_joint.zip_map(&by_motor, |j, m| if j == 0.0 { m } else { j });
    let flags = saturated
        .iter()
        .zip([1u16, 2, 4, 8])
        .filter(|(cut, _)| **cut != 0.0)
        .fold(0, |flags, (_, bit)| flags | bit);
    Limited {
        motor_torque,
        saturated,
        flags,
    }
}
