//! The arm as the controller believes it to be: links, payload, rotors and friction together.

use core::f32::consts::FRAC_PI_2;

use nalgebra::{Vector3, Vector4, Vector5};

use crate::mechanics::arm::{ArmModel, Payload};
use crate::mechanics::dynamics::drive::Drive;
use crate::mechanics::dynamics::lagrange::{Couplings, Lagrange};
use crate::mechanics::kinematics::Trig;

/// Torques of the four joints (N m, lift N) and of the motor of the wrist (N m), which carries part of the lift's force, too.
pub type Torques = Vector5<f32>;

/// Share of the torque that a plan may use. The rest is for feedback control: payload and friction are never known
/// exactly, and a saturated axis leaves the path.
pub const TORQUE_SHARE: f32 = 0.95;

/// Everything that depends on the payload, lumped once instead of in every tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Body {
    /// Rigid links with payload, and the rotors of shoulder and lift, which only add to coefficients of theirs.
    pub lagrange: Lagrange,
    /// Motors, gears, coupling and friction.
    pub drive: Drive,
    /// Greatest torques (N m, lift N): of the joints, as they and the motors that turn one joint each allow, and of the motor of the
    /// wrist.
    pub torque_limit: Torques,
    /// What a plan may use of them.
    pub planned_torque: Torques,
    /// How fast they change at the most (N m/s, lift N/s).
    pub torque_rate: Torques,
    /// What is left of the rotor inertia seen at the joints, A^T Jm A: of the elbow, of the wrist (kg m^2), and between lift and wrist
    /// (kg m).
    rotor: Vector3<f32>,
    /// Inertia of each axis by itself with the elbow at a right angle, for laws without a model.
    pub nominal_inertia: Vector4<f32>,
}

impl Body {
    /// The arm carrying `payload`.
    pub fn new(arm: &ArmModel, payload: &Payload) -> Self {
        let drive = Drive::new(&arm.drive);
        let mut motors = drive.own_torque(&arm.drive.motor_torque_limit).abs();
        motors.w = f32::MAX;
        let joint = arm.limits.effort.inf(&motors);
        let wrist = arm.drive.motor_torque_limit.w;
        let torque_limit = Torques::new(joint.x, joint.y, joint.z, joint.w, wrist);
        let rotor = drive.rotor_inertia();
        let rise = &arm.limits.effort_rise_time;
        let mut body = Self {
            lagrange: Lagrange::new(arm, payload).with_rotors(rotor.m11, rotor.m33),
            drive,
            torque_limit,
            planned_torque: torque_limit * TORQUE_SHARE,
            torque_rate: Torques::new(
                torque_limit.x / rise.x,
                torque_limit.y / rise.y,
                torque_limit.z / rise.z,
                torque_limit.w / rise.w,
                torque_limit.a / rise.w,
            ),
            rotor: Vector3::new(rotor.m22, rotor.m44, rotor.m34),
            nominal_inertia: Vector4::zeros(),
        };
        let square = Trig::new(&Vector4::new(0.0, FRAC_PI_2, 0.0, 0.0));
        body.nominal_inertia = body.own_inertia(&square);
        body
    }

    /// Inertia of each axis by itself, rotors included: the diagonal of the inertia matrix, kg m^2, lift kg.
    pub fn own_inertia(&self, trig: &Trig) -> Vector4<f32> {
        self.lagrange.mass_matrix(trig).diagonal()
            + Vector4::new(0.0, self.rotor.x, 0.0, self.rotor.y)
    }

    /// Joint torque (N m, N m, N, N m) for accelerations alone: the inertia matrix, rotors included, times `qdd`.
    pub fn inertial(&self, couplings: &Couplings, qdd: &Vector4<f32>) -> Vector4<f32> {
        self.with_rotors(self.lagrange.inertial(couplings, qdd), qdd)
    }

    /// Joint torque (N m, N m, N, N m) for a motion without friction: links and rotors.
    pub fn frictionless(
        &self,
        couplings: &Couplings,
        qd: &Vector4<f32>,
        qdd: &Vector4<f32>,
    ) -> Vector4<f32> {
        self.with_rotors(self.lagrange.inverse_with(couplings, qd, qdd), qdd)
    }

    /// Joint torque (N m, N m, N, N m) for a motion: links, rotors and friction.
    pub fn inverse(&self, trig: &Trig, qd: &Vector4<f32>, qdd: &Vector4<f32>) -> Vector4<f32> {
        self.frictionless(&self.lagrange.couplings(trig), qd, qdd) + self.drive.friction(qd)
    }

    fn with_rotors(&self, mut torque: Vector4<f32>, qdd: &Vector4<f32>) -> Vector4<f32> {
        torque.y += self.rotor.x * qdd.y;
        torque.z += self.rotor.z * qdd.w;
        torque.w += self.rotor.z * qdd.z + self.rotor.y * qdd.w;
        torque
    }
}
