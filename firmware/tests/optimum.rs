//! Gates against the optimum: how much longer a planned round trip takes than the fastest that the torques allow.
//!
//! The optimum is from another program: direct collocation of the model with rotors, friction and screw, limited by torque (without
//! any rise time) and speed, over a gate of 25, 300, 25 mm whose corners are free above the same chamfer.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::planned::plan;
use firmware::mechanics::arm::{IRB_930, Payload};
use firmware::mechanics::kinematics::{Elbow, Pose, Wrist, locate};
use firmware::trajectory::request::Target;
use nalgebra::Vector3;
use protocol::messages::Posture;

/// Middle of the stroke: distance from axis 1 (m); and the angle between stroke and radius (degrees).
const PLACES: [(f32, f32); 7] = [
    (0.60, 135.0),
    (0.70, 90.0),
    (0.70, 0.0),
    (0.70, 45.0),
    (0.95, 90.0),
    (0.85, 0.0),
    (0.45, 90.0),
];
/// Payload (kg), round trips in those places at the optimum (s), and how much longer ours take at most, in the mean.
const OPTIMA: [(f32, [f32; 7], f32); 4] = [
    (0.0, [0.231, 0.313, 0.238, 0.326, 0.313, 0.280, 0.339], 1.18),
    (2.0, [0.254, 0.328, 0.257, 0.337, 0.334, 0.281, 0.348], 1.18),
    (
        12.0,
        [0.355, 0.399, 0.343, 0.388, 0.423, 0.336, 0.395],
        1.17,
    ),
    (
        22.0,
        [0.441, 0.472, 0.421, 0.446, 0.500, 0.401, 0.458],
        1.17,
    ),
];

/// Round trip of the plans, s.
fn round_trip(payload: &Payload, radius: f32, degrees: f32) -> f32 {
    let half = 0.15;
    let (sin, cos) = degrees.to_radians().sin_cos();
    let pose = |side: f32| Pose {
        x: radius + side * half * cos,
        y: side * half * sin,
        z: -0.25,
        yaw: 0.0,
    };
    let here = |side| locate(&IRB_930, &pose(side), Elbow::Positive, Wrist::Near(0.0)).unwrap();
    let one_way = |side: f32| {
        let target = Target::Jump {
            pose: pose(-side),
            posture: Posture::NEAREST,
            top: -0.225,
            clearance: 0.0,
        };
        let planned = plan(&IRB_930, payload, &here(side), target, 1.0).unwrap();
        planned.duration()
    };
    one_way(-1.0) + one_way(1.0)
}

#[test]
fn gates_come_close_to_the_optimum() {
    for (mass, optima, most) in OPTIMA {
        let payload = Payload {
            mass,
            com: Vector3::new(0.0, 0.0, 0.05),
            inertia: Vector3::new(0.004, 0.004, 0.005) * mass,
        };
        let ratios = PLACES
            .iter()
            .zip(optima)
            .map(|((radius, degrees), optimum)| round_trip(&payload, *radius, *degrees) / optimum);
        let ratios: Vec<f32> = ratios.collect();
        let mean = ratios.iter().sum::<f32>() / ratios.len() as f32;
        println!("{mass} kg: {mean:.3} of {ratios:.3?}");
        assert!(
            mean < most && ratios.iter().all(|ratio| *ratio > 1.0),
            "{mass} kg: {ratios:?}"
        );
    }
}
