//! Requests of an operator, and the controller's replies.

use serde::{Deserialize, Serialize};

use super::Posture;
use crate::codes::codes;

/// Operator to controller: one request, answered by one [`MotionReply`], but for a [hold](MotionRequest::Hold).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// Sequence number, repeated by the reply; wraps.
    pub sequence: u8,
    /// The request.
    pub request: MotionRequest,
}

/// Requests to the controller. Joint targets are `[theta1, theta2, d3, theta4]` in rad, rad, m, rad; poses
/// `[x, y, z, yaw]` in frame 0, m, m, m, rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotionRequest {
    /// Switch on torque and hold position.
    Enable,
    /// Brake on, torque off.
    Disable,
    /// Clear the latched fault if its cause is gone; the axes stay disabled.
    FaultReset,
    /// Controlled stop; empties the queue.
    Stop,
    /// Straight move in joint space.
    MoveJoint {
        /// Joint position.
        target: [f32; 4],
        /// Fraction of the joint limits, 0 to 1.
        speed: f32,
        /// How far from the end the arm may leave the path for that of the next move, without a stop, m; 0 to stop there.
        zone: f32,
    },
    /// Straight line of the tool.
    MoveLine {
        /// Pose.
        target: [f32; 4],
        /// Fraction of the joint limits, 0 to 1.
        speed: f32,
        /// Which joint positions at the end. The elbow cannot change its side on the way.
        posture: Posture,
        /// Greatest speed of the flange, m/s; 0 for as fast as the arm can.
        tool_speed: f32,
        /// How far from the end the arm may leave the path for that of the next move, without a stop, m; 0 to stop there.
        zone: f32,
    },
    /// Up, across and down (gate motion).
    Jump {
        /// Pose.
        target: [f32; 4],
        /// Height of the top in frame 0, m.
        top: f32,
        /// Height above each end below which the motion is strictly vertical, m.
        clearance: f32,
        /// Fraction of the joint limits, 0 to 1.
        speed: f32,
        /// Which joint positions at the end.
        posture: Posture,
        /// How far from the end the arm may leave the path for that of the next move, without a stop, m; 0 to stop there.
        zone: f32,
    },
    /// Payload at the flange from now on.
    SetPayload {
        /// Mass, kg.
        mass: f32,
        /// Centre of mass in the flange frame, m.
        com: [f32; 3],
        /// Moments of inertia about the centre of mass, along the axes of the flange frame, kg m2.
        inertia: [f32; 3],
    },
    /// Choice of control law.
    SelectLaw {
        /// Law.
        law: Law,
        /// Its compensation of constant disturbances.
        compensation: Compensation,
    },
    /// Stiffness of the loops.
    SetGains {
        /// Bandwidth of the position loop, rad/s.
        bandwidth: f32,
        /// Damping ratio of the position loop.
        damping: f32,
        /// Bandwidth of the disturbance observer, rad/s.
        observer: f32,
    },
    /// Speed override: at which pace every move passes from now on, under way or not.
    SetOverride {
        /// Share of the speed that each move was planned with, 0 to 1; 0 holds the arm on its path until it is raised again.
        pace: f32,
    },
    /// How the arm is operated from now on, where nothing moves.
    SetOperation {
        /// The operation.
        operation: Operation,
    },
    /// In manual operation: moves may go on for another hold time. A sign of life that is repeated as long as a person holds a button;
    /// answered only where it is refused.
    Hold,
    /// Arc of the tool through three points: from where it is, through `via`, to the target.
    MoveArc {
        /// Pose.
        target: [f32; 4],
        /// Point on the way, x, y, z.
        via: [f32; 3],
        /// Fraction of the joint limits, 0 to 1.
        speed: f32,
        /// Which joint positions at the end. The elbow cannot change its side on the way.
        posture: Posture,
        /// Greatest speed of the flange, m/s; 0 for as fast as the arm can.
        tool_speed: f32,
        /// How far from the end the arm may leave the path for that of the next move, without a stop, m; 0 to stop there.
        zone: f32,
    },
}

impl MotionRequest {
    /// Names by wire tag, which is the order of the variants.
    pub const NAMES: &'static [(u8, &'static str)] = &[
        (0, "enable"),
        (1, "disable"),
        (2, "fault-reset"),
        (3, "stop"),
        (4, "move-joint"),
        (5, "move-line"),
        (6, "jump"),
        (7, "set-payload"),
        (8, "select-law"),
        (9, "set-gains"),
        (10, "set-override"),
        (11, "set-operation"),
        (12, "hold"),
        (13, "move-arc"),
    ];

    /// Name, lower case with hyphens.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Enable => "enable",
            Self::Disable => "disable",
            Self::FaultReset => "fault-reset",
            Self::Stop => "stop",
            Self::MoveJoint { .. } => "move-joint",
            Self::MoveLine { .. } => "move-line",
            Self::Jump { .. } => "jump",
            Self::SetPayload { .. } => "set-payload",
            Self::SelectLaw { .. } => "select-law",
            Self::SetGains { .. } => "set-gains",
            Self::SetOverride { .. } => "set-override",
            Self::SetOperation { .. } => "set-operation",
            Self::Hold => "hold",
            Self::MoveArc { .. } => "move-arc",
        }
    }

    /// Which joint positions are meant, where it asks for a pose.
    #[must_use]
    pub const fn posture(&self) -> Option<Posture> {
        match self {
            Self::MoveLine { posture, .. }
            | Self::MoveArc { posture, .. }
            | Self::Jump { posture, .. } => Some(*posture),
            _ => None,
        }
    }

    /// Whether it requests a move, which is answered once planned and counted once completed.
    #[must_use]
    pub const fn is_move(&self) -> bool {
        matches!(
            self,
            Self::MoveJoint { .. }
                | Self::MoveLine { .. }
                | Self::MoveArc { .. }
                | Self::Jump { .. }
        )
    }
}

codes! {
    /// Who keeps moves going (operating modes of ISO 10218-1).
    pub enum Operation {
        /// Moves go on by themselves.
        Automatic = 0, "automatic";
        /// Moves go on only while they are held, and no faster at the tool than 250 mm/s.
        Manual = 1, "manual";
    }
}

codes! {
    /// Control law.
    pub enum Law {
        /// Kinematic, joint space.
        KinematicJoint = 0, "kinematic-joint";
        /// Kinematic, task space.
        KinematicTask = 1, "kinematic-task";
        /// Independent joint PID.
        Pid = 2, "pid";
        /// PD with gravity compensation.
        PdGravity = 3, "pd-gravity";
        /// Computed torque, joint space.
        ComputedTorqueJoint = 4, "computed-torque";
        /// Computed torque, task space.
        ComputedTorqueTask = 5, "computed-torque-task";
    }
}

impl Law {
    /// Whether the law accepts a [`Compensation`] other than none.
    #[must_use]
    pub const fn takes_compensation(self) -> bool {
        match self {
            Self::ComputedTorqueJoint | Self::ComputedTorqueTask => true,
            Self::KinematicJoint | Self::KinematicTask | Self::Pid | Self::PdGravity => false,
        }
    }
}

codes! {
    /// Compensation of constant disturbances by a law.
    pub enum Compensation {
        /// Nothing.
        None = 0, "none";
        /// Integral of the error, with anti-windup.
        Integral = 1, "integral";
        /// Disturbance observer.
        Observer = 2, "observer";
    }
}

/// Controller to operator: outcome of a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionReply {
    /// Number of the request.
    pub sequence: u8,
    /// Outcome.
    pub outcome: Outcome,
}

/// Outcome of a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Outcome {
    /// Done, or queued.
    Accepted,
    /// Nothing has changed.
    Refused(Refusal),
}

impl Outcome {
    /// Names by wire tag, which is the order of the variants.
    pub const NAMES: &'static [(u8, &'static str)] = &[(0, "accepted"), (1, "refused")];
}

/// Why a request was refused: axis, value and limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refusal {
    /// Why.
    pub reason: RefusalReason,
    /// Axis concerned, 0 to 3, or [`Refusal::NO_AXIS`].
    pub axis: u8,
    /// Value refused, in its own unit; 0 if there is none.
    pub value: f32,
    /// Bound violated, in the same unit; 0 if there is none.
    pub limit: f32,
}

impl Refusal {
    /// No single axis is concerned.
    pub const NO_AXIS: u8 = 255;

    /// Refusal for a reason that has neither axis nor number.
    #[must_use]
    pub const fn because(reason: RefusalReason) -> Self {
        Self {
            reason,
            axis: Self::NO_AXIS,
            value: 0.0,
            limit: 0.0,
        }
    }

    /// Refusal for one value of the request.
    #[must_use]
    pub const fn value(reason: RefusalReason, value: f32, limit: f32) -> Self {
        Self {
            reason,
            axis: Self::NO_AXIS,
            value,
            limit,
        }
    }
}

codes! {
    /// Why a request was refused.
    pub enum RefusalReason {
        /// The axes are not under torque.
        NotEnabled = 0, "not-enabled";
        /// The present state does not allow it.
        WrongState = 1, "wrong-state";
        /// The peers were built from different message tables.
        SchemaMismatch = 2, "schema-mismatch";
        /// No more motions can be queued.
        QueueFull = 3, "queue-full";
        /// A value is not a finite number.
        NotFinite = 4, "not-finite";
        /// A value is out of its range.
        OutOfRange = 5, "out-of-range";
        /// The target is beyond the reach of the stretched arm.
        TooFar = 6, "too-far";
        /// The target is closer to the base than the folded arm reaches.
        TooNear = 7, "too-near";
        /// An axis would leave its range.
        JointLimit = 8, "joint-limit";
        /// The path passes through the stretched arm, where a line or an arc cannot be followed.
        Singular = 9, "singular";
        /// The payload is heavier than the robot may carry.
        PayloadTooHeavy = 10, "payload-too-heavy";
        /// Not allowed while a motion is under way.
        Moving = 11, "moving";
        /// The drive cannot hold the arm on this move, however slow: a torque would exceed its limit.
        TorqueTooSmall = 12, "torque-too-small";
        /// A stop came before the move was planned.
        Stopped = 13, "stopped";
        /// The law takes no compensation.
        NoCompensation = 14, "no-compensation";
        /// A line or an arc cannot bring the elbow to its other side.
        ElbowSide = 15, "elbow-side";
        /// The three points of an arc lie on one line, or two of them coincide.
        NoCircle = 16, "no-circle";
    }
}
