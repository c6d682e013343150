//! Moves for manual operation, against points of the tool along them.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::planned::{joints, plan_with, robot, two_kg};
use firmware::mechanics::arm::{ArmModel, IRB_930};
use firmware::mechanics::kinematics::{self, Elbow, Pose};
use firmware::trajectory::planner::Planner;
use firmware::trajectory::request::Target;
use firmware::trajectory::tool_speed::{self, PLANNED, REACH};
use firmware::trajectory::{Reference, Trajectory};
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;
use protocol::messages::{Posture, RefusalReason};

/// Velocities of points of the tool, m/s: a chain of two arms and a turning flange, differentiated by hand in f64.
fn points(arm: &ArmModel, Reference { q, qd, .. }: &Reference) -> f64 {
    let [one, two, wrist] = [0, 1, 3].map(|axis| f64::from(q[axis]));
    let [w1, w2, u, w4] = [0, 1, 2, 3].map(|axis| f64::from(qd[axis]));
    let (a, b) = (f64::from(arm.geometry.a1), f64::from(arm.geometry.a2));
    let around = |k: u8| {
        let yaw = one + two - wrist + f64::from(k) * std::f64::consts::TAU / 64.0;
        let (reach, turn) = (f64::from(REACH), w1 + w2 - w4);
        let x = -a * w1 * one.sin() - b * (w1 + w2) * (one + two).sin() - reach * turn * yaw.sin();
        let y = a * w1 * one.cos() + b * (w1 + w2) * (one + two).cos() + reach * turn * yaw.cos();
        (x * x + y * y + u * u).sqrt()
    };
    (0..64).map(around).fold(0.0, f64::max)
}

/// Greatest speed of a point of the tool at instants along the move.
fn fastest(arm: &ArmModel, trajectory: &Trajectory) -> f64 {
    let steps = 2000u16;
    let at = |k: u16| {
        let t = trajectory.duration() * f32::from(k) / f32::from(steps);
        points(arm, &trajectory.at(arm, t).unwrap())
    };
    (0..=steps).map(at).fold(0.0, f64::max)
}

/// The move as it is planned for manual operation, with two kilograms.
fn slow(arm: &ArmModel, from: &Vector4<f32>, target: Target, speed: f32) -> Option<Trajectory> {
    let mut planner = Planner::new();
    planner.keep_tool_slow(true);
    plan_with(planner, arm, &two_kg(), from, target, (speed, 0.0)).ok()
}

/// Greatest and median speed of the flange along a move, by differences of its positions in f64, m/s.
fn flange(trajectory: &Trajectory) -> (f64, f64) {
    let (geometry, steps) = (&IRB_930.geometry, 400u16);
    let [a, b] = [geometry.a1, geometry.a2].map(f64::from);
    let place = |t: f32| {
        let q = trajectory.at(&IRB_930, t).unwrap().q.map(f64::from);
        let x = a * q.x.cos() + b * (q.x + q.y).cos();
        let y = a * q.x.sin() + b * (q.x + q.y).sin();
        [x, y, -q.z]
    };
    let step = trajectory.duration() / f32::from(steps);
    let mut speeds: Vec<f64> = (0..steps)
        .map(|k| {
            let (t, next) = (f32::from(k) * step, f32::from(k + 1) * step);
            let (before, after) = (place(t), place(next));
            let way: f64 = (0..3).map(|i| (after[i] - before[i]).powi(2)).sum();
            way.sqrt() / f64::from(next - t)
        })
        .collect();
    speeds.sort_by(f64::total_cmp);
    (speeds[speeds.len() - 1], speeds[speeds.len() / 2])
}

/// m/s, and what rounding may add to it.
fn limit() -> f64 {
    f64::from(PLANNED) * (1.0 + 1e-5)
}

fn posed(arm: &ArmModel, radius: f32, angle: f32, z: f32) -> Option<(Pose, Vector4<f32>)> {
    let (y, x) = angle.sin_cos();
    let pose = Pose {
        x: radius * x,
        y: radius * y,
        z,
        yaw: angle,
    };
    let q = kinematics::inverse(arm, &pose, Elbow::Positive, &Vector4::zeros());
    q.ok().map(|q| (pose, q))
}

proptest! {
    #![proptest_config(common::draws::cases(200))]

    #[test]
    fn no_point_is_fast_on_a_move_in_joint_space(arm in robot(), from in joints(), to in joints(), speed in 0.05f32..1.0) {
        let trajectory = slow(&arm, &from, Target::Joints(to), speed).expect("it can be planned");
        let found = fastest(&arm, &trajectory);
        prop_assert!(found <= limit() * f64::from(speed), "{found}");
    }

    #[test]
    fn nor_on_a_jump(
        arm in robot(),
        r0 in 0.4f32..0.95, a0 in -1.0f32..1.0, r1 in 0.4f32..0.95, a1 in -1.0f32..1.0, rise in 0.0f32..0.1,
    ) {
        let (Some((_, from)), Some((pose, _))) = (posed(&arm, r0, a0, -0.3), posed(&arm, r1, a1, -0.3)) else {
            return Ok(());
        };
        let target = Target::Jump { pose, posture: Posture::NEAREST, top: -0.3 + rise, clearance: 0.0 };
        let Some(trajectory) = slow(&arm, &from, target, 1.0) else { return Ok(()) };
        let found = fastest(&arm, &trajectory);
        prop_assert!(found <= limit(), "{found}");
    }

    /// And there the limit is used: the flange has the same speed at every place of a line, which is long enough here to get to it.
    #[test]
    fn nor_on_a_line(
        arm in robot(), r0 in 0.4f32..0.6, a0 in -0.5f32..0.5, r1 in 0.7f32..0.9, a1 in -0.5f32..0.5, z in -0.3f32..-0.2,
    ) {
        let (Some((_, from)), Some((pose, _))) = (posed(&arm, r0, a0, -0.3), posed(&arm, r1, a1, z)) else {
            return Ok(());
        };
        let Some(trajectory) = slow(&arm, &from, Target::Line(pose, Posture::NEAREST), 1.0) else {
            return Ok(());
        };
        let found = fastest(&arm, &trajectory);
        // Some are slower for the rate of a torque at their ends.
        prop_assert!(found <= limit() + 1e-5 && found >= 0.9 * limit(), "{found}");
    }

    #[test]
    fn nor_on_an_arc(
        arm in robot(), r0 in 0.4f32..0.6, a0 in -0.5f32..0.5, r1 in 0.6f32..0.7, r2 in 0.7f32..0.9, a2 in -0.5f32..0.5, z in -0.3f32..-0.2,
    ) {
        let (Some((_, from)), Some((via, _)), Some((pose, _))) =
            (posed(&arm, r0, a0, -0.3), posed(&arm, r1, a0 + 0.3, -0.25), posed(&arm, r2, a2, z)) else {
            return Ok(());
        };
        let via = Vector3::new(via.x, via.y, via.z);
        let Some(trajectory) = slow(&arm, &from, Target::Arc(via, pose, Posture::NEAREST), 1.0) else { return Ok(()) };
        let found = fastest(&arm, &trajectory);
        prop_assert!(found <= limit() + 1e-5, "{found}");
    }
}

proptest! {
    #![proptest_config(common::draws::cases(200))]

    /// The speed that a line or an arc is asked for is that of the flange on nearly all of the way, unless the arm is slower; whatever
    /// share of full speed is asked for as well.
    #[test]
    fn the_flange_keeps_the_speed_that_is_asked_for(
        r in 0.45f32..0.75, a in -1.0f32..1.0, way in 0.1f32..0.2, heading in -3.1f32..3.1, bow in prop::option::of(0.2f32..1.5),
        mm_s in 1.0f32..400.0, speed in 0.5f32..=1.0, down in 0.0f32..0.1,
    ) {
        let Some((start, from)) = posed(&IRB_930, r, a, -0.2) else { return Ok(()) };
        let along = |along: f32, aside: f32| {
            let (s, c) = heading.sin_cos();
            Pose { x: start.x + along * c - aside * s, y: start.y + along * s + aside * c, z: -0.2 - down * along / way, yaw: start.yaw }
        };
        let (middle, end) = (along(0.5 * way, bow.unwrap_or(0.0) * 0.3 * way), along(way, 0.0));
        let target = match bow {
            None => Target::Line(end, Posture::NEAREST),
            Some(_) => Target::Arc(Vector3::new(middle.x, middle.y, middle.z), end, Posture::NEAREST),
        };
        let plan = |tool_speed| plan_with(Planner::new(), &IRB_930, &two_kg(), &from, target, (speed, tool_speed));
        let (Ok(free), Ok(bound)) = (plan(0.0), plan(mm_s / 1000.0)) else { return Ok(()) };
        let asked = f64::from(mm_s) / 1000.0;
        let (fastest, usual) = flange(&bound);
        // Differences of f32 positions: half a micrometre per step.
        let rounding = 1e-6 * 400.0 / f64::from(bound.duration());
        prop_assert!(fastest <= asked * 1.0001 + rounding, "{fastest} of {asked}");
        // Where the arm can go much faster, it is bound all the way, and slower only at the ends.
        if flange(&free).1 > 3.0 * asked {
            prop_assert!(usual >= 0.99 * asked - rounding, "{usual} of {asked}");
        }
        common::planned::check(&IRB_930, &two_kg(), &bound)?;
    }
}

#[test]
fn a_speed_of_no_tool_is_refused() {
    let (pose, from) = posed(&IRB_930, 0.6, 0.2, -0.2).unwrap();
    let end = Pose { z: -0.25, ..pose };
    let ask = |tool_speed| {
        let target = Target::Line(end, Posture::NEAREST);
        plan_with(
            Planner::new(),
            &IRB_930,
            &two_kg(),
            &from,
            target,
            (1.0, tool_speed),
        )
    };
    for wrong in [-0.1, 1e-5, f32::NAN] {
        assert_eq!(
            ask(wrong).unwrap_err().reason,
            RefusalReason::OutOfRange,
            "{wrong}"
        );
    }
    // 50 mm at 0.1 mm/s.
    let slowest = ask(1e-4).unwrap();
    assert!(
        (slowest.duration() - 500.0).abs() < 2.0,
        "{}",
        slowest.duration()
    );
}

/// An elbow that stretches or folds on the way is fastest, or slowest, there: the limit is used to a good part on such ways as well.
#[test]
fn the_stretched_arm_counts_where_it_is_passed() {
    let arm = IRB_930;
    for (from, to) in [
        // Both arms turn the same way, and the elbow passes zero.
        ([-0.5, -1.0, 0.1, 0.0], [0.5, 1.0, 0.1, 0.0]),
        // Against each other, and it does not.
        ([0.5, -2.0, 0.1, 0.0], [1.0, -0.2, 0.1, 0.0]),
        ([1.0, 0.3, 0.1, 0.0], [0.0, 2.4, 0.1, 0.0]),
        ([0.0, 1.0, 0.1, 0.0], [0.0, 1.0, 0.3, 3.0]),
    ] {
        let (from, to) = (Vector4::from(from), Vector4::from(to));
        let trajectory = slow(&arm, &from, Target::Joints(to), 1.0).unwrap();
        let found = fastest(&arm, &trajectory);
        assert!(
            found <= limit() && found > 0.6 * limit(),
            "{from} {to}: {found}"
        );
    }
}

/// By hand: 50 mm/s across and a turn of 1 rad/s 100 mm away are 150 mm/s, and 200 mm/s down makes that 250 mm/s.
#[test]
fn the_speed_of_the_tool_is_that_of_its_fastest_point() {
    for (velocity, speed) in [
        ([0.03, 0.04, 0.0, 0.0], 0.05),
        ([0.0, 0.0, 0.0, -2.0], 0.2),
        ([0.03, -0.04, 0.0, 1.0], 0.15),
        ([-0.03, 0.04, -0.2, -1.0], 0.25),
        ([0.1, 0.0, 0.0, 3.0], 0.4),
    ] {
        let found = tool_speed::of(&Vector4::from(velocity));
        assert!((found - speed).abs() < 1e-6, "{velocity:?}: {found}");
    }
}
