//! The controller's model of its arm: geometry, links, limits, drive train, payload.
//!
//! Plain data with public fields, so that a robot is a constant, and serialisable, so that a robot can be sent to the
//! controller of a board. For any model that passes [`ArmModel::validate`], the
//! kinematics and dynamics of this crate never divide by zero and every mass matrix is positive definite.

mod validate;

use nalgebra::{Vector3, Vector4};
use serde::{Deserialize, Serialize};

pub use validate::{ModelError, Rule};

/// One of the four axes, in the order of every joint vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Axis 1: turns arm 1 about the base (rad).
    Shoulder,
    /// Axis 2: turns arm 2 about the end of arm 1 (rad).
    Elbow,
    /// Axis 3: moves the shaft along z, positive down (m).
    Lift,
    /// Axis 4: turns the shaft and the tool, positive about the axis that points down (rad).
    Wrist,
}

impl Axis {
    /// All axes in order.
    pub const ALL: [Self; 4] = [Self::Shoulder, Self::Elbow, Self::Lift, Self::Wrist];

    /// The component of a joint vector that belongs to this axis.
    #[must_use]
    pub fn of(self, joint: &Vector4<f32>) -> f32 {
        // Its place in the order, which a vector of four always has.
        joint.as_slice().get(self as usize).copied().unwrap_or(0.0)
    }

    /// The same, to change it.
    pub fn of_mut(self, joint: &mut Vector4<f32>) -> &mut f32 {
        match self {
            Self::Shoulder => &mut joint.x,
            Self::Elbow => &mut joint.y,
            Self::Lift => &mut joint.z,
            Self::Wrist => &mut joint.w,
        }
    }

    /// The next one in turn.
    #[must_use]
    pub const fn next(self) -> Self {
        match self {
            Self::Shoulder => Self::Elbow,
            Self::Elbow => Self::Lift,
            Self::Lift => Self::Wrist,
            Self::Wrist => Self::Shoulder,
        }
    }
}

/// A rigid body of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Mass (kg).
    pub mass: f32,
    /// Centre of mass (m) in the joint frame: the frame that moves with the link, on the axis that drives it. Frames 1
    /// and 2 have z up, frames 3 and 4 z down; x points along the arm.
    pub com: Vector3<f32>,
    /// Principal moments of inertia about the centre of mass (kg m^2), axes parallel to the joint frame.
    pub inertia: Vector3<f32>,
}

/// Lengths of the Denavit-Hartenberg table (paper, table 1). The twists 0, pi, 0, 0 define a SCARA and are
/// built in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Length of arm 1 (m).
    pub a1: f32,
    /// Length of arm 2 (m).
    pub a2: f32,
    /// Height of the arm plane above the origin of frame 0 (m): the offsets of joints 1 and 2 together.
    pub d1: f32,
    /// Distance of the flange below the arm plane with the lift at zero (m).
    pub d4: f32,
}

impl Geometry {
    /// Distance from the shoulder to the flange with the arm stretched (m).
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.a1 + self.a2
    }
}

/// Limits of the axes, joint side: rad or m, and their rates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JointLimits {
    /// Least position.
    pub lower: Vector4<f32>,
    /// Greatest position.
    pub upper: Vector4<f32>,
    /// Greatest speed.
    pub velocity: Vector4<f32>,
    /// Greatest acceleration, to protect the gears; [`JointLimits::NONE`] where torque alone is the limit.
    pub acceleration: Vector4<f32>,
    /// Greatest jerk; likewise.
    pub jerk: Vector4<f32>,
    /// Greatest effort (N m, lift N).
    pub effort: Vector4<f32>,
    /// Time in which a motor takes up its greatest torque (s).
    pub effort_rise_time: Vector4<f32>,
    /// Continuous effort (N m, lift N), as a root mean square. Only checked and stored, for a future thermal model of
    /// the motors; no law or plan uses it yet.
    pub effort_continuous: Vector4<f32>,
}

impl JointLimits {
    /// Stands for an acceleration or a jerk that is not limited.
    pub const NONE: f32 = f32::MAX;

    /// Whether the acceleration or the jerk of any axis is limited.
    #[must_use]
    pub fn caps_acceleration(&self) -> bool {
        self.acceleration.min() < Self::NONE || self.jerk.min() < Self::NONE
    }
}

/// Motors and transmissions, in the order of the axes. Motor 3 drives the nut of the ball-screw spline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DriveTrain {
    /// Motor turns per turn of the driven part (for the lift: of the screw nut).
    pub gear_ratio: Vector4<f32>,
    /// Travel of the lift per turn of the nut (m/rev).
    pub screw_lead: f32,
    /// +1 if a positive turn of the wrist needs a positive turn of motor 3 to hold the height, -1 for a screw of the other
    /// hand.
    pub screw_hand: f32,
    /// Inertia of rotor and gear input (kg m^2, motor side).
    pub rotor_inertia: Vector4<f32>,
    /// Greatest motor torque (N m).
    pub motor_torque_limit: Vector4<f32>,
    /// Continuous rating: motor torque that can be held indefinitely (N m).
    pub motor_torque_rated: Vector4<f32>,
    /// Greatest motor speed (rad/s).
    pub motor_speed_limit: Vector4<f32>,
    /// Viscous friction (N m s/rad, lift N s/m, joint side).
    pub viscous: Vector4<f32>,
    /// Coulomb friction (N m, lift N, joint side).
    pub coulomb: Vector4<f32>,
    /// Speed over which Coulomb friction builds up (rad/s, lift m/s): it is `coulomb * tanh(speed / coulomb_eps)`.
    pub coulomb_eps: Vector4<f32>,
    /// Encoder counts per motor turn.
    pub encoder_counts: u32,
}

/// A body held by the flange.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Payload {
    /// Mass (kg); zero for an empty flange.
    pub mass: f32,
    /// Centre of mass in the flange frame (m), z down.
    pub com: Vector3<f32>,
    /// Principal moments of inertia about the centre of mass (kg m^2), axes parallel to the flange frame.
    pub inertia: Vector3<f32>,
}

impl Payload {
    /// An empty flange.
    pub const NONE: Self = Self {
        mass: 0.0,
        com: Vector3::new(0.0, 0.0, 0.0),
        inertia: Vector3::new(0.0, 0.0, 0.0),
    };
}

/// Everything that the controller knows about an arm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ArmModel {
    /// Lengths.
    pub geometry: Geometry,
    /// Arm 1, arm 2, the lift carriage (which does not turn with the wrist), the spline shaft.
    pub links: [Link; 4],
    /// Acceleration of gravity (m/s^2), along -z of frame 0.
    pub gravity: f32,
    /// Limits of the axes.
    pub limits: JointLimits,
    /// Motors and transmissions.
    pub drive: DriveTrain,
    /// Greatest payload (kg).
    pub payload_max: f32,
}

/// ABB IRB 930-22/1.05: 22 kg at 1.05 m. Lengths from the manufacturer's drawings; masses, motors and gears are
/// estimates.
pub const IRB_930: ArmModel = ArmModel {
    geometry: Geometry {
        a1: 0.56,
        a2: 0.49,
        d1: 0.0,
        d4: 0.1213,
    },
    links: [
        Link {
            mass: 11.5,
            com: Vector3::new(0.235, 0.0, -0.0547),
            inertia: Vector3::new(0.053, 0.53, 0.55),
        },
        Link {
            mass: 14.5,
            com: Vector3::new(0.2, 0.0, 0.0902),
            inertia: Vector3::new(0.16, 0.57, 0.5),
        },
        Link {
            mass: 0.3,
            com: Vector3::new(0.0, 0.0, -0.45),
            inertia: Vector3::new(2e-4, 2e-4, 1.5e-4),
        },
        Link {
            mass: 1.65,
            com: Vector3::new(0.0, 0.0, -0.1835),
            inertia: Vector3::new(0.0668, 0.0668, 3.5e-4),
        },
    ],
    gravity: 9.81,
    limits: JointLimits {
        // 150, 145 and 400 degrees.
        lower: Vector4::new(-2.617_993_9, -2.530_727_4, 0.0, -6.981_317),
        upper: Vector4::new(2.617_993_9, 2.530_727_4, 0.3, 6.981_317),
        // 440, 700 and 1700 degrees per second.
        velocity: Vector4::new(7.679_448_7, 12.217_305, 2.2, 29.670_597),
        acceleration: Vector4::new(
            JointLimits::NONE,
            JointLimits::NONE,
            JointLimits::NONE,
            JointLimits::NONE,
        ),
        jerk: Vector4::new(
            JointLimits::NONE,
            JointLimits::NONE,
            JointLimits::NONE,
            JointLimits::NONE,
        ),
        effort: Vector4::new(640.0, 400.0, 860.0, 30.0),
        effort_rise_time: Vector4::new(0.010, 0.010, 0.010, 0.010),
        effort_continuous: Vector4::new(216.0, 127.0, 287.0, 10.2),
    },
    drive: DriveTrain {
        gear_ratio: Vector4::new(80.0, 50.0, 1.0, 20.0),
        screw_lead: 0.025,
        screw_hand: 1.0,
        rotor_inertia: Vector4::new(3.84e-4, 3.0e-4, 1.3e-4, 5e-5),
        motor_torque_limit: Vector4::new(8.0, 8.0, 3.42, 1.5),
        motor_torque_rated: Vector4::new(3.18, 3.18, 1.27, 0.637),
        motor_speed_limit: Vector4::new(628.3, 628.3, 628.3, 628.3),
        viscous: Vector4::new(4.0, 1.5, 40.0, 0.08),
        coulomb: Vector4::new(12.0, 6.0, 20.0, 0.6),
        coulomb_eps: Vector4::new(0.01, 0.01, 0.001, 0.01),
        encoder_counts: 131_072,
    },
    payload_max: 22.0,
};
