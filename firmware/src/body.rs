//! The arm as the controller believes it to be: links, payload, rotors and friction together.

use core::f32::consts::FRAC_PI_2;

use nalgebra::{Matrix4, Vector4};

use crate::arm::{ArmModel, Payload};
use crate::dynamics::drive::Drive;
use crate::dynamics::lagrange::Lagrange;
use crate::kinematics::Trig;

/// Everything that depends on the payload, lumped once so that a tick does not repeat it.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Rigid links with payload.
    pub lagrange: Lagrange,
    /// Motors, gears, coupling and friction.
    pub drive: Drive,
    /// Rotor inertia seen at the joints, A^T Jm A.
    rotor: Matrix4<f32>,
    /// Inertia of each axis by itself at a square elbow: what laws without a model scale with.
    pub nominal_inertia: Vector4<f32>,
}

impl Body {
    /// The arm carrying `payload`.
    pub fn new(arm: &ArmModel, payload: &Payload) -> Self {
        let drive = Drive::new(&arm.drive);
        let mut body = Self {
            lagrange: Lagrange::new(arm, payload),
            drive,
            rotor: drive.rotor_inertia(),
            nominal_inertia: Vector4::zeros(),
        };
        let square = Trig::new(&Vector4::new(0.0, FRAC_PI_2, 0.0, 0.0));
        body.nominal_inertia = body.mass_matrix(&square).diagonal();
        body
    }

    /// Inertia matrix at the joints, rotors included, 4x4.
    pub fn mass_matrix(&self, trig: &Trig) -> Matrix4<f32> {
        let mut mass = self.lagrange.mass_matrix(trig);
        // Rotors couple lift and wrist, nothing else.
        mass.m11 += self.rotor.m11;
        mass.m22 += self.rotor.m22;
        mass.m33 += self.rotor.m33;
        mass.m34 += self.rotor.m34;
        mass.m43 += self.rotor.m43;
        mass.m44 += self.rotor.m44;
        mass
    }

    /// Joint torque (N m, N m, N, N m) for a motion: links, rotors and friction.
    pub fn inverse(&self, trig: &Trig, qd: &Vector4<f32>, qdd: &Vector4<f32>) -> Vector4<f32> {
        self.mass_matrix(trig) * qdd
            + self.lagrange.bias(trig, qd)
            + self.lagrange.gravity()
            + self.drive.friction(qd)
    }
}
