//! Inverse kinematics: the joint position for a pose of the flange.

use core::f32::consts::{PI, TAU};
use core::fmt;

use nalgebra::Vector4;

use super::Pose;
use crate::mechanics::arm::{ArmModel, Axis, Geometry, JointLimits};
use crate::mechanics::math::{angle, atan2, clamp, greatest, hypot, sin_cos, sqrt, wrap};

/// How far out of reach a radius may be and still count as on the boundary, as a fraction of the stretched arm: 8 u,
/// half a micrometre per metre.
///
/// A pose computed by the forward kinematics for a stretched arm may be that far out: 3.5 u (the errors of sine and
/// cosine together), 2 u of rounding in the coordinates and 2 u in the radius.
pub const REACH_TOLERANCE: f32 = 4.0 * f32::EPSILON;

/// How far past a limit a solution may be and still be clamped to the limit, as a fraction of the range of the axis: 16
/// u (5e-6 rad for a shoulder that turns +-150 degrees), so that the pose of an arm at a limit has a solution.
///
/// For the shoulder it covers two arc tangents at 4 u of at most pi, their difference and its wrap, and the rounding of
/// the pose relative to the shoulder. It does not cover the ill-conditioned posture close to the stretched arm.
pub const LIMIT_TOLERANCE: f32 = 8.0 * f32::EPSILON;

/// Which way the elbow bends: the two postures that reach one pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elbow {
    /// theta2 >= 0.
    Positive,
    /// theta2 <= 0.
    Negative,
}

impl Elbow {
    /// The posture of an arm at joint position `q`; positive for the stretched arm.
    #[must_use]
    pub fn of(q: &Vector4<f32>) -> Self {
        if q.y < 0.0 {
            Self::Negative
        } else {
            Self::Positive
        }
    }
}

/// Why a pose has no joint position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IkError {
    /// The pose or the position to stay near contains an infinity or NaN.
    NotFinite,
    /// Beyond the stretched arm.
    TooFar {
        /// Distance from the shoulder axis (m).
        radius: f32,
        /// Greatest distance in reach (m).
        max: f32,
    },
    /// Inside the folded arm.
    TooNear {
        /// Distance from the shoulder axis (m).
        radius: f32,
        /// Least distance in reach (m).
        min: f32,
    },
    /// The arm reaches it, but an axis would exceed its limit.
    Limit {
        /// The first such axis.
        axis: Axis,
        /// Where it would have to go (rad, lift m).
        value: f32,
        /// The limit that it would exceed.
        limit: f32,
    },
}

impl fmt::Display for IkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "pose or present position is not finite"),
            Self::TooFar { radius, max } => write!(
                f,
                "{radius} m from the shoulder axis, at most {max} m in reach"
            ),
            Self::TooNear { radius, min } => write!(
                f,
                "{radius} m from the shoulder axis, at least {min} m in reach"
            ),
            Self::Limit { axis, value, limit } => write!(
                f,
                "{axis:?} axis would have to go to {value}, past its limit {limit}"
            ),
        }
    }
}

impl core::error::Error for IkError {}

/// Joint position for `pose` by geometry alone: no joint limits, theta1 and theta4 in (-pi, pi].
///
/// The half-angle form `tan(theta2 / 2) = sqrt((S^2 - r^2) / (r^2 - D^2))`, with S and D the sum and difference of the
/// arm lengths, replaces the paper's `cos theta2`, which loses half the digits near the stretched arm. The remaining
/// conditioning is that of the pose itself: a radius error of e moves theta2 by `r e / (a1 a2 sin theta2)`, at most
/// `sqrt(2 r e / (a1 a2))` at full stretch, while the error of the resulting pose is at most e. The paper's arc
/// tangents have their arguments in the order (x, y) and its d3 has the wrong sign; both are corrected here.
///
/// # Errors
///
/// [`IkError::NotFinite`], [`IkError::TooFar`], [`IkError::TooNear`]. A radius out of reach by at most
/// [`REACH_TOLERANCE`] counts as on the boundary.
pub fn solve(geometry: &Geometry, pose: &Pose, elbow: Elbow) -> Result<Vector4<f32>, IkError> {
    let Pose { x, y, z, yaw } = *pose;
    if ![x, y, z, yaw].into_iter().all(f32::is_finite) {
        return Err(IkError::NotFinite);
    }

    let radius = hypot(x, y);
    let max = geometry.reach();
    let min = (geometry.a1 - geometry.a2).abs();
    let tolerance = REACH_TOLERANCE * max;
    if radius > max + tolerance {
        return Err(IkError::TooFar { radius, max });
    }
    if radius < min - tolerance {
        return Err(IkError::TooNear { radius, min });
    }
    // The tolerance may leave either distance below zero.
    let short_of_stretched = clamp(max - radius, 0.0, max);
    let short_of_folded = clamp(radius - min, 0.0, max);

    let bend = 2.0
        * atan2(
            sqrt(short_of_stretched * (max + radius)),
            sqrt(short_of_folded * (radius + min)),
        );
    let theta2 = match elbow {
        Elbow::Positive => bend,
        Elbow::Negative => -bend,
    };
    let (s2, c2) = sin_cos(theta2);
    let theta1 = wrap(atan2(y, x) - atan2(geometry.a2 * s2, geometry.a1 + geometry.a2 * c2));
    let theta4 = wrap(theta1 + theta2 - yaw);
    Ok(Vector4::new(
        theta1,
        theta2,
        geometry.d1 - geometry.d4 - z,
        theta4,
    ))
}

/// Shoulder and elbow for a place of the flange, with the sines and cosines that they have there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Planar {
    /// theta1 in (-pi, pi] (rad).
    pub(crate) theta1: f32,
    /// theta2, likewise.
    pub(crate) theta2: f32,
    /// sin theta1 and cos theta1.
    pub(crate) shoulder: (f32, f32),
    /// sin theta2.
    pub(crate) s2: f32,
}

/// As [`solve`] for the places along a curve, of which every sample asks for one: sines and cosines follow from the triangle of base, elbow and
/// flange, and each angle from its own. That is a third of the work of going from the angles to them.
///
/// With r the radius, S and D as above, S^2 - r^2 and r^2 - D^2 are 4 a1 a2 times the squares of sine and cosine of theta2 / 2.
///
/// # Errors
///
/// As [`solve`]; theta1 is not a number where the radius is zero.
#[inline(always)]
pub(crate) fn planar(
    geometry: &Geometry,
    (x, y): (f32, f32),
    elbow: Elbow,
) -> Result<Planar, IkError> {
    let Geometry { a1, a2, .. } = *geometry;
    let square = x * x + y * y;
    let (max, min) = (a1 + a2, a1 - a2);
    let stretched = max * max - square;
    let folded = square - min * min;
    let slack = 2.0 * REACH_TOLERANCE * max * max;
    if !(stretched > -slack && folded > -slack) {
        return Err(out_of_reach(square, max, min.abs()));
    }
    // The tolerance may leave either below zero.
    let product = greatest(stretched, 0.0) * greatest(folded, 0.0);
    let scale = 0.5 / (a1 * a2);
    let sine = sqrt(product) * scale;
    let s2 = match elbow {
        Elbow::Positive => sine,
        Elbow::Negative => -sine,
    };
    let c2 = (folded - stretched) * (0.5 * scale);
    let (along, across) = (a1 + a2 * c2, a2 * s2);
    let (s1, c1) = (y * along - x * across, x * along + y * across);
    let share = 1.0 / square;
    Ok(Planar {
        theta1: angle(s1, c1),
        theta2: angle(s2, c2),
        shoulder: (s1 * share, c1 * share),
        s2,
    })
}

// Out of line: no sample of a move comes here.
#[inline(never)]
fn out_of_reach(square: f32, max: f32, min: f32) -> IkError {
    let radius = sqrt(square);
    if radius > max {
        IkError::TooFar { radius, max }
    } else if radius < min {
        IkError::TooNear { radius, min }
    } else {
        IkError::NotFinite
    }
}

/// Joint position for `pose` within the limits of `arm`, with the wrist turn nearest to that of `near`.
///
/// # Errors
///
/// Those of [`solve`], and [`IkError::Limit`] for the first axis that would exceed a limit by more than
/// [`LIMIT_TOLERANCE`].
pub fn inverse(
    arm: &ArmModel,
    pose: &Pose,
    elbow: Elbow,
    near: &Vector4<f32>,
) -> Result<Vector4<f32>, IkError> {
    locate(arm, pose, elbow, Wrist::Near(near.w))
}

/// Which turn of the wrist is meant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wrist {
    /// The nearest to this angle.
    Near(f32),
    /// This many revolutions, and at most half a one more or less.
    Turn(i8),
}

/// Joint position for `pose` within the limits of `arm`, with the wrist in the turn that is meant.
///
/// # Errors
/// Those of [`inverse`].
pub fn locate(
    arm: &ArmModel,
    pose: &Pose,
    elbow: Elbow,
    wrist: Wrist,
) -> Result<Vector4<f32>, IkError> {
    let mut q = solve(&arm.geometry, pose, elbow)?;
    q.w = match wrist {
        Wrist::Near(near) => nearest_turn(q.w, near, &arm.limits),
        Wrist::Turn(turn) => q.w + f32::from(turn) * TAU,
    };
    within_limits(&q, &arm.limits)
}

/// Turns of axis 4 that are less than this short of a half one count as half turns (rad): more than rounding and encoder counts make
/// of one, less than anyone aims at.
const HALF_TURN_TOLERANCE: f32 = 1e-4;

/// The end of a turn of axis 4 by the shorter way, which ends at `end`. Either way is as long for a half turn, and the last digit must
/// not decide: there it is the way that ends nearer to the middle of the range; the positive one if neither does.
// Out of line: jumps, lines and arcs share it.
#[inline(never)]
pub(crate) fn shorter_way(turn: f32, end: f32, limits: &JointLimits) -> f32 {
    if turn.abs() < PI - HALF_TURN_TOLERANCE {
        return end;
    }
    let middle = 0.5 * (limits.lower.w + limits.upper.w);
    let upper = if turn < 0.0 { end + TAU } else { end };
    if upper - middle > PI + HALF_TURN_TOLERANCE {
        upper - TAU
    } else {
        upper
    }
}

/// The angle plus whole turns that is nearest to `near` inside the limits; outside them if no turn is inside.
fn nearest_turn(angle: f32, near: f32, limits: &JointLimits) -> f32 {
    let (lower, upper) = (limits.lower.w, limits.upper.w);
    let near = clamp(near, lower, upper);
    let turn = wrap(angle - near);
    let nearest = shorter_way(turn, near + turn, limits);
    let slack = LIMIT_TOLERANCE * (upper - lower);
    if nearest > upper + slack {
        nearest - TAU
    } else if nearest < lower - slack {
        nearest + TAU
    } else {
        nearest
    }
}

/// `q` with each value that exceeds a limit only by rounding clamped to it.
///
/// # Errors
/// [`IkError::NotFinite`], and [`IkError::Limit`] for the first axis that exceeds a limit by more than [`LIMIT_TOLERANCE`].
pub(crate) fn within_limits(
    q: &Vector4<f32>,
    limits: &JointLimits,
) -> Result<Vector4<f32>, IkError> {
    let slack = (limits.upper - limits.lower) * LIMIT_TOLERANCE;
    check_range(q, &(limits.lower - slack), &(limits.upper + slack), limits)?;
    Ok(q.zip_zip_map(&limits.lower, &limits.upper, clamp))
}

/// Whether every axis is between `lower` and `upper`. The error names what it breaks of `limits`, which are those or narrower.
///
/// # Errors
/// [`IkError::NotFinite`], [`IkError::Limit`].
// Out of line: asked for in several places.
#[inline(never)]
pub(crate) fn check_range(
    q: &Vector4<f32>,
    lower: &Vector4<f32>,
    upper: &Vector4<f32>,
    limits: &JointLimits,
) -> Result<(), IkError> {
    let kept = |axis: &Axis| (axis.of(lower)..=axis.of(upper)).contains(&axis.of(q));
    let Some(axis) = Axis::ALL.into_iter().find(|axis| !kept(axis)) else {
        return Ok(());
    };
    let value = axis.of(q);
    let limit = if value < axis.of(lower) {
        axis.of(&limits.lower)
    } else {
        axis.of(&limits.upper)
    };
    Err(if value.is_finite() {
        IkError::Limit { axis, value, limit }
    } else {
        IkError::NotFinite
    })
}
