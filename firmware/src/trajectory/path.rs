//! Geometry of a move: joint positions as a function of a path coordinate `s` in 0..=1.

use nalgebra::Vector4;

use super::Lift;
use super::curve::{Curve, Place};
use crate::mechanics::arm::ArmModel;
use crate::mechanics::jacobian::Jacobian;
use crate::mechanics::kinematics::{self, Elbow, IkError, Planar};

/// Joint positions and their derivatives with respect to the path coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// q(s): rad, rad, m, rad.
    pub q: Vector4<f32>,
    /// dq/ds.
    pub dq: Vector4<f32>,
    /// d²q/ds².
    pub ddq: Vector4<f32>,
}

/// Why a point of a path cannot be reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathError {
    /// Outside the reach or a joint limit.
    Unreachable(IkError),
    /// |sin theta2| below [`MIN_SIN_ELBOW`], where the joint speeds of a tool on a curve grow without bound.
    Singular {
        /// sin(theta2) at that point.
        sin_elbow: f32,
    },
}

/// A curve of the tool is refused where |sin(theta2)| falls below this: the joint speeds for a given tool speed are then
/// more than 20 times those at a right-angled elbow.
pub const MIN_SIN_ELBOW: f32 = 0.05;

/// Geometry of a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// Straight in joint space, all axes together.
    Joint {
        /// Joint positions at s = 0.
        start: Vector4<f32>,
        /// End minus start.
        delta: Vector4<f32>,
        /// Of a jump: what the lift does in place of that, in time.
        lift: Option<Lift>,
    },
    /// Curve of the tool, yaw turning at a constant rate along it.
    Tool {
        /// Of the flange.
        curve: Curve,
        /// Yaw at s = 0, with the whole turns of axis 4: theta1 + theta2 - theta4.
        yaw: f32,
        /// Yaw at the end minus that.
        turned: f32,
        /// Elbow branch, kept along the whole curve.
        elbow: Elbow,
    },
}

impl Path {
    /// Whether it is an arc.
    pub(super) fn is_arc(&self) -> bool {
        matches!(
            self,
            Self::Tool {
                curve: Curve::Arc { .. },
                ..
            }
        )
    }

    /// What the lift does in a jump.
    pub(super) fn lift(&mut self) -> Option<&mut Lift> {
        match self {
            Self::Joint { lift, .. } => lift.as_mut(),
            Self::Tool { .. } => None,
        }
    }

    /// Joint positions and derivatives at `s`, but for the lift in a jump.
    ///
    /// # Errors
    /// Only for a curve of the tool: beyond reach, or too close to the stretched elbow.
    pub fn at(&self, arm: &ArmModel, s: f32) -> Result<PathPoint, PathError> {
        match self {
            Self::Joint { start, delta, .. } => Ok(PathPoint {
                q: start + delta * s,
                dq: *delta,
                ddq: Vector4::zeros(),
            }),
            Self::Tool {
                curve,
                yaw,
                turned,
                elbow,
            } => {
                let Place {
                    position,
                    tangent,
                    bend,
                } = curve.at(s);
                let place = (position.x, position.y);
                let Planar {
                    theta1,
                    theta2,
                    shoulder,
                    s2,
                } = kinematics::planar(&arm.geometry, place, *elbow)
                    .map_err(PathError::Unreachable)?;
                if s2.abs() < MIN_SIN_ELBOW {
                    return Err(PathError::Singular { sin_elbow: s2 });
                }
                let geometry = &arm.geometry;
                let q = Vector4::new(
                    theta1,
                    theta2,
                    geometry.d1 - geometry.d4 - position.z,
                    theta1 + theta2 - (yaw + turned * s),
                );
                // q' = J^-1 x', q'' = J^-1 (x'' - (dJ/ds) q'). The Jacobian's rate along the path has the same form as its rate
                // in time, with q' for qd.
                let jacobian = Jacobian::of_place(geometry, place, shoulder, s2);
                let dq = jacobian.joint_speed_undamped(&tangent.push(*turned));
                let rest = bend.push(0.0) - jacobian.bias(&dq);
                let ddq = jacobian.joint_speed_undamped(&rest);
                Ok(PathPoint { q, dq, ddq })
            }
        }
    }
}

/// First joint limit that `q` violates on the way `from` a place; from one past a limit, as an arm that stands on one is by
/// half an encoder count, no further past it than there.
///
/// # Errors
/// [`IkError::Limit`] with the axis, the value and the limit passed.
// Out of line: asked for at every point of a path.
#[inline(never)]
pub fn check_limits(arm: &ArmModel, q: &Vector4<f32>, from: &Vector4<f32>) -> Result<(), IkError> {
    let limits = &arm.limits;
    kinematics::check_range(q, &limits.lower.inf(from), &limits.upper.sup(from), limits)
}
