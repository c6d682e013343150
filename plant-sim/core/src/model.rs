//! The robot as data: the contents of the model file, checked, in plain types.
//!
//! SI units throughout; arrays of four are in joint order `[theta1, theta2, d3, theta4]` (rad, rad, m, rad). The joint
//! frames are: joint 1 at the origin, joint 2 at `(a1, 0, d1)` of link 1, joint 3 at `(a2, 0, d2)` of link 2 turned by
//! pi about x (so that its z points down), joint 4 on the carriage, the flange at `(0, 0, d4)` of link 4.

pub mod file;
mod json;
mod read;

use std::sync::LazyLock;

use protocol::messages::FaultAxis;
use thiserror::Error;

use crate::text::{Source, allowed};

/// Names of the joints, in order.
pub const AXES: [&str; 4] = [
    FaultAxis::Shoulder.name(),
    FaultAxis::Elbow.name(),
    FaultAxis::Lift.name(),
    FaultAxis::Wrist.name(),
];

/// Models that come with the program: name and text.
const BUILT_IN: [(&str, &str); 2] = [
    (
        "irb930-22-1.05",
        include_str!("../../models/irb930-22-1.05.json"),
    ),
    (
        "irb930-12-0.85",
        include_str!("../../models/irb930-12-0.85.json"),
    ),
];

/// Everything the simulator knows about a robot. Equal are robots of the same name and numbers, wherever those are from.
#[derive(Clone, Debug)]
pub struct RobotModel {
    /// Free text.
    pub name: String,
    /// Acceleration of gravity along -z of frame 0, m/s2: 9.81, and not negative in a file: the controller knows no robot that hangs.
    pub gravity: f64,
    /// Distances between the axes.
    pub geometry: Geometry,
    /// Limits of the axes.
    pub limits: JointLimits,
    /// Arm 1, arm 2, carriage, shaft with flange.
    pub links: [Link; 4],
    /// Motors, gears and friction.
    pub drive: DriveTrain,
    /// Heaviest allowed payload, kg.
    pub payload_max: f64,
    /// What all this was read from. Numbers that are changed afterwards are not in it.
    pub source: Source,
}

/// Standard Denavit-Hartenberg lengths, m. The twists are always 0, pi, 0, 0, which makes the robot a SCARA.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Axis 1 to axis 2.
    pub a1: f64,
    /// Axis 2 to axes 3 and 4.
    pub a2: f64,
    /// Height of joint 2 above joint 1.
    pub d1: f64,
    /// Height of joint 3 above joint 2.
    pub d2: f64,
    /// From frame 3 down to the flange.
    pub d4: f64,
}

/// Limits of the joints; torques on the joint side, for axis 3 a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Smallest position.
    pub lower: [f64; 4],
    /// Largest position.
    pub upper: [f64; 4],
    /// Largest speed.
    pub velocity: [f64; 4],
    /// Largest acceleration, where the robot limits it.
    pub acceleration: Option<[f64; 4]>,
    /// Largest jerk, where the robot limits it.
    pub jerk: Option<[f64; 4]>,
    /// Largest effort for a short time.
    pub effort: [f64; 4],
    /// Time in which a motor takes up its largest effort from nothing, s.
    pub effort_rise_time: [f64; 4],
    /// Continuous rating: largest root-mean-square effort.
    pub effort_continuous: [f64; 4],
}

/// A rigid link; see the module for its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the joint frame, m.
    pub com: [f64; 3],
    /// Principal moments `Ixx, Iyy, Izz` about the centre of mass, along the joint frame, kg m2.
    pub inertia: [f64; 3],
}

/// Motors, gears, the screw-spline shaft and friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveTrain {
    /// Motor turns per joint turn; for axis 3 per turn of the screw nut.
    pub gear_ratio: [f64; 4],
    /// Advance of the ball screw, m/rev.
    pub screw_lead: f64,
    /// Sign of the turn of the screw nut that keeps the shaft at its height while axis 4 turns by +1 rad: +1 or -1.
    /// Motor 3 is counted positive when it lowers the shaft, whichever the hand.
    pub screw_hand: f64,
    /// Of rotor and gear input, on the motor side, kg m2.
    pub rotor_inertia: [f64; 4],
    /// Peak motor torque, N m.
    pub motor_torque_limit: [f64; 4],
    /// Continuous rating: torque that the motor can hold indefinitely, N m.
    pub motor_torque_rated: [f64; 4],
    /// Speed up to which the motor gives full torque, rad/s.
    pub motor_speed_limit: [f64; 4],
    /// Viscous friction of the joint, N m s/rad and N s/m.
    pub viscous: [f64; 4],
    /// Coulomb friction of the joint, N m and N.
    pub coulomb: [f64; 4],
    /// Speed over which Coulomb friction builds up as `tanh(qd / eps)`, rad/s and m/s.
    pub coulomb_eps: [f64; 4],
    /// Encoder counts per turn of the motor.
    pub encoder_counts: u32,
}

/// A body held at the flange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the flange frame (z down), m.
    pub com: [f64; 3],
    /// Principal moments about the centre of mass, along the flange frame, kg m2.
    pub inertia: [f64; 3],
}

/// Why a model or payload was refused.
#[derive(Debug, Error)]
#[error("{}{cause}", place.map(|(line, column)| format!("line {line}, column {column}: ")).unwrap_or_default())]
pub struct ModelError {
    /// Line and column counted from 1; for a missing key, those of the object that lacks it.
    pub place: Option<(usize, usize)>,
    /// What was wrong.
    pub cause: ModelErrorKind,
}

/// What was wrong with a model or payload file.
#[derive(Debug, Error)]
pub enum ModelErrorKind {
    /// The text is not JSON.
    #[error("not JSON: {0}")]
    Syntax(String),
    /// A key is missing.
    #[error("{path} is missing; it must be {expected}")]
    Missing {
        /// JSON path, as in `links[2].mass`.
        path: String,
        /// What is allowed there.
        expected: String,
    },
    /// A key is not known.
    #[error("{path} is not known{hint}")]
    Unknown {
        /// JSON path, as in `links[2].mass`.
        path: String,
        /// The nearest known key.
        hint: String,
    },
    /// A value is not allowed.
    #[error("{path} is {found}; it must be {expected}")]
    Wrong {
        /// JSON path, as in `links[2].mass`.
        path: String,
        /// What was found.
        found: String,
        /// What is allowed there.
        expected: String,
    },
}

impl PartialEq for RobotModel {
    fn eq(&self, other: &Self) -> bool {
        let Self {
            name,
            gravity,
            geometry,
            limits,
            links,
            drive,
            payload_max,
            source: _,
        } = self;
        *name == other.name
            && *gravity == other.gravity
            && *geometry == other.geometry
            && *limits == other.limits
            && *links == other.links
            && *drive == other.drive
            && *payload_max == other.payload_max
    }
}

/// Names of the robots that come with the program.
pub fn names() -> [&'static str; BUILT_IN.len()] {
    BUILT_IN.map(|(name, _)| name)
}

/// Those names, for a message that none is called `name`, and the one most likely meant.
pub fn instead_of(name: &str) -> String {
    allowed(name, &names())
}

impl RobotModel {
    /// The default robot: IRB 930-22/1.05.
    pub fn irb_930_22_105() -> Self {
        Self::built_in("irb930-22-1.05").expect("a name of the list")
    }

    /// The short one: IRB 930-12/0.85.
    pub fn irb_930_12_085() -> Self {
        Self::built_in("irb930-12-0.85").expect("a name of the list")
    }

    /// The model of this name that comes with the program.
    pub fn built_in(name: &str) -> Option<Self> {
        // Read once: a campaign asks for one twice a case.
        static ROBOTS: LazyLock<[RobotModel; BUILT_IN.len()]> = LazyLock::new(|| {
            BUILT_IN.map(|(name, text)| {
                let read = RobotModel::from_json(text);
                let (mut model, _) = read.expect("the built-in models are valid");
                model.source.origin = name.into();
                model
            })
        });
        let place = BUILT_IN.iter().position(|(known, _)| *known == name)?;
        Some(ROBOTS[place].clone())
    }

    /// Whether this is the text of a model that comes with the program.
    pub fn is_built_in(text: &str) -> bool {
        BUILT_IN.iter().any(|(_, known)| *known == text)
    }

    /// Reads the text of a model file. Where the text is from, `source.origin`, is left to the caller.
    ///
    /// Returns the model and one warning for each unknown key, and for each derived number (`com_dh_frame`, `lc`) that
    /// contradicts its source; the derived numbers themselves are not used.
    ///
    /// # Errors
    /// Names line, key, what is there and what may be.
    pub fn from_json(text: &str) -> Result<(Self, Vec<String>), ModelError> {
        read::robot(text)
    }
}

impl Payload {
    /// Reads the text of a payload file: `mass`, `com_flange_frame`, `inertia_com_diag`.
    ///
    /// # Errors
    /// Names line, key, what is there and what may be.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        read::payload(text)
    }
}
