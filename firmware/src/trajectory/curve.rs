//! Curves of the tool in space, as functions of a coordinate `s` in 0..=1 that is in proportion to the way: a straight line, or an arc
//! of a circle.

use nalgebra::Vector3;

use crate::mechanics::math::{atan2, sin_cos, sqrt};

/// Least height of the triangle of the three points of an arc, m: ten times the repeatability of such an arm, which would otherwise
/// decide where the circle is.
pub const MIN_HEIGHT: f32 = 1e-4;

/// Most parts of a [curve](Curve::parts).
pub(super) const MOST_PARTS: u8 = 48;

/// A place on a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position in frame 0, m.
    pub position: Vector3<f32>,
    /// Its derivative with respect to `s`, m.
    pub tangent: Vector3<f32>,
    /// Its second derivative, m.
    pub bend: Vector3<f32>,
}

/// A curve of the tool. Lengths in m in frame 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// A straight line.
    Line {
        /// Position at s = 0.
        start: Vector3<f32>,
        /// End minus start.
        delta: Vector3<f32>,
    },
    /// An arc. Seen from its start, not from its centre: the flatter it is, the farther away is that.
    Arc {
        /// Position at s = 0.
        start: Vector3<f32>,
        /// Tangent at the start, as long as the radius.
        ahead: Vector3<f32>,
        /// From the start to the centre.
        inward: Vector3<f32>,
        /// Angle of the arc, rad.
        angle: f32,
    },
}

impl Curve {
    /// The straight line between two points.
    pub fn line(start: Vector3<f32>, end: &Vector3<f32>) -> Self {
        let delta = end - start;
        Self::Line { start, delta }
    }

    /// The arc from `start` through `via` to `end`, of any angle below a full turn.
    ///
    /// Half of its angle is that by which the way turns at `via` (inscribed angle theorem). Neither that nor the way to the end depends on
    /// where the centre is, so that a flat arc is as exact as a straight line.
    ///
    /// # Errors
    /// The height of the triangle of the three points, m, where it is below [`MIN_HEIGHT`]: they lie on one line, or two coincide. Not a
    /// number where a coordinate is not.
    pub fn arc(start: Vector3<f32>, via: &Vector3<f32>, end: &Vector3<f32>) -> Result<Self, f32> {
        let (first, second, chord) = (via - start, end - via, end - start);
        let normal = first.cross(&chord);
        let longest = first
            .dot(&first)
            .max(second.dot(&second))
            .max(chord.dot(&chord));
        let area = sqrt(normal.dot(&normal));
        let height = area / sqrt(longest).max(MIN_HEIGHT);
        if height.is_nan() || height < MIN_HEIGHT {
            return Err(height);
        }
        // Sine and cosine of the turn at `via`, times the lengths of both parts.
        let (sine, cosine) = (area, first.dot(&second));
        let side = normal.cross(&chord);
        Ok(Self::Arc {
            start,
            ahead: (chord * cosine - side) * (0.5 / area),
            inward: chord * 0.5 + side * (0.5 * cosine / (area * area)),
            angle: 2.0 * atan2(sine, cosine),
        })
    }

    /// Where it begins, m.
    pub(super) fn start(&self) -> Vector3<f32> {
        match self {
            Self::Line { start, .. } | Self::Arc { start, .. } => *start,
        }
    }

    /// The place at `s`.
    // In line: a place is nine numbers, which would go over the stack in every sample.
    #[inline(always)]
    pub fn at(&self, s: f32) -> Place {
        match self {
            Self::Line { start, delta } => Place {
                position: start + delta * s,
                tangent: *delta,
                bend: Vector3::zeros(),
            },
            Self::Arc {
                start,
                ahead,
                inward,
                angle,
            } => {
                let (sine, cosine) = sin_cos(0.5 * angle * s);
                // Of the whole angle; 1 - cos without cancellation.
                let (sin, versine) = (2.0 * sine * cosine, 2.0 * sine * sine);
                let cos = 1.0 - versine;
                Place {
                    position: start + ahead * sin + inward * versine,
                    tangent: (ahead * cos + inward * sin) * *angle,
                    bend: (inward * cos - ahead * sin) * (angle * angle),
                }
            }
        }
    }

    /// Its length, m.
    pub fn length(&self) -> f32 {
        match self {
            Self::Line { delta, .. } => sqrt(delta.dot(delta)),
            Self::Arc { ahead, angle, .. } => angle * sqrt(ahead.dot(ahead)),
        }
    }

    /// Into how many equal parts planning divides it: an arc goes into more directions than a line.
    pub(super) fn parts(&self) -> u8 {
        match self {
            Self::Line { .. } => 24,
            Self::Arc { .. } => MOST_PARTS,
        }
    }

    /// Where it comes nearest to axis 1, or goes farthest from it, as Newton's method finds it from `s`: of a line at once, of an arc
    /// where that is not far from `s`. Anywhere, or not a number, where there is no such place.
    pub(super) fn turning_point(&self, s: f32) -> f32 {
        let mut found = s;
        for _ in 0..2 {
            let Place {
                position,
                tangent,
                bend,
            } = self.at(found);
            let (position, tangent) = (position.xy(), tangent.xy());
            let slope = position.dot(&tangent);
            found -= slope / (tangent.dot(&tangent) + position.dot(&bend.xy()));
        }
        found
    }
}
