//! What an operator asks the controller for, and what it answers.

use serde::{Deserialize, Serialize};

use crate::codes::codes;

/// Operator to controller: one request, answered by one [`MotionReply`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// Number that the reply repeats; wraps.
    pub sequence: u8,
    /// What is asked for.
    pub request: MotionRequest,
}

/// What can be asked of the controller. Joint targets are `[theta1, theta2, d3, theta4]` in rad, rad, m, rad; poses
/// `[x, y, z, yaw]` in frame 0, m, m, m, rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotionRequest {
    /// Take the axes under torque and hold.
    Enable,
    /// Brake on, torque off.
    Disable,
    /// Clear the latched fault if its cause is gone; lands disabled.
    FaultReset,
    /// Controlled stop; empties the queue.
    Stop,
    /// Straight in joint space.
    MoveJoint {
        /// Joint position.
        target: [f32; 4],
        /// Fraction of the joint limits, 0 to 1.
        speed: f32,
    },
    /// Straight in space.
    MoveLine {
        /// Pose.
        target: [f32; 4],
        /// Fraction of the joint limits, 0 to 1.
        speed: f32,
    },
    /// Up, across and down (gate motion).
    Jump {
        /// Pose.
        target: [f32; 4],
        /// Height of the top in frame 0, m.
        top: f32,
        /// Vertical rise after which, and fall before which, the motion across may run, m.
        clearance: f32,
        /// Fraction of the joint limits, 0 to 1.
        speed: f32,
    },
    /// What hangs on the flange from now on.
    SetPayload {
        /// Mass, kg.
        mass: f32,
        /// Centre of mass in the flange frame, m.
        com: [f32; 3],
        /// Moments of inertia about the centre of mass, along the axes of the flange frame, kg m2.
        inertia: [f32; 3],
    },
    /// Which control law to use.
    SelectLaw {
        /// Law.
        law: Law,
        /// What it has against constant disturbances.
        compensation: Compensation,
    },
    /// How stiff the loops are.
    SetGains {
        /// Bandwidth of the position loop, rad/s.
        bandwidth: f32,
        /// Damping ratio of the position loop.
        damping: f32,
        /// Bandwidth of the disturbance observer, rad/s.
        observer: f32,
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
        }
    }

    /// Whether it asks for a move, which is answered when planned and counted when completed.
    #[must_use]
    pub const fn is_move(&self) -> bool {
        matches!(
            self,
            Self::MoveJoint { .. } | Self::MoveLine { .. } | Self::Jump { .. }
        )
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
    /// Whether the law can be helped by a [`Compensation`] other than none.
    #[must_use]
    pub const fn takes_compensation(self) -> bool {
        match self {
            Self::ComputedTorqueJoint | Self::ComputedTorqueTask => true,
            Self::KinematicJoint | Self::KinematicTask | Self::Pid | Self::PdGravity => false,
        }
    }
}

codes! {
    /// What a law has against constant disturbances.
    pub enum Compensation {
        /// Nothing.
        None = 0, "none";
        /// Integral of the error, with anti-windup.
        Integral = 1, "integral";
        /// Disturbance observer.
        Observer = 2, "observer";
    }
}

/// Controller to operator: what became of a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionReply {
    /// Number of the request.
    pub sequence: u8,
    /// What became of it.
    pub outcome: Outcome,
}

/// What became of a request.
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

/// Why a request was refused, where, and what is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refusal {
    /// Why.
    pub reason: RefusalReason,
    /// Axis concerned, 0 to 3, or [`Refusal::NO_AXIS`].
    pub axis: u8,
    /// Value refused, in its own unit; 0 if there is none.
    pub value: f32,
    /// Bound it violates, in the same unit; 0 if there is none.
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

    /// A refusal because of one value of the request.
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
        /// The way leads through the stretched arm, where a straight line cannot be followed.
        Singular = 9, "singular";
        /// The payload is heavier than the robot may carry.
        PayloadTooHeavy = 10, "payload-too-heavy";
        /// Not while a motion is under way.
        Moving = 11, "moving";
        /// The drive cannot hold the arm on this move, however slow: a torque would pass its limit.
        TorqueTooSmall = 12, "torque-too-small";
        /// A stop came before the move was planned.
        Stopped = 13, "stopped";
        /// The law takes no compensation.
        NoCompensation = 14, "no-compensation";
    }
}
