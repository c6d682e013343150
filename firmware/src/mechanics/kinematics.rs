//! Forward and inverse kinematics: joint positions to tool pose and back.

mod ik;

use nalgebra::{Matrix3, Vector3, Vector4};

use crate::mechanics::arm::Geometry;
use crate::mechanics::math::{sin_cos, wrap};

pub use ik::{Elbow, IkError, LIMIT_TOLERANCE, REACH_TOLERANCE, Wrist, inverse, locate, solve};
pub(crate) use ik::{Planar, check_range, planar, shorter_way, within_limits};

/// Sines and cosines of one joint position, computed once per tick and shared by everything that needs them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trig {
    /// sin theta1.
    pub s1: f32,
    /// cos theta1.
    pub c1: f32,
    /// sin theta2.
    pub s2: f32,
    /// cos theta2.
    pub c2: f32,
    /// sin (theta1 + theta2).
    pub s12: f32,
    /// cos (theta1 + theta2).
    pub c12: f32,
    /// sin theta4.
    pub s4: f32,
    /// cos theta4.
    pub c4: f32,
}

impl Trig {
    /// Evaluates the functions at joint position `q` (rad, m).
    ///
    /// Error in units of u = 2^-24: 2.5 for the single angles ([`sin_cos`]); 9.1 for the sum, which is 2.5 times the
    /// sum of the four magnitudes (at most 2 sqrt 2) plus 2 for rounding products and sum. The addition theorem costs a
    /// fifth of another `sin_cos`, and is no less accurate than rounding theta1 + theta2.
    #[inline(never)]
    #[must_use]
    pub fn new(q: &Vector4<f32>) -> Self {
        Self::in_line(q)
    }

    /// The part that dynamics need, of elbow and wrist; whatever depends on theta1 is NaN.
    // Out of line, like the above.
    #[inline(never)]
    #[must_use]
    pub fn relative(q: &Vector4<f32>) -> Self {
        Self::relative_in_line(q)
    }

    /// Inlined variant of [`Trig::relative`].
    #[inline(always)]
    #[must_use]
    pub(crate) fn relative_in_line(q: &Vector4<f32>) -> Self {
        let (s2, c2) = sin_cos(q.y);
        let (s4, c4) = sin_cos(q.w);
        Self {
            s1: f32::NAN,
            c1: f32::NAN,
            s2,
            c2,
            s12: f32::NAN,
            c12: f32::NAN,
            s4,
            c4,
        }
    }

    /// What [`Trig::relative`] has left out, for theta1 (rad).
    #[inline(always)]
    #[must_use]
    pub(crate) fn with_shoulder(&self, theta1: f32) -> Self {
        let Self { s2, c2, .. } = *self;
        let (s1, c1) = sin_cos(theta1);
        Self {
            s1,
            c1,
            s12: s1 * c2 + c1 * s2,
            c12: c1 * c2 - s1 * s2,
            ..*self
        }
    }

    /// Inlined variant of [`Trig::new`]: components that the caller does not use are optimised away.
    #[inline(always)]
    #[must_use]
    pub fn in_line(q: &Vector4<f32>) -> Self {
        Self::relative_in_line(q).with_shoulder(q.x)
    }
}

/// Pose of the tool flange: its origin in frame 0 (m) and its yaw about z (rad). Its z axis always points down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Along x of frame 0 (m).
    pub x: f32,
    /// Along y of frame 0 (m).
    pub y: f32,
    /// Height (m).
    pub z: f32,
    /// theta1 + theta2 - theta4 (rad).
    pub yaw: f32,
}

/// Pose of the flange at joint position `q` (paper, eq. 8 to 19), yaw in (-pi, pi].
// Out of line, for the size of four copies.
#[inline(never)]
#[must_use]
pub fn forward(geometry: &Geometry, q: &Vector4<f32>) -> Pose {
    forward_with(geometry, &Trig::new(q), q)
}

/// Like [`forward`], for a caller that already has the sines and cosines of `q`.
#[must_use]
pub fn forward_with(geometry: &Geometry, trig: &Trig, q: &Vector4<f32>) -> Pose {
    Pose {
        x: geometry.a1 * trig.c1 + geometry.a2 * trig.c12,
        y: geometry.a1 * trig.s1 + geometry.a2 * trig.s12,
        z: geometry.d1 - q.z - geometry.d4,
        yaw: wrap(q.x + q.y - q.w),
    }
}

/// Orientation of the flange: the matrix that maps components in frame 4 to components in frame 0 (paper, eq. 8 to 19).
#[must_use]
pub fn rotation(trig: &Trig) -> Matrix3<f32> {
    let c = trig.c12 * trig.c4 + trig.s12 * trig.s4;
    let s = trig.s12 * trig.c4 - trig.c12 * trig.s4;
    Matrix3::new(c, s, 0.0, s, -c, 0.0, 0.0, 0.0, -1.0)
}

/// Frame i of the standard Denavit-Hartenberg table, seen from frame i - 1.
///
/// The paper's eq. 4 prints +1 for the last diagonal element of the second rotation, a reflection; a half turn about x has -1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkFrame {
    /// Maps components in frame i to components in frame i - 1.
    pub rotation: Matrix3<f32>,
    /// From the origin of frame i - 1 to that of frame i, components in frame i (m).
    pub offset: Vector3<f32>,
}

impl LinkFrame {
    /// Components in frame i of a vector given in frame i - 1.
    #[must_use]
    pub fn carry(&self, vector: &Vector3<f32>) -> Vector3<f32> {
        self.rotation.tr_mul(vector)
    }
}

/// The four link frames (paper, table 1 and eq. 2 to 6) with the lift at `d3` (m).
#[must_use]
pub fn link_frames(geometry: &Geometry, trig: &Trig, d3: f32) -> [LinkFrame; 4] {
    let turn = |s: f32, c: f32| Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    let half_turn_about_x = Matrix3::new(
        trig.c2, trig.s2, 0.0, trig.s2, -trig.c2, 0.0, 0.0, 0.0, -1.0,
    );
    [
        LinkFrame {
            rotation: turn(trig.s1, trig.c1),
            offset: Vector3::new(geometry.a1, 0.0, geometry.d1),
        },
        LinkFrame {
            rotation: half_turn_about_x,
            offset: Vector3::new(geometry.a2, 0.0, 0.0),
        },
        LinkFrame {
            rotation: Matrix3::identity(),
            offset: Vector3::new(0.0, 0.0, d3),
        },
        LinkFrame {
            rotation: turn(trig.s4, trig.c4),
            offset: Vector3::new(0.0, 0.0, geometry.d4),
        },
    ]
}
