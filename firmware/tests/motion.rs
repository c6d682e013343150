//! Planned motion against the limits of the robot, judged by the recursive Newton-Euler dynamics, which the
//! planner does not use.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::planned::{check, joints, plan, robot, two_kg};
use firmware::mechanics::arm::{IRB_930, Payload};
use firmware::mechanics::body::Body;
use firmware::mechanics::kinematics::{self, Pose};
use firmware::trajectory::request::Target;
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;
use protocol::messages::{Posture, RefusalReason};

const GATE_A: Pose = Pose {
    x: 0.493_934,
    y: 0.106_066,
    z: -0.2713,
    yaw: 0.0,
};
const GATE_B: Pose = Pose {
    x: 0.706_066,
    y: -0.106_066,
    z: -0.2713,
    yaw: 0.0,
};

proptest! {
    #![proptest_config(common::draws::cases(500))]

    #[test]
    fn joint_moves_keep_every_limit(arm in robot(), from in joints(), to in joints(), mass in 0.0f32..22.0, speed in 0.05f32..1.0) {
        let payload = Payload { mass, ..two_kg() };
        let trajectory = plan(&arm, &payload, &from, Target::Joints(to), speed).unwrap();
        check(&arm, &payload, &trajectory)?;
        prop_assert!((trajectory.end - to).amax() < 1e-5);
    }

    #[test]
    fn jumps_keep_every_limit(
        arm in robot(),
        r0 in 0.4f32..0.95, a0 in -1.0f32..1.0, r1 in 0.4f32..0.95, a1 in -1.0f32..1.0,
        rise in 0.0f32..0.1, clearance in 0.0f32..0.05, mass in 0.0f32..22.0,
    ) {
        let payload = Payload { mass, ..two_kg() };
        let pose = |r: f32, a: f32| Pose { x: r * a.cos(), y: r * a.sin(), z: -0.3, yaw: 0.0 };
        let from = kinematics::inverse(&arm, &pose(r0, a0), kinematics::Elbow::Positive, &Vector4::zeros());
        let Ok(from) = from else { return Ok(()) };
        let top = -0.3 + rise;
        let target = Target::Jump { pose: pose(r1, a1), posture: Posture::NEAREST, top, clearance };
        let Ok(trajectory) = plan(&arm, &payload, &from, target, 1.0) else { return Ok(()) };
        check(&arm, &payload, &trajectory)?;
        // The gate: while the tool is within the clearance above one of its ends, it is vertically above it.
        let mut highest = f32::MIN;
        for i in 0..=400 {
            let t = trajectory.duration() * i as f32 / 400.0;
            let r = trajectory.at(&arm, t).unwrap();
            let tool = kinematics::forward(&IRB_930.geometry, &r.q);
            highest = highest.max(tool.z);
            let near = |p: &Pose| (tool.x - p.x).hypot(tool.y - p.y) < 1e-4;
            if tool.z < -0.3 + clearance.min(rise) - 1e-4 {
                prop_assert!(near(&pose(r0, a0)) || near(&pose(r1, a1)), "t {t} z {}", tool.z);
            }
        }
        prop_assert!(highest >= top - 1e-5, "{highest} {top}");
    }

    /// Free corners: never below the chamfer of the nearer end, whatever the heights; and never slower than the sharp rectangle.
    #[test]
    fn free_corners_keep_the_chamfer(
        r0 in 0.4f32..0.95, a0 in -1.5f32..1.5, r1 in 0.4f32..0.95, a1 in -1.5f32..1.5,
        near in prop::option::of(0.005f32..0.08), z0 in -0.4f32..-0.2, z1 in -0.4f32..-0.2,
        rise in 0.0f32..0.07, yaw in -3.0f32..3.0, mass in 0.0f32..22.0, speed in 0.2f32..1.0,
    ) {
        let payload = Payload { mass, ..two_kg() };
        let start = Pose { x: r0 * a0.cos(), y: r0 * a0.sin(), z: z0, yaw: 0.0 };
        let end = match near {
            // Short ones, where one stroke runs into the other.
            Some(way) => Pose { x: start.x + way * a1.cos(), y: start.y + way * a1.sin(), z: z1, yaw },
            None => Pose { x: r1 * a1.cos(), y: r1 * a1.sin(), z: z1, yaw },
        };
        // With both ends over each other neither is the nearer one.
        prop_assume!((start.x - end.x).hypot(start.y - end.y) > 5e-3);
        let top = z0.max(z1) + rise;
        let Ok(from) = kinematics::inverse(&IRB_930, &start, kinematics::Elbow::Positive, &Vector4::zeros())
        else { return Ok(()) };
        let to = |clearance| {
            plan(&IRB_930, &payload, &from, Target::Jump { pose: end, posture: Posture::NEAREST, top, clearance }, speed)
        };
        let Ok(trajectory) = to(0.0) else { return Ok(()) };
        check(&IRB_930, &payload, &trajectory)?;
        for i in 0..=1000 {
            let t = trajectory.duration() * i as f32 / 1000.0;
            let r = trajectory.at(&IRB_930, t).unwrap();
            let tool = kinematics::forward(&IRB_930.geometry, &r.q);
            let away = |p: &Pose| (tool.x - p.x).hypot(tool.y - p.y);
            let nearer = if away(&start) < away(&end) { start } else { end };
            let chamfer = away(&nearer).min(top - nearer.z);
            // Rounding of f32 kinematics, and the first micrometres of both curves.
            prop_assert!(tool.z - nearer.z > chamfer - 3e-5, "t {t} {tool:?} {}", tool.z - nearer.z - chamfer);
        }
        let rectangle = to(1.0).unwrap();
        // The last pass scales the two by samples at different instants.
        prop_assert!(
            trajectory.duration() <= rectangle.duration() * 1.005,
            "{} {}", trajectory.duration(), rectangle.duration()
        );
    }

    #[test]
    fn lines_are_straight_and_keep_every_limit(
        arm in robot(),
        x0 in 0.4f32..0.8, y0 in -0.3f32..0.3, x1 in 0.4f32..0.8, y1 in -0.3f32..0.3,
        z1 in -0.4f32..-0.13, yaw in -2.0f32..2.0,
    ) {
        let start = Pose { x: x0, y: y0, z: -0.2, yaw: 0.0 };
        let end = Pose { x: x1, y: y1, z: z1, yaw };
        let from = kinematics::inverse(&arm, &start, kinematics::Elbow::Positive, &Vector4::zeros()).unwrap();
        let Ok(trajectory) = plan(&arm, &two_kg(), &from, Target::Line(end, Posture::NEAREST), 1.0) else { return Ok(()) };
        check(&arm, &two_kg(), &trajectory)?;
        let along = Vector3::new(x1 - x0, y1 - y0, z1 + 0.2);
        for i in 0..=200 {
            let t = trajectory.duration() * i as f32 / 200.0;
            let r = trajectory.at(&arm, t).unwrap();
            let tool = kinematics::forward(&IRB_930.geometry, &r.q);
            let offset = Vector3::new(tool.x - x0, tool.y - y0, tool.z + 0.2);
            let aside = offset - along * (offset.dot(&along) / along.dot(&along).max(1e-9));
            // f32 kinematics there and back: about 10 u of a metre.
            let aside = aside.dot(&aside).sqrt();
            prop_assert!(aside < 2e-6, "{aside} aside");
        }
    }

    /// Up to 5 cm from the stretched arm and close to the base, where a joint moves most within a small part of the time.
    #[test]
    fn lines_anywhere_keep_every_limit(
        r0 in 0.4f32..1.0, a0 in -2.0f32..2.0, r1 in 0.4f32..1.0, a1 in -2.0f32..2.0,
        z1 in -0.4f32..-0.13, yaw in -2.0f32..2.0, mass in 0.0f32..22.0,
    ) {
        let payload = Payload { mass, ..two_kg() };
        let start = Pose { x: r0 * a0.cos(), y: r0 * a0.sin(), z: -0.2, yaw: 0.0 };
        let end = Pose { x: r1 * a1.cos(), y: r1 * a1.sin(), z: z1, yaw };
        let from = kinematics::inverse(&IRB_930, &start, kinematics::Elbow::Positive, &Vector4::zeros());
        let Ok(from) = from else { return Ok(()) };
        let Ok(trajectory) = plan(&IRB_930, &payload, &from, Target::Line(end, Posture::NEAREST), 1.0) else { return Ok(()) };
        check(&IRB_930, &payload, &trajectory)?;
    }
}

/// Analytic derivatives of a line against differences of its positions.
#[test]
fn derivatives_of_a_line_belong_to_its_positions() {
    let from = kinematics::inverse(
        &IRB_930,
        &GATE_A,
        kinematics::Elbow::Positive,
        &Vector4::zeros(),
    )
    .unwrap();
    let target = Target::Line(
        Pose {
            yaw: 1.0,
            z: -0.2,
            ..GATE_B
        },
        Posture::NEAREST,
    );
    let trajectory = plan(&IRB_930, &two_kg(), &from, target, 0.5).unwrap();
    let h = 1e-3;
    for i in 1..100 {
        let t = trajectory.duration() * i as f32 / 100.0;
        let [before, here, after] = [t - h, t, t + h].map(|t| trajectory.at(&IRB_930, t).unwrap());
        let qd = (after.q - before.q) / (2.0 * h);
        let qdd = (after.qd - before.qd) / (2.0 * h);
        // Differences of f32 positions: 2 u |q| / 2h = 2e-4; of speeds likewise; truncation h^2/6
        // times the next derivatives, at most 40000 rad/s^3 here.
        assert!((qd - here.qd).amax() < 1e-2, "{qd} {}", here.qd);
        assert!((qdd - here.qdd).amax() < 40_000.0 * h, "{qdd} {}", here.qdd);
    }
}

#[test]
fn the_gate_fills_the_torque_of_three_axes() {
    let from = kinematics::inverse(
        &IRB_930,
        &GATE_A,
        kinematics::Elbow::Positive,
        &Vector4::zeros(),
    )
    .unwrap();
    let target = Target::Jump {
        pose: GATE_B,
        posture: Posture::NEAREST,
        top: -0.2463,
        clearance: 0.005,
    };
    let there = plan(&IRB_930, &two_kg(), &from, target, 1.0).unwrap();
    let back = Target::Jump {
        pose: GATE_A,
        posture: Posture::NEAREST,
        top: -0.2463,
        clearance: 0.005,
    };
    let back = plan(&IRB_930, &two_kg(), &there.end, back, 1.0).unwrap();
    assert!(
        there.duration() + back.duration() < 0.38,
        "{}",
        there.duration() + back.duration()
    );
    let body = Body::new(&IRB_930, &two_kg());
    let mut peak = Vector4::<f32>::zeros();
    for i in 0..=1000 {
        let r = there
            .at(&IRB_930, there.duration() * i as f32 / 1000.0)
            .unwrap();
        let trig = kinematics::Trig::new(&r.q);
        peak = peak.sup(&body.inverse(&trig, &r.qd, &r.qdd).abs());
    }
    let share = peak.component_div(&IRB_930.limits.effort);
    assert!(
        share.x > 0.85 && share.y > 0.85 && share.z > 0.85,
        "{share}"
    );
}

/// 150 degrees are written as 2.617994 rad, which is 0.1 urad beyond the limit.
#[test]
fn a_joint_target_on_a_limit_may_be_rounded() {
    let home = Vector4::new(0.0, 1.5, 0.15, 0.0);
    let limits = &IRB_930.limits;
    for limit in [limits.lower, limits.upper] {
        let rounded = limit
            .map(|q| ((f64::from(q) * 1e6 + 0.5 * f64::from(q.signum())) as i64) as f32 * 1e-6);
        let trajectory = plan(&IRB_930, &two_kg(), &home, Target::Joints(rounded), 1.0).unwrap();
        let end = trajectory.at(&IRB_930, trajectory.duration()).unwrap();
        // From `home` by a rounded difference.
        assert!((end.q - limit).amax() < 1e-6, "{}", end.q);
        let beyond = limit + limit.map(|q| 1e-4 * if q < 1.0 { -1.0 } else { 1.0 });
        assert!(plan(&IRB_930, &two_kg(), &home, Target::Joints(beyond), 1.0).is_err());
    }
}

#[test]
fn refusals_name_axis_value_and_limit() {
    let home = Vector4::new(0.0, 1.5, 0.15, 0.0);
    let refuse = |target| plan(&IRB_930, &two_kg(), &home, target, 1.0).unwrap_err();
    let far = refuse(Target::Line(
        Pose {
            x: 2.0,
            y: 0.0,
            z: -0.2,
            yaw: 0.0,
        },
        Posture::NEAREST,
    ));
    assert_eq!(far.reason, RefusalReason::TooFar);
    assert_eq!((far.value, far.limit), (2.0, IRB_930.geometry.reach()));
    let limit = refuse(Target::Joints(Vector4::new(0.0, 3.0, 0.1, 0.0)));
    assert_eq!(
        (limit.reason, limit.axis, limit.value),
        (RefusalReason::JointLimit, 1, 3.0)
    );
    let low = refuse(Target::Jump {
        pose: GATE_B,
        posture: Posture::NEAREST,
        top: 1.0,
        clearance: 0.0,
    });
    assert_eq!((low.reason, low.axis), (RefusalReason::JointLimit, 2));
    let below = refuse(Target::Jump {
        pose: GATE_B,
        posture: Posture::NEAREST,
        top: -0.3,
        clearance: 0.0,
    });
    assert_eq!(below.reason, RefusalReason::OutOfRange);
    let nan = refuse(Target::Joints(Vector4::new(f32::NAN, 0.0, 0.0, 0.0)));
    assert_eq!(nan.reason, RefusalReason::NotFinite);
    // Through the stretched arm: both ends are fine, but the path is not.
    let bent = Vector4::new(-0.4, 0.4, 0.1, 0.0);
    let start = kinematics::forward(&IRB_930.geometry, &bent);
    let across = Target::Line(
        Pose {
            y: -start.y - 0.2,
            x: start.x - 0.3,
            ..start
        },
        Posture::NEAREST,
    );
    let beyond = Target::Line(
        Pose {
            x: 1.0499,
            y: 0.0,
            z: start.z,
            yaw: 0.0,
        },
        Posture::NEAREST,
    );
    let singular = plan(&IRB_930, &two_kg(), &bent, beyond, 1.0).unwrap_err();
    assert_eq!(singular.reason, RefusalReason::Singular);
    assert!(singular.value < singular.limit);
    assert!(plan(&IRB_930, &two_kg(), &bent, across, 1.0).is_ok());
    let fast = plan(&IRB_930, &two_kg(), &home, Target::Joints(home), 1.5).unwrap_err();
    assert_eq!(fast.reason, RefusalReason::OutOfRange);
    // A payload that the lift of this robot cannot hold.
    let anvil = Payload {
        mass: 90.0,
        ..two_kg()
    };
    let heavy = plan(
        &IRB_930,
        &anvil,
        &home,
        Target::Joints(Vector4::new(0.0, 1.5, 0.2, 0.0)),
        1.0,
    )
    .unwrap_err();
    assert_eq!(
        (heavy.reason, heavy.axis),
        (RefusalReason::TorqueTooSmall, 2)
    );
}

proptest! {
    #![proptest_config(common::draws::cases(500))]

    /// Of lines anywhere, many of which graze the inner limit of the elbow or turn the shoulder back: between the points that
    /// planning looks at, too, no joint leaves its range by more than rounding; shoulder and wrist, whose turning points are not
    /// looked for, by less than a milliradian.
    #[test]
    fn a_line_stays_inside_the_ranges_between_its_points(
        r0 in 0.25f32..1.02, a0 in -3.1f32..3.1, r1 in 0.25f32..1.02, a1 in -3.1f32..3.1, yaw in -6.0f32..6.0,
        positive in any::<bool>(),
    ) {
        let elbow = if positive { kinematics::Elbow::Positive } else { kinematics::Elbow::Negative };
        let start = Pose { x: r0 * a0.cos(), y: r0 * a0.sin(), z: -0.2, yaw: 0.0 };
        let end = Pose { x: r1 * a1.cos(), y: r1 * a1.sin(), z: -0.2, yaw };
        let Ok(from) = kinematics::inverse(&IRB_930, &start, elbow, &Vector4::zeros()) else { return Ok(()) };
        let Ok(trajectory) = plan(&IRB_930, &two_kg(), &from, Target::Line(end, Posture::NEAREST), 1.0) else { return Ok(()) };
        let limits = &IRB_930.limits;
        for i in 0..=4000 {
            let t = trajectory.duration() * i as f32 / 4000.0;
            let q = trajectory.at(&IRB_930, t).unwrap().q;
            let past = (limits.lower - q).sup(&(q - limits.upper));
            prop_assert!(past.y < 1e-5 && past.max() < 1e-3, "{past} past the limits at {q}");
        }
    }
}

/// A line whose nearest point to axis 1, between two points that planning looks at, bends the elbow 3 mrad too far.
#[test]
fn a_line_that_grazes_the_inner_limit_is_refused() {
    let [start, end] = [-0.833_333_3, 0.766_666_7].map(|y| Pose {
        x: 0.321_221_8,
        y,
        z: -0.25,
        yaw: 0.0,
    });
    let from = kinematics::inverse(
        &IRB_930,
        &start,
        kinematics::Elbow::Positive,
        &Vector4::zeros(),
    )
    .unwrap();
    let refusal = plan(
        &IRB_930,
        &two_kg(),
        &from,
        Target::Line(end, Posture::NEAREST),
        1.0,
    )
    .unwrap_err();
    assert_eq!(
        (refusal.reason, refusal.axis),
        (RefusalReason::JointLimit, 1)
    );
    assert!(
        (refusal.value - refusal.limit - 3.1e-3).abs() < 2e-4,
        "{refusal:?}"
    );
}
