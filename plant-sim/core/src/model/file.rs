//! What a model file holds: keys, ranges, units. The reader takes the keys that it knows from here.

use std::f64::consts::PI;

use schemars::{JsonSchema, SchemaGenerator};

use crate::allowed::schema::{Each, Exactly, Unused, by};
use crate::allowed::{Allowed, PAYLOAD_COM, PAYLOAD_INERTIA, PAYLOAD_MASS};

pub(super) const LENGTH: Allowed = Allowed::above_zero(10.0, "m");
pub(super) const COORDINATE: Allowed = Allowed::within(-10.0, 10.0, "m");
pub(super) const LINK_MASS: Allowed = Allowed::above_zero(1000.0, "kg");
/// Not zero: without inertia of the shaft the mass matrix would be singular.
pub(super) const LINK_INERTIA: Allowed = Allowed::above_zero(1000.0, "kg m2");
/// About three turns either way.
pub(super) const ANGLE: Allowed = Allowed::within(-20.0, 20.0, "rad");
pub(super) const POSITION: Each<4> = joints(ANGLE, COORDINATE);
pub(super) const VELOCITY: Each<4> = joints(
    Allowed::above_zero(1000.0, "rad/s"),
    Allowed::above_zero(100.0, "m/s"),
);
pub(super) const ACCELERATION: Each<4> = joints(
    Allowed::above_zero(1e5, "rad/s2"),
    Allowed::above_zero(1e4, "m/s2"),
);
pub(super) const JERK: Each<4> = joints(
    Allowed::above_zero(1e8, "rad/s3"),
    Allowed::above_zero(1e7, "m/s3"),
);
pub(super) const EFFORT: Each<4> = joints(
    Allowed::above_zero(1e6, "N m"),
    Allowed::above_zero(1e7, "N"),
);
/// At least one sample of the fastest drives.
pub(super) const RISE_TIME: Each<4> = joints(
    Allowed::within(1e-4, 1.0, "s"),
    Allowed::within(1e-4, 1.0, "s"),
);
pub(super) const GRAVITY: Allowed = Allowed::within(-100.0, 0.0, "m/s2");
pub(super) const PAYLOAD_MAX: Allowed = Allowed::above_zero(100.0, "kg");
pub(super) const GEAR_RATIO: Allowed = Allowed::within(0.01, 1e4, "");
/// Of a motor with the torque above: a thousand times that of those shipped.
pub(super) const ROTOR_INERTIA: Allowed = Allowed::within(0.0, 1.0, "kg m2");
pub(super) const SCREW_LEAD: Allowed = Allowed::within(1e-5, 1.0, "m");
/// Limit of the Command message.
pub(super) const MOTOR_TORQUE: Allowed = Allowed::above_zero(200.0, "N m");
/// Limit of the Feedback message, less a fifth for a motor driven beyond its limit.
pub(super) const MOTOR_SPEED: Allowed = Allowed::above_zero(1600.0, "rad/s");
/// One count per sample must not read as full speed.
pub(super) const FEWEST_COUNTS: u32 = 256;
pub(super) const ANY_POSITIVE: Allowed = Allowed::above_zero(1e9, "");
pub(super) const ANY_NOT_NEGATIVE: Allowed = Allowed::within(0.0, 1e9, "");

/// Keys that other programs put into the same objects.
const UNUSED: &[&str] = &["comment"];
const UNUSED_IN_ROOT: &[&str] = &[
    "comment",
    "dh_convention",
    "base_frame_height_above_mounting",
    "base",
    "payload_inertia_izz",
    "payload_test_10kg",
    "payload_test_ecc5kg",
    "spec",
    "variants",
];
const UNUSED_IN_DH: &[&str] = &["variables", "comment"];
const UNUSED_IN_DRIVE: &[&str] = &[
    "comment",
    "motor_peak_torque",
    "motor_rated_power_w",
    "torque_constant_nm_per_arms",
    "efficiency_info_only",
    "encoder_multiturn_bits",
    "gear_stiffness_optional",
    "gear_damping_ratio_optional",
];

/// Twists of a SCARA.
const TWISTS: [Option<f64>; 4] = [Some(0.0), Some(PI), Some(0.0), Some(0.0)];
/// Gravity along z.
const VERTICAL: [Option<f64>; 3] = [Some(0.0), Some(0.0), None];

/// Rotary axes as `turning`, the lift as `lift`.
const fn joints(turning: Allowed, lift: Allowed) -> Each<4> {
    Each([turning, turning, lift, turning])
}

/// A robot: JSON, in SI units. Arrays of four are in the order shoulder, elbow, lift, wrist. An unknown key is warned of.
#[derive(JsonSchema)]
#[schemars(transform = Unused(UNUSED_IN_ROOT))]
pub struct ModelFile {
    /// Free text, for summaries and messages.
    pub name: String,
    /// If there: a text that begins with SI.
    #[schemars(regex(pattern = "^SI"))]
    pub units: Option<String>,
    /// Acceleration of gravity in frame 0; vertical, downwards: [0, 0, -9.81]. A robot that hangs is
    /// not supported.
    #[schemars(transform = by(GRAVITY), transform = Exactly(VERTICAL))]
    pub gravity: [f64; 3],
    /// Denavit-Hartenberg lengths.
    pub dh: Dh,
    /// What the axes may do, on the joint side.
    pub joint_limits: Limits,
    /// Arm 1, arm 2, carriage, shaft with flange.
    pub links: [Link; 4],
    /// Payloads.
    pub payload_rated_max_kg: PayloadLimits,
    /// Motors, gears, encoders and friction.
    pub drive: Drive,
}

/// Standard Denavit-Hartenberg lengths and twists.
#[derive(JsonSchema)]
#[schemars(transform = Unused(UNUSED_IN_DH))]
pub struct Dh {
    /// Axis 1 to axis 2.
    #[schemars(transform = by(LENGTH))]
    pub a1: f64,
    /// Axis 2 to axes 3 and 4.
    #[schemars(transform = by(LENGTH))]
    pub a2: f64,
    /// Twists, rad: those of a SCARA.
    #[schemars(transform = Exactly(TWISTS))]
    pub alpha: [f64; 4],
    /// Height of joint 2 above joint 1.
    #[schemars(transform = by(COORDINATE))]
    pub d1: f64,
    /// Height of joint 3 above joint 2.
    #[schemars(transform = by(COORDINATE))]
    pub d2: f64,
    /// From frame 3 down to the flange.
    #[schemars(transform = by(COORDINATE))]
    pub d4: f64,
}

/// Limits of the joints.
#[derive(JsonSchema)]
#[schemars(transform = Unused(UNUSED))]
pub struct Limits {
    /// Smallest positions.
    #[schemars(transform = by(POSITION))]
    pub lower: [f64; 4],
    /// Largest positions; above the smallest.
    #[schemars(transform = by(POSITION))]
    pub upper: [f64; 4],
    /// Largest speeds.
    #[schemars(transform = by(VELOCITY))]
    pub velocity: [f64; 4],
    /// Largest accelerations, to protect the gears; without it torque alone is the limit.
    #[schemars(transform = by(ACCELERATION))]
    pub acceleration_cap: Option<[f64; 4]>,
    /// Largest jerks; likewise.
    #[schemars(transform = by(JERK))]
    pub jerk_cap: Option<[f64; 4]>,
    /// Largest efforts for a short time.
    #[schemars(transform = by(EFFORT))]
    pub effort_peak: [f64; 4],
    /// Times in which the motors take up their peak from nothing; 0.010 without it. Four samples or more: with less than two, which is
    /// warned of, moves become slower, since a command holds for a whole sample and motors come to their limits.
    #[schemars(transform = by(RISE_TIME))]
    pub effort_rise_time_s: Option<[f64; 4]>,
    /// Largest root-mean-square efforts; at most the peak.
    #[schemars(transform = by(EFFORT))]
    pub effort_continuous_rms: [f64; 4],
}

/// A rigid link. Joint frames are parallel to frame 0 at joint positions 0, those of links 3 and 4 turned by pi about x.
#[derive(JsonSchema)]
#[schemars(transform = Unused(UNUSED))]
pub struct Link {
    /// If it has a digit from 1 to 4, that is the place of the link.
    pub name: Option<String>,
    /// Mass.
    #[schemars(transform = by(LINK_MASS))]
    pub mass: f64,
    /// Centre of mass in the joint frame.
    #[schemars(transform = by(COORDINATE))]
    pub com_joint_frame: [f64; 3],
    /// Principal moments of inertia about the centre of mass, along the joint frame. None is greater than the sum of the
    /// other two.
    #[schemars(transform = by(LINK_INERTIA))]
    pub inertia_com_diag: [f64; 3],
    /// Centre of mass in the Denavit-Hartenberg frame: not used, warned of where it contradicts.
    #[schemars(transform = by(COORDINATE))]
    pub com_dh_frame: Option<[f64; 3]>,
    /// Distance of the centre of mass from the joint's axis: not used, warned of where it contradicts.
    #[schemars(transform = by(COORDINATE))]
    pub lc: Option<f64>,
}

/// What the robot carries.
#[derive(JsonSchema)]
pub struct PayloadLimits {
    /// Payload that the robot is specified with, at most the heaviest: checked, and not used.
    #[schemars(transform = by(PAYLOAD_MAX))]
    pub rated: Option<f64>,
    /// Heaviest payload.
    #[schemars(transform = by(PAYLOAD_MAX))]
    pub max: f64,
}

/// Motors, gears, encoders and friction.
#[derive(JsonSchema)]
#[schemars(transform = Unused(UNUSED_IN_DRIVE))]
pub struct Drive {
    /// Motor turns per joint turn; for the lift per turn of the screw nut.
    #[schemars(transform = by(GEAR_RATIO))]
    pub gear_ratio: [f64; 4],
    /// Advance of the ball screw, per revolution.
    #[schemars(transform = by(SCREW_LEAD))]
    pub ball_screw_lead_m_per_rev: f64,
    /// 1 or -1: sign of the turn of the screw nut that keeps the shaft at its height while the wrist turns by +1 rad.
    #[schemars(extend("enum" = [1.0, -1.0]))]
    pub screw_hand_sign: f64,
    /// Of rotor and gear input, on the motor side.
    #[schemars(transform = by(ROTOR_INERTIA))]
    pub rotor_inertia_motor_side: [f64; 4],
    /// Torque that the motor gives at most.
    #[schemars(transform = by(MOTOR_TORQUE))]
    pub motor_torque_limit_model: [f64; 4],
    /// Torque that the motor can hold indefinitely; at most its limit.
    #[schemars(transform = by(MOTOR_TORQUE))]
    pub motor_rated_torque: [f64; 4],
    /// Speed up to which the motor gives its full torque.
    #[schemars(transform = by(MOTOR_SPEED))]
    pub motor_max_speed_rad_s: [f64; 4],
    /// Viscous friction of the joint, N m s/rad and N s/m.
    #[schemars(transform = by(ANY_NOT_NEGATIVE))]
    pub viscous: [f64; 4],
    /// Coulomb friction of the joint, N m and N.
    #[schemars(transform = by(ANY_NOT_NEGATIVE))]
    pub coulomb: [f64; 4],
    /// Speed over which Coulomb friction builds up as tanh(qd / eps), rad/s and m/s.
    #[schemars(transform = by(ANY_POSITIVE))]
    pub coulomb_tanh_eps: [f64; 4],
    /// Whole counts per turn of the motor. The range of every axis, twice, has to fit into 32 bits. With few, the
    /// controller lowers its gains, or a run is refused.
    #[schemars(range(min = FEWEST_COUNTS, max = i32::MAX))]
    pub encoder_counts_per_motor_rev: u32,
}

/// A body held at the flange: JSON, in SI units. The flange frame's z points down. An unknown key is refused.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields, transform = Unused(UNUSED))]
pub struct PayloadFile {
    /// Mass.
    #[schemars(transform = by(PAYLOAD_MASS))]
    pub mass: f64,
    /// Centre of mass in the flange frame.
    #[schemars(transform = by(PAYLOAD_COM))]
    pub com_flange_frame: [f64; 3],
    /// Principal moments of inertia about the centre of mass, along the flange frame. None is greater than the sum of the
    /// other two.
    #[schemars(transform = by(PAYLOAD_INERTIA))]
    pub inertia_com_diag: [f64; 3],
}

/// The keys of an object.
pub(super) fn keys<T: JsonSchema>() -> Vec<String> {
    let schema = SchemaGenerator::default().into_root_schema_for::<T>();
    let properties = schema.get("properties").and_then(|value| value.as_object());
    properties
        .into_iter()
        .flat_map(|properties| properties.keys().cloned())
        .collect()
}
