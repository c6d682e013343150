//! A requested move, and its path.

use nalgebra::{Vector3, Vector4};
use protocol::messages::{ElbowSide, Posture, Refusal, RefusalReason, WristTurn};

use super::Lift;
use super::curve::{Curve, MIN_HEIGHT};
use super::path::{MIN_SIN_ELBOW, Path, PathError};
use crate::mechanics::arm::{ArmModel, Axis};
use crate::mechanics::kinematics::{self, Elbow, IkError, Pose, Wrist, shorter_way};
use crate::mechanics::math::wrap;

/// What to move to. Lengths in m in frame 0 (z up), angles in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Straight in joint space to these joint positions.
    Joints(Vector4<f32>),
    /// Straight line of the tool.
    Line(Pose, Posture),
    /// Arc of the tool through this point: whatever the angle, the way round on which the point lies.
    Arc(Vector3<f32>, Pose, Posture),
    /// Gate move: up, across (straight in joint space), down.
    Jump {
        /// Tool pose at the end.
        pose: Pose,
        /// Which joint positions there.
        posture: Posture,
        /// Height of the tool at the top.
        top: f32,
        /// Height of the strictly vertical part at both ends; above it the corners are blended.
        clearance: f32,
    },
}

/// The number of a request, and whether it was accepted.
pub type Answer = (u8, Result<(), Refusal>);

/// A move to plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Sequence number that the operator gave the move.
    pub sequence: u8,
    /// Where to.
    pub target: Target,
    /// Share of full speed, 0 < speed <= 1.
    pub speed: f32,
    /// Greatest speed of the flange along a line or an arc, m/s; 0 for as fast as the arm can.
    pub tool_speed: f32,
    /// How far from its end the arm may leave the path for that of the next move, m: it passes there without a stop, if the next one is planned
    /// by then. 0 to stop at the end.
    pub zone: f32,
}

/// Height that counts as none, m.
const NO_HEIGHT: f32 = 1e-6;

/// Heights of a jump, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gate {
    /// From the start to the top.
    pub(super) rise: f32,
    /// From the top to the end.
    pub(super) fall: f32,
    /// Of the strictly vertical part at both ends; 0 where the corners are free.
    pub(super) clearance: f32,
    /// How much higher than the top the lift could go.
    pub(super) room: f32,
}

impl Target {
    /// Joint positions at the end of a move from the joint positions `from`.
    ///
    /// # Errors
    /// A target that is not finite, out of reach or outside a limit.
    pub(super) fn end(&self, arm: &ArmModel, from: &Vector4<f32>) -> Result<Vector4<f32>, Refusal> {
        match self {
            Self::Joints(q) => kinematics::within_limits(q, &arm.limits).map_err(from_ik),
            Self::Line(pose, posture)
            | Self::Arc(_, pose, posture)
            | Self::Jump { pose, posture, .. } => joints_of(arm, pose, *posture, from),
        }
    }

    /// The path from the joint positions `from` to those at the end, and the heights of a jump over it.
    ///
    /// # Errors
    /// A line or an arc that would have to change the side of the elbow; an arc whose points lie on one line; the top of a jump outside its bounds.
    pub(super) fn path(
        &self,
        arm: &ArmModel,
        from: &Vector4<f32>,
        end: &Vector4<f32>,
    ) -> Result<(Path, Option<Gate>), Refusal> {
        match self {
            Self::Joints(_) => Ok((straight(from, end, None), None)),
            Self::Line(pose, posture) => Ok((tool(arm, from, end, None, pose, *posture)?, None)),
            Self::Arc(via, pose, posture) => {
                Ok((tool(arm, from, end, Some(via), pose, *posture)?, None))
            }
            Self::Jump { top, clearance, .. } => {
                let gate = gate(arm, from, end, *top, *clearance)?;
                let mut across = *end;
                across.z = from.z;
                Ok((
                    straight(from, &across, Some(Lift::at_rest(from.z))),
                    Some(gate),
                ))
            }
        }
    }
}

fn straight(from: &Vector4<f32>, to: &Vector4<f32>, lift: Option<Lift>) -> Path {
    Path::Joint {
        start: *from,
        delta: to - from,
        lift,
    }
}

/// The joint positions that are meant by a pose, for an arm that comes from `from`.
#[inline(never)]
fn joints_of(
    arm: &ArmModel,
    pose: &Pose,
    posture: Posture,
    from: &Vector4<f32>,
) -> Result<Vector4<f32>, Refusal> {
    let elbow = match posture.elbow {
        ElbowSide::Keep => Elbow::of(from),
        ElbowSide::Positive => Elbow::Positive,
        ElbowSide::Negative => Elbow::Negative,
    };
    let wrist = match posture.turn.number() {
        None => Wrist::Near(from.w),
        Some(turn) => Wrist::Turn(turn),
    };
    kinematics::locate(arm, pose, elbow, wrist).map_err(from_ik)
}

/// A straight line of the tool, or an arc through a point.
fn tool(
    arm: &ArmModel,
    from: &Vector4<f32>,
    end: &Vector4<f32>,
    via: Option<&Vector3<f32>>,
    to: &Pose,
    posture: Posture,
) -> Result<Path, Refusal> {
    let elbow = Elbow::of(from);
    // Stretched it is at both sides, and no curve can begin there anyway.
    if Elbow::of(end) != elbow && end.y != 0.0 {
        return Err(Refusal::because(RefusalReason::ElbowSide));
    }
    let start = kinematics::forward(&arm.geometry, from);
    let yaw = |q: &Vector4<f32>| q.x + q.y - q.w;
    let turned = if posture.turn == WristTurn::Nearest {
        // Axis 4 makes up for what shoulder and elbow turn: half a turn of the yaw is either way as long.
        let wrist = |turned: f32| end.x + end.y - yaw(from) - turned;
        let turned = wrap(to.yaw - yaw(from));
        let other = shorter_way(-turned, wrist(turned), &arm.limits);
        turned + (wrist(turned) - other)
    } else {
        yaw(end) - yaw(from)
    };
    let position = |pose: &Pose| Vector3::new(pose.x, pose.y, pose.z);
    let curve = match via {
        None => Curve::line(position(&start), &position(to)),
        Some(via) => Curve::arc(position(&start), via, &position(to)).map_err(|height| {
            if height.is_nan() {
                Refusal::because(RefusalReason::NotFinite)
            } else {
                Refusal::value(RefusalReason::NoCircle, height, MIN_HEIGHT)
            }
        })?,
    };
    Ok(Path::Tool {
        curve,
        yaw: yaw(from),
        turned,
        elbow,
    })
}

/// Heights of a jump; the top must lie above the end and inside the stroke.
fn gate(
    arm: &ArmModel,
    from: &Vector4<f32>,
    to: &Vector4<f32>,
    top: f32,
    clearance: f32,
) -> Result<Gate, Refusal> {
    if !(top.is_finite() && clearance.is_finite()) {
        return Err(Refusal::because(RefusalReason::NotFinite));
    }
    let d3_top = arm.geometry.d1 - arm.geometry.d4 - top;
    let (lower, upper) = (arm.limits.lower.z, arm.limits.upper.z);
    if d3_top < lower - NO_HEIGHT || d3_top > upper {
        return Err(from_ik(IkError::Limit {
            axis: Axis::Lift,
            value: d3_top,
            limit: if d3_top < lower { lower } else { upper },
        }));
    }
    let fall = zero_if_tiny(to.z - d3_top);
    if fall < 0.0 || clearance < 0.0 {
        return Err(Refusal::value(
            RefusalReason::OutOfRange,
            fall.min(clearance),
            0.0,
        ));
    }
    // The top is the least height: where a stop has left the arm higher, it goes across there.
    let d3_top = d3_top.max(lower).min(from.z);
    let (rise, fall) = (zero_if_tiny(from.z - d3_top), to.z - d3_top);
    Ok(Gate {
        rise,
        fall,
        clearance,
        room: (d3_top - arm.limits.lower.z).max(0.0),
    })
}

/// Less than a micrometre is what rounding and half an encoder count make of no height at all.
fn zero_if_tiny(height: f32) -> f32 {
    if height.abs() < NO_HEIGHT {
        0.0
    } else {
        height
    }
}

/// The refusal for an error of inverse kinematics.
pub(super) fn from_ik(error: IkError) -> Refusal {
    match error {
        IkError::NotFinite => Refusal::because(RefusalReason::NotFinite),
        IkError::TooFar { radius, max } => Refusal::value(RefusalReason::TooFar, radius, max),
        IkError::TooNear { radius, min } => Refusal::value(RefusalReason::TooNear, radius, min),
        IkError::Limit { axis, value, limit } => Refusal {
            reason: RefusalReason::JointLimit,
            axis: axis as u8,
            value,
            limit,
        },
    }
}

/// The refusal for an unreachable point of a path.
pub(super) fn from_path(error: PathError) -> Refusal {
    match error {
        PathError::Unreachable(error) => from_ik(error),
        PathError::Singular { sin_elbow } => {
            Refusal::value(RefusalReason::Singular, sin_elbow.abs(), MIN_SIN_ELBOW)
        }
    }
}
