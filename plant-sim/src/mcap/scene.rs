//! The arm as simple bodies, each fixed to the frame that it moves with.

use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, Duration, Pose, Quaternion, SceneEntity, SceneUpdate,
    Timestamp, Vector3,
};
use sim::model::Geometry;

// Sizes for the eye alone, m.
const BASE: f64 = 0.14;
const FLOOR: f64 = -0.35;
const ARM: f64 = 0.08;
const ARM_HEIGHT: f64 = 0.06;
/// The centre of the second arm above joint 3, which is at its lower side.
const ABOVE: f64 = 0.055;
const SHAFT: f64 = 0.03;
const SHAFT_LENGTH: f64 = 0.5;
const POINTER: f64 = 0.06;

const GREY: [f64; 3] = [0.62, 0.65, 0.69];
const BLUE: [f64; 3] = [0.15, 0.45, 0.75];
const ORANGE: [f64; 3] = [0.85, 0.4, 0.1];

/// The whole scene: it never changes, since its frames do.
pub(super) fn arm(time: Timestamp, geometry: &Geometry) -> SceneUpdate {
    let Geometry { a1, a2, d1, d2, d4 } = *geometry;
    let top = d1 - ARM_HEIGHT / 2.0;
    let upper = d1 + d2 + ABOVE;
    let column = cylinder([0.0, 0.0, (FLOOR + top) / 2.0], BASE, top - FLOOR, GREY);
    let link = |length: f64, height: f64, colour| SceneEntity {
        cubes: vec![cube(
            [length / 2.0, 0.0, height],
            [length, ARM, ARM_HEIGHT],
            colour,
        )],
        cylinders: [0.0, length]
            .map(|x| cylinder([x, 0.0, height], ARM, ARM_HEIGHT, colour))
            .into(),
        ..SceneEntity::default()
    };
    let shaft = cylinder(
        [0.0, 0.0, SHAFT_LENGTH / 2.0 - d4],
        SHAFT,
        SHAFT_LENGTH,
        ORANGE,
    );
    // Where the tool points to.
    let pointer = cube(
        [POINTER / 2.0, 0.0, 0.0],
        [POINTER, SHAFT / 2.0, SHAFT / 3.0],
        ORANGE,
    );
    let bodies = [
        (
            "base",
            SceneEntity {
                cylinders: vec![column],
                ..SceneEntity::default()
            },
        ),
        ("shoulder", link(a1, d1, BLUE)),
        ("elbow", link(a2, upper, BLUE)),
        (
            "shaft",
            SceneEntity {
                cylinders: vec![shaft],
                ..SceneEntity::default()
            },
        ),
        (
            "flange",
            SceneEntity {
                cubes: vec![pointer],
                ..SceneEntity::default()
            },
        ),
    ];
    let entities = bodies.map(|(frame, bodies)| SceneEntity {
        timestamp: Some(time),
        frame_id: frame.into(),
        id: frame.into(),
        // For ever.
        lifetime: Some(Duration::new(0, 0)),
        frame_locked: true,
        ..bodies
    });
    SceneUpdate {
        deletions: Vec::new(),
        entities: entities.into(),
    }
}

fn at([x, y, z]: [f64; 3]) -> Option<Pose> {
    Some(Pose {
        position: Some(Vector3 { x, y, z }),
        orientation: Some(Quaternion {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        }),
    })
}

fn colour([r, g, b]: [f64; 3]) -> Option<Color> {
    Some(Color { r, g, b, a: 1.0 })
}

fn cube(centre: [f64; 3], [x, y, z]: [f64; 3], of: [f64; 3]) -> CubePrimitive {
    CubePrimitive {
        pose: at(centre),
        size: Some(Vector3 { x, y, z }),
        color: colour(of),
    }
}

/// Upright.
fn cylinder(centre: [f64; 3], width: f64, height: f64, of: [f64; 3]) -> CylinderPrimitive {
    CylinderPrimitive {
        pose: at(centre),
        size: Some(Vector3 {
            x: width,
            y: width,
            z: height,
        }),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: colour(of),
    }
}
