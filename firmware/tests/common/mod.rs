//! Shared by the tests of mathematics and motion: random arms and positions, units of error, and plans.
#![allow(dead_code)] // Each test binary uses its own part.

pub(crate) mod draws;
pub(crate) mod magnitude;
pub(crate) mod planned;
pub(crate) mod queued;

use firmware::mechanics::arm::{ArmModel, Geometry, IRB_930, Link, Payload};
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;

/// Unit roundoff of f32, as in the doc comments.
pub(crate) const U: f64 = 1.0 / (1u32 << 24) as f64;

/// The short variant of the IRB 930: 12 kg at 0.85 m.
pub(crate) fn irb_930_short() -> ArmModel {
    let mut arm = IRB_930;
    arm.geometry.a1 = 0.36;
    arm.links[0] = Link {
        mass: 9.5,
        com: Vector3::new(0.145, 0.0, -0.0547),
        inertia: Vector3::new(0.045, 0.25, 0.26),
    };
    arm.payload_max = 12.0;
    arm
}

/// A joint position inside the limits of the IRB 930.
pub(crate) fn position() -> impl Strategy<Value = Vector4<f32>> {
    let (lower, upper) = (IRB_930.limits.lower, IRB_930.limits.upper);
    (
        lower.x..=upper.x,
        lower.y..=upper.y,
        lower.z..=upper.z,
        lower.w..=upper.w,
    )
        .prop_map(|(a, b, c, d)| Vector4::new(a, b, c, d))
}

/// A joint vector within plus or minus `bound`.
pub(crate) fn within(bound: Vector4<f32>) -> impl Strategy<Value = Vector4<f32>> {
    let unit = -1.0..=1.0f32;
    (unit.clone(), unit.clone(), unit.clone(), unit)
        .prop_map(move |(a, b, c, d)| Vector4::new(a, b, c, d).component_mul(&bound))
}

/// Joint speeds up to the limits of the IRB 930.
pub(crate) fn speed() -> impl Strategy<Value = Vector4<f32>> {
    within(IRB_930.limits.velocity)
}

/// Joint accelerations up to those that the torques of the IRB 930 give it.
pub(crate) fn acceleration() -> impl Strategy<Value = Vector4<f32>> {
    within(Vector4::new(60.0, 120.0, 60.0, 600.0))
}

fn offset() -> impl Strategy<Value = Vector3<f32>> {
    let side = -0.4..=0.4f32;
    (side.clone(), side.clone(), side).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn inertia() -> impl Strategy<Value = Vector3<f32>> {
    let moment = 1e-3..=1.0f32;
    (moment.clone(), moment.clone(), moment).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn link() -> impl Strategy<Value = Link> {
    (0.1..=30.0f32, offset(), inertia()).prop_map(|(mass, com, inertia)| Link {
        mass,
        com,
        inertia,
    })
}

/// A body at the flange with its centre of mass anywhere, or none.
pub(crate) fn payload() -> impl Strategy<Value = Payload> {
    let held = (0.0..=22.0f32, offset(), inertia()).prop_map(|(mass, com, inertia)| Payload {
        mass,
        com,
        inertia,
    });
    prop_oneof![1 => Just(Payload::NONE), 4 => held]
}

/// An arm with links of any length, and centres of mass off axis and off plane; or one of the two real ones.
pub(crate) fn arm() -> impl Strategy<Value = ArmModel> {
    let lengths = (0.05..=1.2f32, 0.05..=1.2f32, -0.5..=0.5f32, -0.5..=0.5f32);
    let links = [link(), link(), link(), link()];
    let random =
        (lengths, links, 0.0..=15.0f32).prop_map(|((a1, a2, d1, d4), links, gravity)| ArmModel {
            geometry: Geometry { a1, a2, d1, d4 },
            links,
            gravity,
            ..IRB_930
        });
    prop_oneof![1 => Just(IRB_930), 1 => Just(irb_930_short()), 6 => random]
}

/// Asserts `|actual - expected| <= bound` for each joint.
#[track_caller]
pub(crate) fn assert_close(
    what: &str,
    actual: &Vector4<f32>,
    expected: &Vector4<f64>,
    bound: &Vector4<f64>,
) {
    for joint in 0..4 {
        let error = (f64::from(actual[joint]) - expected[joint]).abs();
        assert!(
            error <= bound[joint],
            "{what}, joint {}: {} against {}, error {error:e}, allowed {:e}",
            joint + 1,
            actual[joint],
            expected[joint],
            bound[joint],
        );
    }
}
