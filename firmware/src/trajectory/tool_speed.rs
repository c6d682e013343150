//! The speed of the tool: what manual operation limits.
//!
//! A tool is not known, so it is whatever lies within [`REACH`] of the axis of the flange. Where the flange moves at v horizontally and
//! u vertically, and turns at w, none of its points is faster than sqrt((|v| + REACH |w|)² + u²), and some may be.

use nalgebra::Vector4;

use super::curve::Curve;
use super::path::Path;
use crate::mechanics::arm::Geometry;
use crate::mechanics::math::{hypot, sin_cos, sqrt};

/// Greatest speed of the tool in manual operation, m/s (ISO 10218-1).
pub const LIMIT: f32 = 0.25;
/// What a move may use of it, m/s; the rest is for the error of following it.
pub const PLANNED: f32 = 0.9 * LIMIT;
/// Least control rate at which what is left is enough, Hz: slower loops overshoot by more than a tenth.
pub const LEAST_RATE: f32 = 250.0;
/// What each part of a jump may use of that: its strokes and its travel overlap.
pub(super) const OF_A_PART: f32 = core::f32::consts::FRAC_1_SQRT_2;
/// How far from the axis of the flange a point of the tool may be, m.
pub const REACH: f32 = 0.1;

/// Bound of the speed of the tool for this velocity of the flange: x, y, z in m/s, yaw in rad/s.
pub fn of(velocity: &Vector4<f32>) -> f32 {
    let across = hypot(velocity.x, velocity.y) + REACH * velocity.w.abs();
    hypot(across, velocity.z)
}

/// The speed along a path, 1/s, at which the tool is nowhere on it faster than `tool`, m/s; infinite where the tool does not move.
#[inline(never)]
pub(super) fn along(path: &Path, geometry: &Geometry, tool: f32) -> f32 {
    let (horizontal, vertical, turning) = match path {
        Path::Joint { start, delta, .. } => (
            horizontal(geometry, start.y, delta),
            delta.z,
            delta.x + delta.y - delta.w,
        ),
        Path::Tool { curve, turned, .. } => {
            let (horizontal, vertical) = match curve {
                Curve::Line { delta, .. } => (hypot(delta.x, delta.y), delta.z),
                // Whatever its plane, it may be level somewhere.
                arc @ Curve::Arc { .. } => (arc.length(), 0.0),
            };
            (horizontal, vertical, *turned)
        }
    };
    tool / hypot(horizontal + REACH * turning.abs(), vertical)
}

/// Greatest horizontal speed of the flange per unit along a straight path in joint space, m. The law of cosines: the two arms turn at
/// constant rates, and their velocities meet at the angle of the elbow, which goes one way.
fn horizontal(geometry: &Geometry, elbow: f32, delta: &Vector4<f32>) -> f32 {
    let (first, second) = (geometry.a1 * delta.x, geometry.a2 * (delta.x + delta.y));
    let product = first * second;
    let (begin, end) = (elbow, elbow + delta.y);
    let (_, cosine) = sin_cos(begin);
    let (_, other) = sin_cos(end);
    let greatest = if product < 0.0 {
        // Folded, or as near to that as the elbow comes.
        if begin.abs().max(end.abs()) >= core::f32::consts::PI {
            -1.0
        } else {
            cosine.min(other)
        }
    } else if begin * end <= 0.0 {
        // It passes through the stretched arm.
        1.0
    } else {
        cosine.max(other)
    };
    let squared = first * first + second * second + 2.0 * product * greatest;
    sqrt(squared.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::arm::IRB_930;

    /// Speed of the flange per unit along the path, by differences of its position, in f64.
    fn speed(geometry: &Geometry, elbow: f64, delta: [f64; 2]) -> f64 {
        let (a, b) = (f64::from(geometry.a1), f64::from(geometry.a2));
        let place = |s: f64| {
            let (one, two) = (delta[0] * s, elbow + delta[1] * s + delta[0] * s);
            [
                a * libm::cos(one) + b * libm::cos(two),
                a * libm::sin(one) + b * libm::sin(two),
            ]
        };
        let h = 1e-6;
        let ([x, y], [before_x, before_y]) = (place(h), place(-h));
        libm::hypot(x - before_x, y - before_y) / (2.0 * h)
    }

    /// On ways that pass the stretched arm, the folded one, neither and both, with arms that turn the same way, against each other, or not
    /// at all: as fast as the fastest of a thousand places.
    #[test]
    fn the_flange_is_as_fast_as_at_its_fastest_place() {
        let geometry = IRB_930.geometry;
        let elbows = [-3.5, -2.5, -1.0, -0.3, 0.0, 0.3, 1.0, 2.5, 3.5f32];
        let shoulders = [-3.0, -1.0, -0.2, 0.0, 0.2, 1.0, 3.0f32];
        let (mut folded, mut stretched) = (0, 0);
        for begin in elbows {
            for end in elbows {
                for turn in shoulders {
                    let delta = Vector4::new(turn, end - begin, 0.0, 0.0);
                    let along = |k: u16| {
                        let s = f64::from(k) / 1000.0;
                        let elbow = f64::from(begin) + s * f64::from(delta.y);
                        speed(&geometry, elbow, [delta.x.into(), delta.y.into()])
                    };
                    let fastest = (0..=1000).map(along).fold(0.0, f64::max);
                    let found = f64::from(horizontal(&geometry, begin, &delta));
                    let what = (begin, end, turn);
                    // Between two places it is faster by (0.0035 rad)² at the most, of the product of both.
                    assert!(
                        (found - fastest).abs() < 1e-4,
                        "{what:?}: {found} {fastest}"
                    );
                    folded += u32::from(begin.abs() > 3.2 || end.abs() > 3.2);
                    stretched += u32::from(begin * end < 0.0);
                }
            }
        }
        assert!(folded > 100 && stretched > 100);
    }
}
