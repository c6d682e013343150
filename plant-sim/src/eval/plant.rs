//! The formulas of the simulated robot.

use super::cell::{Cell, Reach, ik_cells};
use super::{Posture, Side};
use nalgebra::Vector4;
use sim::model::{Geometry, Payload, RobotModel};
use sim::plant::arm::Arm;
use sim::plant::drive::Drive;
use sim::plant::kinematics::{Pose, Unreachable, Violation, inverse};

pub(super) struct PlantSide {
    model: RobotModel,
    arm: Arm,
    drive: Drive,
}

impl PlantSide {
    pub(super) fn new(model: &RobotModel, payload: Option<&Payload>) -> Self {
        Self {
            arm: Arm::new(model, payload),
            drive: Drive::new(&model.drive),
            model: model.clone(),
        }
    }
}

/// Error of theta2 (rad) for an error of the radius in its last bits: 2e-15 / |theta2| towards the stretched arm, at
/// most the root of 2e-15; elsewhere the plant guarantees 1e-9.
fn theta2_tolerance(theta2: f64) -> f64 {
    (2e-15 / theta2.abs()).clamp(1e-9, 5e-8)
}

impl Side for PlantSide {
    fn largest(&self) -> f64 {
        f64::MAX
    }

    fn kinematics(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vec<Cell> {
        let at = self.arm.at(q);
        let Pose { x, y, z, yaw } = self.arm.pose(&at);
        // nalgebra iterates down the columns, but the table is by rows.
        let rotation = self.arm.flange(&at).1.transpose();
        let jacobian = self.arm.jacobian(&at).transpose();
        [x, y, z, yaw]
            .iter()
            .chain(rotation.iter())
            .chain(jacobian.iter())
            .chain(self.arm.twist(&at, qd).iter())
            .chain(self.arm.jacobian_rate_times(&at, qd).iter())
            .map(|&x| x.into())
            .collect()
    }

    fn ik(&self, pose: &Vector4<f64>, posture: Posture) -> Vec<Cell> {
        let pose = Pose {
            x: pose.x,
            y: pose.y,
            z: pose.z,
            yaw: pose.w,
        };
        let Geometry { a1, a2, .. } = self.model.geometry;
        match inverse(&self.model.geometry, &self.model.limits, &pose) {
            Ok(solutions) => {
                let theta2 = solutions[0].q[1];
                let solutions = solutions.map(|solution| {
                    let it = match posture.turn {
                        None => solution,
                        turn => solution.in_turn(&self.model.limits, turn),
                    };
                    (it.q, it.violation.map_or(Reach::Ok, Reach::from))
                });
                ik_cells(
                    solutions,
                    posture.elbow,
                    a1 * a2 * libm::sin(theta2),
                    theta2_tolerance(theta2),
                )
            }
            Err(unreachable) => ik_cells(
                [(Vector4::repeat(f64::NAN), unreachable.into()); 2],
                posture.elbow,
                f64::NAN,
                f64::NAN,
            ),
        }
    }

    fn dynamics(&self, q: &Vector4<f64>, qd: &Vector4<f64>, qdd: &Vector4<f64>) -> Vec<Cell> {
        let at = self.arm.at(q);
        let tau = self.arm.inverse_dynamics(&at, qd, qdd);
        let mass = self.arm.mass_matrix(&at);
        tau.iter()
            .chain(mass.transpose().iter())
            .chain(self.arm.bias(&at, qd).iter())
            .chain(self.arm.gravity(&at).iter())
            .map(|&x| x.into())
            .collect()
    }

    fn actuation(&self, q: &Vector4<f64>, qd: &Vector4<f64>, qdd: &Vector4<f64>) -> Vec<Cell> {
        let link = self.arm.inverse_dynamics(&self.arm.at(q), qd, qdd);
        let rotor = self.drive.rotor_inertia() * qdd;
        let friction = self.drive.friction(qd);
        let total = link + rotor + friction;
        let motor = self.drive.motor_torque(&total);
        [
            link,
            rotor,
            friction,
            total,
            motor,
            self.drive.to_motor(q),
            self.drive.to_motor(qd),
        ]
        .iter()
        .flat_map(|four| four.iter().map(|&x| x.into()))
        .collect()
    }
}

impl From<Unreachable> for Reach {
    fn from(unreachable: Unreachable) -> Self {
        match unreachable {
            Unreachable::TooFar => Self::TooFar,
            Unreachable::InsideHole => Self::InsideHole,
        }
    }
}

impl From<Violation> for Reach {
    fn from(violation: Violation) -> Self {
        match violation {
            Violation::Elbow => Self::Joint2Limit,
            Violation::Shoulder => Self::Joint1Limit,
            Violation::TooHigh => Self::ZHigh,
            Violation::TooLow => Self::ZLow,
            Violation::Wrist => Self::Joint4Limit,
        }
    }
}
