//! From the model file, f64, to the controller's model, f32.

use firmware::mechanics::arm::{ArmModel, DriveTrain, Geometry, JointLimits, Link, Payload};
use nalgebra::{Vector3, Vector4};

use crate::model;

fn four(values: [f64; 4]) -> Vector4<f32> {
    Vector4::from(values.map(|x| x as f32))
}

/// A limit that a robot need not have.
fn cap(values: Option<[f64; 4]>) -> Vector4<f32> {
    values.map_or_else(|| Vector4::repeat(JointLimits::NONE), four)
}

fn three(values: [f64; 3]) -> Vector3<f32> {
    Vector3::from(values.map(|x| x as f32))
}

impl From<&model::RobotModel> for ArmModel {
    fn from(robot: &model::RobotModel) -> Self {
        let model::Geometry { a1, a2, d1, d2, d4 } = robot.geometry;
        let limits = &robot.limits;
        let drive = &robot.drive;
        Self {
            geometry: Geometry {
                a1: a1 as f32,
                a2: a2 as f32,
                d1: (d1 + d2) as f32,
                d4: d4 as f32,
            },
            links: robot.links.map(|link| Link {
                mass: link.mass as f32,
                com: three(link.com),
                inertia: three(link.inertia),
            }),
            gravity: robot.gravity as f32,
            limits: JointLimits {
                lower: four(limits.lower),
                upper: four(limits.upper),
                velocity: four(limits.velocity),
                acceleration: cap(limits.acceleration),
                jerk: cap(limits.jerk),
                effort: four(limits.effort),
                effort_rise_time: four(limits.effort_rise_time),
                effort_continuous: four(limits.effort_continuous),
            },
            drive: DriveTrain {
                gear_ratio: four(drive.gear_ratio),
                screw_lead: drive.screw_lead as f32,
                screw_hand: drive.screw_hand as f32,
                rotor_inertia: four(drive.rotor_inertia),
                motor_torque_limit: four(drive.motor_torque_limit),
                motor_torque_rated: four(drive.motor_torque_rated),
                motor_speed_limit: four(drive.motor_speed_limit),
                viscous: four(drive.viscous),
                coulomb: four(drive.coulomb),
                coulomb_eps: four(drive.coulomb_eps),
                encoder_counts: drive.encoder_counts,
            },
            payload_max: robot.payload_max as f32,
        }
    }
}

impl From<&model::Payload> for Payload {
    fn from(payload: &model::Payload) -> Self {
        Self {
            mass: payload.mass as f32,
            com: three(payload.com),
            inertia: three(payload.inertia),
        }
    }
}
