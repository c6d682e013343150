//! Arcs that cannot be.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::planned::{plan, two_kg};
use firmware::mechanics::arm::IRB_930;
use firmware::mechanics::kinematics::{self, Elbow, Pose};
use firmware::trajectory::curve::MIN_HEIGHT;
use firmware::trajectory::request::Target;
use nalgebra::{Vector3, Vector4};
use protocol::messages::{Posture, RefusalReason};

fn stand() -> (Vector4<f32>, Pose) {
    let q = Vector4::new(0.3, 1.2, 0.15, 0.2);
    (q, kinematics::forward(&IRB_930.geometry, &q))
}

/// Where a circle is not to be found.
#[test]
fn points_on_one_line_are_refused_by_name() {
    let (from, start) = stand();
    let point = |x: f32, y: f32| Pose {
        x: start.x + x,
        y: start.y + y,
        ..start
    };
    let refused = |via: Pose, end: Pose| {
        let via = Vector3::new(via.x, via.y, via.z);
        plan(
            &IRB_930,
            &two_kg(),
            &from,
            Target::Arc(via, end, Posture::NEAREST),
            1.0,
        )
        .unwrap_err()
    };
    let end = point(-0.1, 0.05);
    let cases = [
        ("between", point(-0.05, 0.025), end),
        ("before", point(0.05, -0.025), end),
        ("beyond", point(-0.15, 0.075), end),
        ("at the start", start, end),
        ("at the end", end, end),
        ("end at the start", point(-0.05, 0.025), start),
        ("all at one place", start, start),
        // 90 um beside the line.
        (
            "hardly beside it",
            point(-0.05 + 0.00004, 0.025 + 0.00008),
            end,
        ),
    ];
    for (what, via, end) in cases {
        let refusal = refused(via, end);
        assert_eq!(refusal.reason, RefusalReason::NoCircle, "{what}");
        assert!(
            refusal.value < MIN_HEIGHT && refusal.limit == MIN_HEIGHT,
            "{what}: {refusal:?}"
        );
    }
    let far = refused(
        Pose {
            x: f32::NAN,
            ..start
        },
        end,
    );
    assert_eq!(far.reason, RefusalReason::NotFinite);
    // 110 um beside the line it is an arc.
    let via = Vector3::new(
        start.x - 0.05 + 0.000_049,
        start.y + 0.025 + 0.000_098,
        start.z,
    );
    assert!(
        plan(
            &IRB_930,
            &two_kg(),
            &from,
            Target::Arc(via, end, Posture::NEAREST),
            1.0
        )
        .is_ok()
    );
}

/// Both ends are in reach, the way is not: too far out, through the stretched arm, too near, past the end of the lift.
#[test]
fn an_arc_that_leaves_the_work_space_is_refused() {
    let arc = |start: [f32; 3], via: [f32; 3], end: [f32; 3]| {
        let pose = |[x, y, z]: [f32; 3]| Pose { x, y, z, yaw: 0.0 };
        let from = kinematics::inverse(&IRB_930, &pose(start), Elbow::Positive, &Vector4::zeros())
            .unwrap();
        plan(
            &IRB_930,
            &two_kg(),
            &from,
            Target::Arc(via.into(), pose(end), Posture::NEAREST),
            1.0,
        )
    };
    let reach = IRB_930.geometry.reach();
    let bulge = |out: f32| arc([0.9, 0.15, -0.2], [out, 0.0, -0.2], [0.9, -0.15, -0.2]);
    assert_eq!(
        bulge(reach + 0.05).unwrap_err().reason,
        RefusalReason::TooFar
    );
    let singular = bulge(reach - 2e-4).unwrap_err();
    assert_eq!(singular.reason, RefusalReason::Singular);
    assert!(singular.value < singular.limit);
    assert!(bulge(reach - 0.02).is_ok());
    let inner = arc([0.5, 0.3, -0.2], [0.1, 0.0, -0.2], [0.5, -0.3, -0.2]).unwrap_err();
    assert!(
        matches!(
            inner.reason,
            RefusalReason::JointLimit | RefusalReason::TooNear
        ),
        "{inner:?}"
    );
    let high = arc([0.6, 0.1, -0.2], [0.6, 0.0, 0.1], [0.6, -0.1, -0.2]).unwrap_err();
    assert_eq!((high.reason, high.axis), (RefusalReason::JointLimit, 2));
    let low = arc([0.6, 0.1, -0.2], [0.6, 0.0, -0.25], [1.6, -0.1, -0.2]).unwrap_err();
    assert_eq!(low.reason, RefusalReason::TooFar);
}
