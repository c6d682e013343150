//! Properties of the kinematics: forward and inverse undo each other, velocities agree, and limits hold.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use std::f64::consts::TAU;

use common::{U, assert_close, irb_930_short, position, speed};
use firmware::mechanics::arm::{ArmModel, Axis, IRB_930};
use firmware::mechanics::jacobian::Jacobian;
use firmware::mechanics::kinematics::{
    Elbow, IkError, LIMIT_TOLERANCE, Pose, REACH_TOLERANCE, Trig, Wrist, forward, inverse,
    link_frames, locate, rotation, solve,
};
use firmware::mechanics::velocity::propagate;
use nalgebra::{Matrix3, Vector3, Vector4};
use proptest::prelude::*;

fn real_arm() -> impl Strategy<Value = ArmModel> {
    prop_oneof![Just(IRB_930), Just(irb_930_short())]
}

/// Error of a coordinate of the flange for exact inputs: 2.5 u and 9.1 u of sine and cosine, two roundings.
fn position_error(arm: &ArmModel) -> f64 {
    U * (5.0 * f64::from(arm.geometry.a1) + 12.0 * f64::from(arm.geometry.a2))
}

fn distance(a: &Pose, b: &Pose) -> f64 {
    f64::from(a.x - b.x)
        .hypot(f64::from(a.y - b.y))
        .hypot(f64::from(a.z - b.z))
}

fn is_within_limits(arm: &ArmModel, q: &Vector4<f32>) -> bool {
    let limits = &arm.limits;
    Axis::ALL
        .into_iter()
        .all(|axis| (axis.of(&limits.lower)..=axis.of(&limits.upper)).contains(&axis.of(q)))
}

/// Difference of two angles, ignoring whole turns.
fn turn_between(a: f32, b: f32) -> f64 {
    let turn = f64::from(a) - f64::from(b);
    (turn - TAU * (turn / TAU).round()).abs()
}

proptest! {
    #![proptest_config(common::draws::cases(1024))]

    /// Any posture within the limits has a pose, and that pose has a joint position for either elbow that leads back to it.
    ///
    /// The error of the pose is that of two forward computations and of the solution seen from the flange. The elbow
    /// passes on the error of the radius: 4 u of it, and REACH_TOLERANCE where it is clamped; elbow and theta1 are
    /// rounded, at most 8 u of pi each, times the reach.
    #[test]
    fn forward_of_inverse_is_the_pose(arm in real_arm(), q in position()) {
        let pose = forward(&arm.geometry, &q);
        let reach = f64::from(arm.geometry.reach());
        let solution = 4.0 * U + f64::from(REACH_TOLERANCE) + 2.0 * 8.0 * U * std::f64::consts::PI;
        let bound = 2.0 * position_error(&arm) + solution * reach;
        for elbow in [Elbow::Positive, Elbow::Negative] {
            let found = solve(&arm.geometry, &pose, elbow);
            let found = found.map_err(|error| TestCaseError::fail(error.to_string()))?;
            let again = forward(&arm.geometry, &found);
            prop_assert!(distance(&again, &pose) <= bound, "{:e} of {bound:e}", distance(&again, &pose));
            // theta4 compensates the errors of theta1 and theta2, so yaw has only roundings: of sums up to 14 rad, and
            // wraps.
            prop_assert!(turn_between(again.yaw, pose.yaw) <= 40.0 * U);
            prop_assert!(found.y == 0.0 || Elbow::of(&found) == elbow);
        }
    }

    /// The joint position itself is recovered, with its wrist turn, to the accuracy that the posture's conditioning
    /// allows.
    #[test]
    fn inverse_of_forward_is_the_position(arm in real_arm(), q in position()) {
        let sine = f64::from(q.y).sin().abs();
        prop_assume!(sine > 0.02);
        let (a1, a2) = (f64::from(arm.geometry.a1), f64::from(arm.geometry.a2));
        let pose = forward(&arm.geometry, &q);
        let found = inverse(&arm, &pose, Elbow::of(&q), &q);
        let found = found.map_err(|error| TestCaseError::fail(error.to_string()))?;
        // d theta2 = r dr / (a1 a2 sin theta2); the angle at the shoulder moves by at most a2 (a1 + a2) / r^2 of that,
        // and by the error of the position over r. Second order: below the first while theta2 moves less than its sine.
        let r = f64::from(pose.x).hypot(f64::from(pose.y));
        let dr = 2.0 * position_error(&arm) + 6.0 * U * (a1 + a2);
        let bend = 2.0 * r * dr / (a1 * a2 * sine) + 8.0 * U * 3.0;
        let shoulder = bend * a2 * (a1 + a2) / (r * r) + 2.0 * position_error(&arm) / r + 8.0 * U * 4.0;
        let bound = Vector4::new(shoulder, bend, 4.0 * U, shoulder + bend + 40.0 * U);
        assert_close("q", &found, &q.map(f64::from), &bound);
    }

    /// The frames of the table, chained, end in the pose of the closed form.
    #[test]
    fn link_frames_chain_to_the_flange(arm in real_arm(), q in position()) {
        let trig = Trig::new(&q);
        let (mut turn, mut origin) = (Matrix3::identity(), Vector3::zeros());
        for frame in link_frames(&arm.geometry, &trig, q.z) {
            turn *= frame.rotation;
            origin += turn * frame.offset;
        }
        let pose = forward(&arm.geometry, &q);
        let closed = Vector3::new(pose.x, pose.y, pose.z);
        prop_assert!(f64::from((origin - closed).amax()) <= 2.0 * position_error(&arm));
        // Entries of a product of rotations: 3.5 u per turn, and three sums each.
        prop_assert!(f64::from((turn - rotation(&trig)).amax()) <= 40.0 * U);
        // Likewise for their angle; yaw is a sum up to 12 rad, wrapped.
        prop_assert!(turn_between(turn.m21.atan2(turn.m11), pose.yaw) <= 80.0 * U);
    }

    /// Two ways to the velocity of the flange: link by link, and through the Jacobian.
    #[test]
    fn propagated_velocity_is_that_of_the_jacobian(arm in real_arm(), q in position(), qd in speed()) {
        let trig = Trig::new(&q);
        let [_, _, _, flange] = propagate(&link_frames(&arm.geometry, &trig, q.z), &qd);
        let turn = rotation(&trig);
        let (linear, angular) = (turn * flange.linear, turn * flange.angular);
        let found = Vector4::new(linear.x, linear.y, linear.z, angular.z);
        let expected = Jacobian::new(&arm.geometry, &trig).task_velocity(&qd).map(f64::from);
        let rate = f64::from(qd.x.abs() + qd.y.abs());
        // Four turns out and one back, 7 u each with the sums; and the Jacobian's own error.
        let planar = rate * (position_error(&arm) + 40.0 * U * f64::from(arm.geometry.reach()));
        let bound = Vector4::new(planar, planar, U * f64::from(qd.z.abs()), 8.0 * U * (rate + f64::from(qd.w.abs())));
        assert_close("velocity", &found, &expected, &bound);
        prop_assert_eq!((angular.x, angular.y), (0.0, 0.0));
    }

    /// A wrist solution is the nearest turn that the limits allow.
    #[test]
    fn wrist_takes_the_nearest_turn(q in position(), near in -20.0..=20.0f32) {
        let arm = IRB_930;
        let pose = forward(&arm.geometry, &q);
        let hint = Vector4::new(0.0, 0.0, 0.0, near);
        // Close to the stretched arm the shoulder may exceed its limit by more than the tolerance.
        prop_assume!(q.y.abs() > 0.5);
        let found = inverse(&arm, &pose, Elbow::of(&q), &hint);
        let found = found.map_err(|error| TestCaseError::fail(error.to_string()))?;
        let (lower, upper) = (arm.limits.lower.w, arm.limits.upper.w);
        prop_assert!((lower..=upper).contains(&found.w));
        let gap = (f64::from(found.w) - f64::from(near)).abs();
        for turns in [-3, -2, -1, 1, 2, 3] {
            let other = f64::from(found.w) + TAU * f64::from(turns);
            let slack = f64::from(LIMIT_TOLERANCE) * f64::from(upper - lower);
            if other > f64::from(lower) + slack && other < f64::from(upper) - slack {
                prop_assert!((other - f64::from(near)).abs() >= gap - 40.0 * U, "{other} is nearer to {near} than {}", found.w);
            }
        }
    }

    /// The wrist is in the turn asked for, or past its limit by that turn.
    #[test]
    fn wrist_takes_the_turn_asked_for(q in position(), turn in -3i8..=3) {
        // Close to the stretched arm the shoulder may exceed its limit by more than the tolerance.
        let mut q = q;
        if q.y.abs() < 0.5 {
            q.y += 1.0;
        }
        let pose = forward(&IRB_930.geometry, &q);
        let turns = TAU * f64::from(turn);
        // Half a revolution away, to within rounding, either turn is right.
        let own = f64::from(q.w) - TAU * (f64::from(q.w) / TAU).round();
        let slack = 100.0 * U;
        prop_assume!(own.abs() < std::f64::consts::PI - slack);
        let expected = own + turns;
        let (lower, upper) = (f64::from(IRB_930.limits.lower.w), f64::from(IRB_930.limits.upper.w));
        match locate(&IRB_930, &pose, Elbow::of(&q), Wrist::Turn(turn)) {
            Ok(found) => prop_assert!((f64::from(found.w) - expected).abs() < slack, "{found} {expected}"),
            Err(IkError::Limit { axis: Axis::Wrist, value, .. }) => {
                prop_assert!((f64::from(value) - expected).abs() < slack, "{value} {expected}");
                prop_assert!(expected < lower + slack || expected > upper - slack, "{expected}");
            }
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

    /// An arm at a limit can be commanded to stay where it is.
    #[test]
    fn pose_on_a_limit_has_a_solution(arm in real_arm(), inside in position(), on_upper: [bool; 4], which in 1..16u8) {
        let mut q = inside;
        for axis in 0..4 {
            if which & (1 << axis) != 0 {
                q[axis] = if on_upper[axis] { arm.limits.upper[axis] } else { arm.limits.lower[axis] };
            }
        }
        // Close to the stretched arm the shoulder angle is not determined to the tolerance.
        prop_assume!(q.y.abs() > 0.5);
        let pose = forward(&arm.geometry, &q);
        let found = inverse(&arm, &pose, Elbow::of(&q), &q);
        let found = found.map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert!((found.w - q.w).abs() < 1.0, "the wrist jumps a turn: {found} for {q}");
        prop_assert!(is_within_limits(&arm, &found), "{found}");
    }

    /// Any input, of any bits, gives either a position within the limits or an error.
    #[test]
    fn inverse_is_total(x: u32, y: u32, z: u32, yaw: u32, near: u32, negative: bool) {
        let [x, y, z, yaw, near] = [x, y, z, yaw, near].map(f32::from_bits);
        let elbow = if negative { Elbow::Negative } else { Elbow::Positive };
        let hint = Vector4::new(0.0, 0.0, 0.0, near);
        if let Ok(q) = inverse(&IRB_930, &Pose { x, y, z, yaw }, elbow, &hint) {
            prop_assert!(is_within_limits(&IRB_930, &q));
        }
    }
}

const DOWN: f32 = -0.2;

fn refusal(x: f32, y: f32, z: f32) -> IkError {
    let pose = Pose { x, y, z, yaw: 0.0 };
    inverse(&IRB_930, &pose, Elbow::Positive, &Vector4::zeros()).expect_err("out of reach")
}

#[test]
fn refusals_name_cause_and_limit() {
    let max = IRB_930.geometry.reach();
    assert_eq!(
        refusal(1.2, 0.0, DOWN),
        IkError::TooFar { radius: 1.2, max }
    );
    let min = IRB_930.geometry.a1 - IRB_930.geometry.a2;
    assert_eq!(
        refusal(0.0, 0.01, DOWN),
        IkError::TooNear { radius: 0.01, min }
    );
    assert_eq!(refusal(f32::NAN, 0.0, DOWN), IkError::NotFinite);
    let IkError::Limit { axis, value, limit } = refusal(0.8, 0.0, 0.5) else {
        panic!("lift too high")
    };
    assert_eq!((axis, limit), (Axis::Lift, 0.0));
    assert!(value < limit);
    let IkError::Limit { axis, limit, .. } = refusal(0.2, 0.0, DOWN) else {
        panic!("elbow too far bent")
    };
    assert_eq!((axis, limit), (Axis::Elbow, IRB_930.limits.upper.y));
    let IkError::Limit { axis, .. } = refusal(-0.9, 0.0, DOWN) else {
        panic!("behind the base")
    };
    assert_eq!(axis, Axis::Shoulder);
}

#[test]
fn boundary_has_its_tolerance_and_no_more() {
    let reach = IRB_930.geometry.reach();
    let at = |x: f32| {
        let pose = Pose {
            x,
            y: 0.0,
            z: DOWN,
            yaw: 0.0,
        };
        solve(&IRB_930.geometry, &pose, Elbow::Positive)
    };
    let stretched = at(reach * (1.0 + 0.5 * REACH_TOLERANCE)).expect("within the tolerance");
    assert_eq!(stretched.y, 0.0);
    assert!(at(reach * (1.0 + 2.0 * REACH_TOLERANCE)).is_err());
}

/// Links of equal length can fold until the flange is on the shoulder axis, where theta1 is free: any value will do.
#[test]
fn equal_arms_reach_their_own_axis() {
    let mut geometry = IRB_930.geometry;
    geometry.a2 = geometry.a1;
    let pose = Pose {
        x: 0.0,
        y: 0.0,
        z: DOWN,
        yaw: 0.0,
    };
    let q = solve(&geometry, &pose, Elbow::Positive).expect("reachable");
    assert_eq!(q.y, std::f32::consts::PI);
}
