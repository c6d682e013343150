//! The robot as data: what the model file says, checked, in plain types.
//!
//! SI units throughout; arrays of four are in joint order `[theta1, theta2, d3, theta4]` (rad, rad, m, rad). The joint
//! frames are: joint 1 at the origin, joint 2 at `(a1, 0, d1)` of link 1, joint 3 at `(a2, 0, d2)` of link 2 turned by
//! pi about x (so that its z points down), joint 4 on the carriage, the flange at `(0, 0, d4)` of link 4.

mod json;

use json::{Allowed, Node};
use thiserror::Error;

/// Everything the simulator knows about a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotModel {
    /// Free text.
    pub name: String,
    /// Acceleration of gravity along -z of frame 0, m/s2: 9.81 for a robot that stands, negative for one that hangs.
    pub gravity: f64,
    /// Distances between the axes.
    pub geometry: Geometry,
    /// What the axes may do.
    pub limits: JointLimits,
    /// Arm 1, arm 2, carriage, shaft with flange.
    pub links: [Link; 4],
    /// Motors, gears and friction.
    pub drive: DriveTrain,
    /// Heaviest allowed payload, kg.
    pub payload_max: f64,
}

/// Standard Denavit-Hartenberg lengths, m. The twists are always 0, pi, 0, 0: that is what makes the robot a SCARA.
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

/// Limits of the joints; torques are of the joint side, axis 3 a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Smallest position.
    pub lower: [f64; 4],
    /// Largest position.
    pub upper: [f64; 4],
    /// Largest speed.
    pub velocity: [f64; 4],
    /// Largest acceleration.
    pub acceleration: [f64; 4],
    /// Largest jerk.
    pub jerk: [f64; 4],
    /// Largest effort for a short time.
    pub effort: [f64; 4],
    /// Largest root-mean-square effort for ever.
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
    /// Torque that the motor gives at most, N m.
    pub motor_torque_limit: [f64; 4],
    /// Torque that the motor gives for ever, N m.
    pub motor_torque_rated: [f64; 4],
    /// Speed up to which the motor gives its full torque, rad/s.
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
#[error("{}{cause}", line.map(|l| format!("line {l}: ")).unwrap_or_default())]
pub struct ModelError {
    /// Line counted from 1; for something missing, that of the object it is missing from.
    pub line: Option<usize>,
    /// What was wrong.
    pub cause: ModelErrorKind,
}

/// What was wrong with a model or payload file.
#[derive(Debug, Error)]
pub enum ModelErrorKind {
    /// The text is not JSON.
    #[error("not JSON: {0}")]
    Syntax(String),
    /// A key is not there.
    #[error("{path} is missing; it must be {expected}")]
    Missing {
        /// JSON path, as in `links[2].mass`.
        path: String,
        /// What is allowed there.
        expected: String,
    },
    /// A value is not what it must be.
    #[error("{path} is {found}; it must be {expected}")]
    Wrong {
        /// JSON path, as in `links[2].mass`.
        path: String,
        /// What stands there.
        found: String,
        /// What is allowed there.
        expected: String,
    },
}

/// Tolerance within which a derived or an implied number repeats another one: model files carry rounded decimals.
const SAME: f64 = 1e-9;

impl RobotModel {
    /// The default robot: IRB 930-22/1.05.
    pub fn irb_930_22_105() -> Self {
        Self::built_in(include_str!("../../models/irb930-22-1.05.json"))
    }

    /// The short one: IRB 930-12/0.85.
    pub fn irb_930_12_085() -> Self {
        Self::built_in(include_str!("../../models/irb930-12-0.85.json"))
    }

    fn built_in(text: &str) -> Self {
        Self::from_json(text)
            .expect("the built-in models are valid")
            .0
    }

    /// Reads the text of a model file.
    ///
    /// Returns the model and one warning for each derived number (`com_dh_frame`, `lc`) in the file that contradicts
    /// what it is derived from; the derived numbers themselves are not used. Unknown keys are tolerated.
    ///
    /// # Errors
    /// Names line, key, what is there and what may be.
    pub fn from_json(text: &str) -> Result<(Self, Vec<String>), ModelError> {
        let value = json::parse(text)?;
        let root = Node::root(text, &value);
        let geometry = read_geometry(&root.get("dh", "the Denavit-Hartenberg table")?)?;
        let mut warnings = Vec::new();
        let links = read_links(&root, &geometry, &mut warnings)?;
        let model = Self {
            name: root.string("name")?.to_owned(),
            gravity: read_gravity(&root)?,
            geometry,
            limits: read_limits(&root.get("joint_limits", "the limits of the joints")?)?,
            links,
            drive: read_drive(&root.get("drive", "the data of motors, gears and friction")?)?,
            payload_max: root
                .get("payload_rated_max_kg", "an object")?
                .number("max", Allowed::Positive)?,
        };
        Ok((model, warnings))
    }
}

impl Payload {
    /// Reads the text of a payload file: `mass`, `com_flange_frame`, `inertia_com_diag`.
    ///
    /// # Errors
    /// Names line, key, what is there and what may be.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let value = json::parse(text)?;
        let root = Node::root(text, &value);
        // A point mass, and a gripper's empty hand, are allowed at the flange.
        Ok(Self {
            mass: root.number("mass", Allowed::NotNegative)?,
            com: root.numbers("com_flange_frame", Allowed::Finite)?,
            inertia: root.numbers("inertia_com_diag", Allowed::NotNegative)?,
        })
    }
}

fn read_gravity(root: &Node<'_>) -> Result<f64, ModelError> {
    let [x, y, z] = root.numbers("gravity", Allowed::Finite)?;
    if x != 0.0 || y != 0.0 {
        // The lift would no longer be the only axis that carries weight: nothing here is made for that.
        return Err(root.get("gravity", "")?.wrong("vertical: [0, 0, z]"));
    }
    Ok(-z)
}

fn read_geometry(dh: &Node<'_>) -> Result<Geometry, ModelError> {
    let alpha: [f64; 4] = dh.numbers("alpha", Allowed::Finite)?;
    let scara = [0.0, std::f64::consts::PI, 0.0, 0.0];
    if alpha
        .iter()
        .zip(scara)
        .any(|(found, wanted)| (found - wanted).abs() > SAME)
    {
        return Err(dh
            .get("alpha", "")?
            .wrong("[0, pi, 0, 0], the twists of a SCARA"));
    }
    Ok(Geometry {
        a1: dh.number("a1", Allowed::Positive)?,
        a2: dh.number("a2", Allowed::Positive)?,
        d1: dh.number("d1", Allowed::Finite)?,
        d2: dh.number("d2", Allowed::Finite)?,
        d4: dh.number("d4", Allowed::Finite)?,
    })
}

fn read_limits(node: &Node<'_>) -> Result<JointLimits, ModelError> {
    let limits = JointLimits {
        lower: node.numbers("lower", Allowed::Finite)?,
        upper: node.numbers("upper", Allowed::Finite)?,
        velocity: node.numbers("velocity", Allowed::Positive)?,
        acceleration: node.numbers("acceleration_cap", Allowed::Positive)?,
        jerk: node.numbers("jerk_cap", Allowed::Positive)?,
        effort: node.numbers("effort_peak", Allowed::Positive)?,
        effort_continuous: node.numbers("effort_continuous_rms", Allowed::Positive)?,
    };
    let uppers = node.get("upper", "")?.elements::<4>("")?;
    for (upper, (low, high)) in uppers.iter().zip(limits.lower.iter().zip(limits.upper)) {
        if *low >= high {
            return Err(upper.wrong(format!("above the lower limit {low}")));
        }
    }
    Ok(limits)
}

fn read_links(
    root: &Node<'_>,
    geometry: &Geometry,
    warnings: &mut Vec<String>,
) -> Result<[Link; 4], ModelError> {
    let nodes = root
        .get("links", "an array of 4 links")?
        .elements::<4>("links")?;
    let mut links = [Link {
        mass: 0.0,
        com: [0.0; 3],
        inertia: [0.0; 3],
    }; 4];
    for (index, (link, node)) in links.iter_mut().zip(&nodes).enumerate() {
        *link = Link {
            mass: node.number("mass", Allowed::Positive)?,
            com: node.numbers("com_joint_frame", Allowed::Finite)?,
            inertia: node.numbers("inertia_com_diag", Allowed::Positive)?,
        };
        check_derived(
            node,
            link,
            com_in_dh_frame(geometry, index, link.com),
            warnings,
        )?;
    }
    Ok(links)
}

/// The centre of mass of link `index` in the standard DH frame, which stands at the far end of the link.
fn com_in_dh_frame(geometry: &Geometry, index: usize, [x, y, z]: [f64; 3]) -> [f64; 3] {
    match index {
        0 => [x - geometry.a1, y, z - geometry.d1],
        1 => [x - geometry.a2, -y, geometry.d2 - z],
        2 => [x, y, z],
        _ => [x, y, z - geometry.d4],
    }
}

fn check_derived(
    node: &Node<'_>,
    link: &Link,
    com_dh: [f64; 3],
    warnings: &mut Vec<String>,
) -> Result<(), ModelError> {
    let mut warn =
        |derived: &Node<'_>, found: &dyn std::fmt::Debug, follows: &dyn std::fmt::Debug| {
            warnings.push(format!(
            "line {}: {} is {found:?}, but {}.com_joint_frame, which is used, gives {follows:?}",
            derived.line(),
            derived.path(),
            node.path()
        ));
        };
    if let Some(derived) = node.optional("com_dh_frame") {
        let found: [f64; 3] = derived.as_numbers(Allowed::Finite)?;
        if found.iter().zip(com_dh).any(|(a, b)| (a - b).abs() > SAME) {
            warn(&derived, &found, &com_dh);
        }
    }
    if let Some(derived) = node.optional("lc") {
        let found = derived.as_number(Allowed::Finite)?;
        let distance = link.com[0].hypot(link.com[1]);
        if (found.abs() - distance).abs() > SAME {
            warn(&derived, &found, &distance);
        }
    }
    Ok(())
}

fn read_drive(node: &Node<'_>) -> Result<DriveTrain, ModelError> {
    let screw_hand = node.number("screw_hand_sign", Allowed::Finite)?;
    if screw_hand.abs() != 1.0 {
        return Err(node.get("screw_hand_sign", "")?.wrong("1 or -1"));
    }
    let counts = node.number("encoder_counts_per_motor_rev", Allowed::Positive)?;
    if counts.fract() != 0.0 || counts > f64::from(i32::MAX) {
        return Err(node
            .get("encoder_counts_per_motor_rev", "")?
            .wrong("a whole number up to 2147483647"));
    }
    Ok(DriveTrain {
        gear_ratio: node.numbers("gear_ratio", Allowed::Positive)?,
        screw_lead: node.number("ball_screw_lead_m_per_rev", Allowed::Positive)?,
        screw_hand,
        rotor_inertia: node.numbers("rotor_inertia_motor_side", Allowed::NotNegative)?,
        motor_torque_limit: node.numbers("motor_torque_limit_model", Allowed::Positive)?,
        motor_torque_rated: node.numbers("motor_rated_torque", Allowed::Positive)?,
        motor_speed_limit: node.numbers("motor_max_speed_rad_s", Allowed::Positive)?,
        viscous: node.numbers("viscous", Allowed::NotNegative)?,
        coulomb: node.numbers("coulomb", Allowed::NotNegative)?,
        coulomb_eps: node.numbers("coulomb_tanh_eps", Allowed::Positive)?,
        encoder_counts: counts as u32,
    })
}
