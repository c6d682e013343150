//! Known answers, checked before anything moves: a wrong build or a broken FPU never leaves self-test.

use core::f32::consts::{FRAC_PI_3, FRAC_PI_4, FRAC_PI_6};
use core::hint::black_box;

use nalgebra::Vector4;
use protocol::e2e::Profile;
use protocol::messages::KnownAnswer;

use crate::mechanics::arm::{ArmModel, IRB_930};
use crate::mechanics::kinematics::{self, Elbow};
use crate::mechanics::math::sin_cos;

// What is asked comes out of a `black_box`: the compiler would work out the answer, and nothing of the processor or its memory be tested.

/// Largest error of a known answer: a few roundings of values of order one.
const TOLERANCE: f32 = 2e-6;

/// Checks mathematics, kinematics, CRCs and the model.
///
/// # Errors
/// The first known answer that is wrong.
// Run once: small before fast.
#[cold]
#[inline(never)]
pub(crate) fn run(arm: &ArmModel) -> Result<(), KnownAnswer> {
    let failed = |right, answer| if right { Ok(()) } else { Err(answer) };
    failed(sine(), KnownAnswer::Sine)?;
    failed(kinematics(), KnownAnswer::Kinematics)?;
    failed(crc(), KnownAnswer::Crc)?;
    failed(arm.validate().is_ok(), KnownAnswer::Model)
}

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= TOLERANCE
}

/// Sine and cosine of 30 degrees.
fn sine() -> bool {
    let (sin, cos) = sin_cos(black_box(FRAC_PI_6));
    close(sin, 0.5) && close(cos, 0.866_025_4)
}

/// The pose of q = (30°, 60°, 0.1 m, 45°), worked out by hand, and back.
fn kinematics() -> bool {
    let q = black_box(Vector4::new(FRAC_PI_6, FRAC_PI_3, 0.1, FRAC_PI_4));
    let pose = kinematics::forward(&IRB_930.geometry, &q);
    close(pose.x, 0.484_974_23)
        && close(pose.y, 0.77)
        && close(pose.z, -0.2213)
        && close(pose.yaw, FRAC_PI_4)
        && kinematics::inverse(&IRB_930, &pose, Elbow::Positive, &q)
            .is_ok_and(|back| (back - q).amax() <= TOLERANCE)
}

/// The catalogued check values of both CRCs, for the digits 1 to 9; the first two are passed as the data id.
fn crc() -> bool {
    let id = u16::from_be_bytes(black_box(*b"12"));
    Profile::Fd.check(id, b"3456789\x29\xB1").is_some()
        && Profile::Classical.check(id, b"3456789\xDF").is_some()
        && Profile::Fd.check(id, b"3456789\x29\xB0").is_none()
        && Profile::Classical.check(id, b"3456789\xDE").is_none()
}
