//! Known answers, checked before anything moves: a wrong build or a broken FPU stays in self-test.

use core::f32::consts::{FRAC_PI_3, FRAC_PI_4, FRAC_PI_6};

use nalgebra::Vector4;

use crate::mechanics::arm::{ArmModel, IRB_930};
use crate::mechanics::kinematics::{self, Elbow};
use crate::mechanics::math::sin_cos;

/// Largest error of a known answer: a few roundings of values of order one.
const TOLERANCE: f32 = 2e-6;

/// Checks mathematics, kinematics and the model.
///
/// # Errors
/// A known answer is wrong or the model is not valid.
pub fn run(arm: &ArmModel) -> Result<(), ()> {
    let close = |a: f32, b: f32| (a - b).abs() <= TOLERANCE;
    // sin and cos of 30 degrees; the pose that q = (30°, 60°, 0.1 m, 45°) has on paper.
    let (sin, cos) = sin_cos(FRAC_PI_6);
    let trigonometry = close(sin, 0.5) && close(cos, 0.866_025_4);
    let q = Vector4::new(FRAC_PI_6, FRAC_PI_3, 0.1, FRAC_PI_4);
    let pose = kinematics::forward(&IRB_930.geometry, &q);
    let forward = close(pose.x, 0.484_974_23)
        && close(pose.y, 0.77)
        && close(pose.z, -0.2213)
        && close(pose.yaw, FRAC_PI_4);
    let inverse = kinematics::inverse(&IRB_930, &pose, Elbow::Positive, &q)
        .is_ok_and(|back| (back - q).amax() <= TOLERANCE);
    if trigonometry && forward && inverse && arm.validate().is_ok() {
        Ok(())
    } else {
        Err(())
    }
}
