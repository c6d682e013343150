//! Motors, gears, encoders and friction of a model file.

use std::f64::consts::TAU;

use super::super::file::{
    self, ANY_NOT_NEGATIVE, ANY_POSITIVE, FEWEST_COUNTS, GEAR_RATIO, MOTOR_SPEED, MOTOR_TORQUE,
    ROTOR_INERTIA, SCREW_LEAD, keys,
};
use super::super::json::Node;
use super::super::{AXES, DriveTrain, JointLimits, ModelError};
use super::each;
use crate::allowed::Allowed;

pub(super) fn drive(
    node: &Node<'_>,
    limits: &JointLimits,
    warnings: &mut Vec<String>,
) -> Result<DriveTrain, ModelError> {
    node.warn_of_unknown(&keys::<file::Drive>(), warnings);
    let screw_hand = node.number("screw_hand_sign", Allowed::FINITE)?;
    if screw_hand.abs() != 1.0 {
        return Err(node.get("screw_hand_sign", "")?.wrong("1 or -1"));
    }
    let counts = node.number("encoder_counts_per_motor_rev", ANY_POSITIVE)?;
    if counts.fract() != 0.0 || !(f64::from(FEWEST_COUNTS)..=f64::from(i32::MAX)).contains(&counts)
    {
        return Err(node.get("encoder_counts_per_motor_rev", "")?.wrong(format!(
            "a whole number from {FEWEST_COUNTS} to {}",
            i32::MAX
        )));
    }
    let drive = DriveTrain {
        gear_ratio: node.numbers("gear_ratio", GEAR_RATIO)?,
        screw_lead: node.number("ball_screw_lead_m_per_rev", SCREW_LEAD)?,
        screw_hand,
        rotor_inertia: node.numbers("rotor_inertia_motor_side", ROTOR_INERTIA)?,
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
    each(
        node,
        "coulomb_tanh_eps",
        drive.coulomb_eps,
        limits.velocity,
        |eps, speed| {
            (eps > speed).then(|| format!("at most the axis' speed limit, {speed}: it is the speed over which friction builds up"))
        },
    )?;
    check_encoder(node, &drive, limits)?;
    warn_of_efforts(node, &drive, limits, warnings);
    Ok(drive)
}

/// Efforts that do not fit each other: a unit or a power of ten is wrong.
fn warn_of_efforts(
    node: &Node<'_>,
    drive: &DriveTrain,
    limits: &JointLimits,
    warnings: &mut Vec<String>,
) {
    /// Data sheets are rounded.
    const ROUNDING: f64 = 1.05;
    for (axis, name) in AXES.into_iter().enumerate() {
        let lead = if axis == 2 {
            TAU / drive.screw_lead
        } else {
            1.0
        };
        let given = drive.motor_torque_limit[axis] * drive.gear_ratio[axis] * lead;
        let peak = limits.effort[axis];
        if peak > given * ROUNDING {
            warnings.push(format!(
                "joint_limits.effort_peak[{axis}] is {peak}, but the motor of the {name} gives {given:.1} through its gear"
            ));
        }
        let friction = drive.coulomb[axis] + drive.viscous[axis] * limits.velocity[axis];
        if friction > peak {
            warnings.push(format!(
                "{}.viscous[{axis}] and coulomb[{axis}] take {friction:.1} of the {name} at full speed, more than its peak, {peak}",
                node.path()
            ));
        }
    }
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
    for (turns, axis) in turns.iter().zip(AXES) {
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
