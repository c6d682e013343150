//! Motors, gears, encoders and friction of a model file.

use std::f64::consts::TAU;

use super::super::json::Node;
use super::super::{DriveTrain, JointLimits, ModelError};
use super::{ANY_NOT_NEGATIVE, ANY_POSITIVE, each};
use crate::allowed::Allowed;

/// Limit of the Command message.
const MOTOR_TORQUE: Allowed = Allowed::above_zero(200.0, "N m");
/// Limit of the Feedback message, less a fifth for a motor driven beyond its limit.
const MOTOR_SPEED: Allowed = Allowed::above_zero(1600.0, "rad/s");
/// One count per sample must not read as full speed.
const FEWEST_COUNTS: f64 = 256.0;
/// Known keys, including those that other programs put into the same object.
const DRIVE: &[&str] = &[
    "gear_ratio",
    "ball_screw_lead_m_per_rev",
    "screw_hand_sign",
    "rotor_inertia_motor_side",
    "motor_torque_limit_model",
    "motor_rated_torque",
    "motor_max_speed_rad_s",
    "viscous",
    "coulomb",
    "coulomb_tanh_eps",
    "encoder_counts_per_motor_rev",
    "comment",
    "motor_peak_torque",
    "motor_rated_power_w",
    "torque_constant_nm_per_arms",
    "efficiency_info_only",
    "encoder_multiturn_bits",
    "gear_stiffness_optional",
    "gear_damping_ratio_optional",
];

pub(super) fn drive(
    node: &Node<'_>,
    limits: &JointLimits,
    warnings: &mut Vec<String>,
) -> Result<DriveTrain, ModelError> {
    node.warn_of_unknown(DRIVE, warnings);
    let screw_hand = node.number("screw_hand_sign", Allowed::FINITE)?;
    if screw_hand.abs() != 1.0 {
        return Err(node.get("screw_hand_sign", "")?.wrong("1 or -1"));
    }
    let counts = node.number("encoder_counts_per_motor_rev", ANY_POSITIVE)?;
    if counts.fract() != 0.0 || !(FEWEST_COUNTS..=f64::from(i32::MAX)).contains(&counts) {
        return Err(node.get("encoder_counts_per_motor_rev", "")?.wrong(format!(
            "a whole number from {FEWEST_COUNTS} to {}",
            i32::MAX
        )));
    }
    let drive = DriveTrain {
        gear_ratio: node.numbers("gear_ratio", Allowed::above_zero(1e4, ""))?,
        screw_lead: node.number("ball_screw_lead_m_per_rev", Allowed::above_zero(1.0, "m"))?,
        screw_hand,
        rotor_inertia: node.numbers("rotor_inertia_motor_side", ANY_NOT_NEGATIVE)?,
        motor_torque_limit: node.numbers("motor_torque_limit_model", MOTOR_TORQUE)?,
        motor_torque_rated: node.numbers("motor_rated_torque", MOTOR_TORQUE)?,
        motor_speed_limit: node.numbers("motor_max_speed_rad_s", MOTOR_SPEED)?,
        viscous: node.numbers("viscous", ANY_NOT_NEGATIVE)?,
        coulomb: node.numbers("coulomb", ANY_NOT_NEGATIVE)?,
        coulomb_eps: node.numbers("coulomb_tanh_eps", ANY_POSITIVE)?,
        encoder_counts: counts as u32,
    };
    each(
        node,
        "motor_rated_torque",
        drive.motor_torque_rated,
        drive.motor_torque_limit,
        |rated, peak| (rated > peak).then(|| format!("at most the motor's limit, {peak} N m")),
    )?;
    check_encoder(node, &drive, limits)?;
    Ok(drive)
}

/// Motor positions are sent as 32-bit counts: these must cover twice the range of every axis.
fn check_encoder(
    node: &Node<'_>,
    drive: &DriveTrain,
    limits: &JointLimits,
) -> Result<(), ModelError> {
    let reach = |axis: usize| limits.lower[axis].abs().max(limits.upper[axis].abs());
    let turns_of_nut = reach(2) / drive.screw_lead + reach(3) / TAU;
    let turns = [
        reach(0) / TAU * drive.gear_ratio[0],
        reach(1) / TAU * drive.gear_ratio[1],
        turns_of_nut * drive.gear_ratio[2],
        reach(3) / TAU * drive.gear_ratio[3],
    ];
    for (turns, axis) in turns.iter().zip(["shoulder", "elbow", "lift", "wrist"]) {
        let most = (f64::from(i32::MAX) / (2.0 * turns)).floor();
        if f64::from(drive.encoder_counts) > most {
            return Err(node
                .get("encoder_counts_per_motor_rev", "")?
                .wrong(format!(
                    "at most {most}: the motor of the {axis} makes {turns:.1} turns to its limit, and its position is sent as 32 bits"
                )));
        }
    }
    Ok(())
}
