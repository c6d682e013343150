//! Torque limits: the output of a law, cut to what joints and motors can give.
//!
//! Saturation is not a fault: a cut only sets a flag in the state message and holds the integrals.

use nalgebra::Vector4;
use protocol::messages::LimitFlags;

use crate::mechanics::arm::ArmModel;
use crate::mechanics::dynamics::drive::Drive;
use crate::mechanics::math::clamp;

/// Torques within every limit, and what was cut off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limited {
    /// Motor torques, N m.
    pub motor_torque: Vector4<f32>,
    /// What was cut off, at the joint or else at the motor (N m, lift N): with the sign of the torque, 0 where
    /// nothing was.
    pub excess: Vector4<f32>,
    /// Axes whose torque was cut.
    pub flags: LimitFlags,
}

const TORQUE: [LimitFlags; 4] = [
    LimitFlags::TORQUE_SHOULDER,
    LimitFlags::TORQUE_ELBOW,
    LimitFlags::TORQUE_LIFT,
    LimitFlags::TORQUE_WRIST,
];

/// Cuts joint torques (N m, lift N) to the limits of the joints, then of the motors.
pub fn cut(arm: &ArmModel, drive: &Drive, torque: &Vector4<f32>) -> Limited {
    let motor_torque = drive.motor_torque(torque);
    if fits(torque, &arm.limits.effort) && fits(&motor_torque, &arm.drive.motor_torque_limit) {
        // Nearly always.
        return Limited {
            motor_torque,
            excess: Vector4::zeros(),
            flags: LimitFlags::EMPTY,
        };
    }
    cut_down(arm, drive, torque)
}

// Out of line: rare in a sample.
#[inline(never)]
fn cut_down(arm: &ArmModel, drive: &Drive, torque: &Vector4<f32>) -> Limited {
    let joint = torque.zip_map(&arm.limits.effort, within);
    let wanted = drive.motor_torque(&joint);
    let motor_torque = wanted.zip_map(&arm.drive.motor_torque_limit, within);
    let excess = (torque - joint).zip_map(&(wanted - motor_torque), |joint, motor| {
        if joint == 0.0 { motor } else { joint }
    });
    let flags = excess
        .iter()
        .zip(TORQUE)
        .filter(|(cut, _)| **cut != 0.0)
        .fold(LimitFlags::EMPTY, |flags, (_, axis)| flags | axis);
    Limited {
        motor_torque,
        excess,
        flags,
    }
}

/// Whether no torque exceeds its limit; NaN does.
fn fits(torque: &Vector4<f32>, limit: &Vector4<f32>) -> bool {
    torque
        .iter()
        .zip(limit.iter())
        .all(|(torque, limit)| torque.abs() <= *limit)
}

/// `torque` cut to a magnitude; NaN stays NaN.
fn within(torque: f32, limit: f32) -> f32 {
    clamp(torque, -limit, limit)
}
