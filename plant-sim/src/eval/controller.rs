//! The formulas of the controller, in its own precision.

use std::f32::consts::TAU;

use super::cell::{Cell, Reach, ik_cells};
use super::{EvalError, Posture, Side};
use firmware::mechanics::arm::{ArmModel, Axis, Payload};
use firmware::mechanics::dynamics::drive::Drive;
use firmware::mechanics::dynamics::lagrange::Lagrange;
use firmware::mechanics::dynamics::newton_euler;
use firmware::mechanics::jacobian::Jacobian;
use firmware::mechanics::kinematics::{
    Elbow, IkError, Pose, Trig, Wrist, forward_with, locate, rotation, solve,
};
use nalgebra::{Matrix4, Vector4, Vector6};
use sim::model::{self, RobotModel};

pub(super) struct Controller {
    method: Method,
    arm: ArmModel,
    payload: Payload,
    drive: Drive,
}

enum Method {
    Lagrange(Lagrange),
    NewtonEuler,
}

impl Controller {
    pub(super) fn lagrange(
        model: &RobotModel,
        payload: Option<&model::Payload>,
    ) -> Result<Self, EvalError> {
        Self::new(model, payload, |arm, payload| {
            Method::Lagrange(Lagrange::new(arm, payload))
        })
    }

    pub(super) fn newton_euler(
        model: &RobotModel,
        payload: Option<&model::Payload>,
    ) -> Result<Self, EvalError> {
        Self::new(model, payload, |_, _| Method::NewtonEuler)
    }

    fn new(
        model: &RobotModel,
        payload: Option<&model::Payload>,
        method: impl Fn(&ArmModel, &Payload) -> Method,
    ) -> Result<Self, EvalError> {
        let arm = ArmModel::from(model);
        arm.validate().map_err(EvalError::Model)?;
        let payload = payload.map_or(Payload::NONE, Payload::from);
        Ok(Self {
            method: method(&arm, &payload),
            drive: Drive::new(&arm.drive),
            arm,
            payload,
        })
    }

    fn efforts(&self, q: &Vector4<f32>, qd: &Vector4<f32>, qdd: &Vector4<f32>) -> Vector4<f32> {
        match &self.method {
            Method::NewtonEuler => newton_euler::inverse(&self.arm, &self.payload, q, qd, qdd),
            Method::Lagrange(lagrange) => lagrange.inverse(&Trig::new(q), qd, qdd),
        }
    }

    fn mass_matrix(&self, q: &Vector4<f32>) -> Matrix4<f32> {
        match &self.method {
            Method::NewtonEuler => newton_euler::mass_matrix(&self.arm, &self.payload, q),
            Method::Lagrange(lagrange) => lagrange.mass_matrix(&Trig::new(q)),
        }
    }

    fn gravity(&self, q: &Vector4<f32>) -> Vector4<f32> {
        match &self.method {
            Method::NewtonEuler => newton_euler::gravity(&self.arm, &self.payload, q),
            Method::Lagrange(lagrange) => lagrange.gravity(),
        }
    }

    fn coriolis(&self, q: &Vector4<f32>, qd: &Vector4<f32>) -> Vector4<f32> {
        match &self.method {
            Method::NewtonEuler => newton_euler::bias(&self.arm, &self.payload, q, qd),
            Method::Lagrange(lagrange) => lagrange.bias(&Trig::new(q), qd),
        }
    }

    /// The solution in its turn, compared with the limits but not clamped to them.
    fn solution(&self, pose: &Pose, elbow: Elbow, turn: Option<i8>) -> (Vector4<f32>, Reach) {
        let wrist = turn.map_or(Wrist::Near(0.0), Wrist::Turn);
        let found = locate(&self.arm, pose, elbow, wrist);
        let mut q = solve(&self.arm.geometry, pose, elbow).unwrap_or(Vector4::repeat(f32::NAN));
        q.w += TAU * f32::from(turn.unwrap_or(0));
        (q, found.map_or_else(Reach::from, |_| Reach::Ok))
    }
}

fn single(vector: &Vector4<f64>) -> Vector4<f32> {
    vector.map(|x| x as f32)
}

/// Like that of the plant, with the last bit of an f32, 2^29 times as large; elsewhere some roundings of pi.
fn theta2_tolerance(theta2: f32) -> f32 {
    (1e-6 / theta2.abs()).clamp(2e-6, 1.2e-3)
}

impl Side for Controller {
    fn largest(&self) -> f64 {
        f64::from(f32::MAX)
    }

    fn kinematics(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vec<Cell> {
        let (q, qd) = (single(q), single(qd));
        let trig = Trig::new(&q);
        let Pose { x, y, z, yaw } = forward_with(&self.arm.geometry, &trig, &q);
        let jacobian = Jacobian::new(&self.arm.geometry, &trig);
        let acceleration = jacobian.bias(&qd);
        // A SCARA's flange does not tilt: wx, wy and their rates are zero.
        let acceleration = Vector6::new(
            acceleration.x,
            acceleration.y,
            acceleration.z,
            0.0,
            0.0,
            acceleration.w,
        );
        let geometric = jacobian.geometric();
        [x, y, z, yaw]
            .iter()
            .chain(rotation(&trig).transpose().iter())
            .chain(geometric.transpose().iter())
            .chain((geometric * qd).iter())
            .chain(acceleration.iter())
            .map(|&x| x.into())
            .collect()
    }

    fn ik(&self, pose: &Vector4<f64>, posture: Posture) -> Vec<Cell> {
        let pose = single(pose);
        let pose = Pose {
            x: pose.x,
            y: pose.y,
            z: pose.z,
            yaw: pose.w,
        };
        let solutions = [Elbow::Positive, Elbow::Negative]
            .map(|elbow| self.solution(&pose, elbow, posture.turn));
        let a = solutions[0].0;
        let determinant = Jacobian::new(&self.arm.geometry, &Trig::new(&a)).determinant();
        ik_cells(solutions, posture.elbow, determinant, theta2_tolerance(a.y))
    }

    fn dynamics(&self, q: &Vector4<f64>, qd: &Vector4<f64>, qdd: &Vector4<f64>) -> Vec<Cell> {
        let (q, qd, qdd) = (single(q), single(qd), single(qdd));
        let gravity = self.gravity(&q);
        self.efforts(&q, &qd, &qdd)
            .iter()
            .chain(self.mass_matrix(&q).transpose().iter())
            .chain((self.coriolis(&q, &qd) + gravity).iter())
            .chain(gravity.iter())
            .map(|&x| x.into())
            .collect()
    }

    fn actuation(&self, q: &Vector4<f64>, qd: &Vector4<f64>, qdd: &Vector4<f64>) -> Vec<Cell> {
        let (q, qd, qdd) = (single(q), single(qd), single(qdd));
        let link = self.efforts(&q, &qd, &qdd);
        let rotor = self.drive.rotor_inertia() * qdd;
        let friction = self.drive.friction(&qd);
        let total = link + rotor + friction;
        let motor = self.drive.motor_torque(&total);
        [
            link,
            rotor,
            friction,
            total,
            motor,
            self.drive.motor_angle(&q),
            self.drive.motor_speed(&qd),
        ]
        .iter()
        .flat_map(|four| four.iter().map(|&x| x.into()))
        .collect()
    }
}

impl From<IkError> for Reach {
    fn from(error: IkError) -> Self {
        match error {
            // Inputs are finite; a radius that overflows is too far.
            IkError::TooFar { .. } | IkError::NotFinite => Self::TooFar,
            IkError::TooNear { .. } => Self::InsideHole,
            IkError::Limit { axis, value, limit } => match axis {
                Axis::Shoulder => Self::Joint1Limit,
                Axis::Elbow => Self::Joint2Limit,
                Axis::Lift if value < limit => Self::ZHigh,
                Axis::Lift => Self::ZLow,
                Axis::Wrist => Self::Joint4Limit,
            },
        }
    }
}
