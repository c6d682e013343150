//! Motors, gears, the screw-spline coupling and friction.
//!
//! Motor angles are `phi = A q`. A is diagonal but for the shaft: the nut of the ball screw must follow a turn of the
//! spline (axis 4), or the shaft would screw itself up or down. By virtual work `tau_joint = A^T tau_motor`, and the
//! rotors appear in the joint space as `A^T J A`.

use super::friction::{coulomb, coulomb_secant};
use crate::model::DriveTrain;
use nalgebra::{Matrix4, Vector4};
use std::f64::consts::TAU;

/// The four motors with their transmissions.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    train: DriveTrain,
    coupling: Matrix4<f64>,
    coupling_inverse: Matrix4<f64>,
    rotor_inertia: Matrix4<f64>,
}

/// Above its speed limit a motor's torque falls to zero over this fraction of the limit. On a real drive that depends
/// on the remaining voltage; below the limit the published torque is always available. An estimate that only
/// affects runs beyond the speed limit: a jump instead of a slope would make the integration depend on where its steps
/// fall.
const SPEED_TAPER: f64 = 0.05;

impl Drive {
    /// The drives of a robot.
    pub fn new(train: &DriveTrain) -> Self {
        let [n1, n2, n3, n4] = train.gear_ratio;
        let nut = n3 * TAU / train.screw_lead;
        let follow = n3 * train.screw_hand;
        #[rustfmt::skip]
        let coupling = Matrix4::new(
            n1, 0.0, 0.0, 0.0,
            0.0, n2, 0.0, 0.0,
            0.0, 0.0, nut, follow,
            0.0, 0.0, 0.0, n4,
        );
        #[rustfmt::skip]
        let coupling_inverse = Matrix4::new(
            1.0 / n1, 0.0, 0.0, 0.0,
            0.0, 1.0 / n2, 0.0, 0.0,
            0.0, 0.0, 1.0 / nut, -follow / (nut * n4),
            0.0, 0.0, 0.0, 1.0 / n4,
        );
        let rotors = Matrix4::from_diagonal(&train.rotor_inertia.into());
        Self {
            train: *train,
            coupling,
            coupling_inverse,
            rotor_inertia: coupling.transpose() * rotors * coupling,
        }
    }

    /// Motor angles (rad) for joint positions, or motor speeds (rad/s) for joint speeds.
    pub fn to_motor(&self, q: &Vector4<f64>) -> Vector4<f64> {
        self.coupling * q
    }

    /// Joint positions for motor angles (rad), or joint speeds for motor speeds.
    pub fn to_joint(&self, phi: &Vector4<f64>) -> Vector4<f64> {
        self.coupling_inverse * phi
    }

    /// Joint efforts of the motor torques (N m).
    pub fn joint_effort(&self, motor_torque: &Vector4<f64>) -> Vector4<f64> {
        self.coupling.tr_mul(motor_torque)
    }

    /// Motor torques (N m) for these joint efforts.
    pub fn motor_torque(&self, joint_effort: &Vector4<f64>) -> Vector4<f64> {
        self.coupling_inverse.tr_mul(joint_effort)
    }

    /// `A^T J A`: contribution of the rotors to the mass matrix.
    pub fn rotor_inertia(&self) -> &Matrix4<f64> {
        &self.rotor_inertia
    }

    /// Friction against joint speeds `qd`: `viscous qd + coulomb tanh(qd / eps)`.
    pub fn friction(&self, qd: &Vector4<f64>) -> Vector4<f64> {
        let train = &self.train;
        Vector4::from_fn(|i, _| {
            train.viscous[i] * qd[i] + coulomb(train.coulomb[i], train.coulomb_eps[i], qd[i])
        })
    }

    /// Friction divided by speed, positive even at rest.
    pub fn friction_secant(&self, qd: &Vector4<f64>) -> Vector4<f64> {
        let train = &self.train;
        Vector4::from_fn(|i, _| {
            train.viscous[i] + coulomb_secant(train.coulomb[i], train.coulomb_eps[i], qd[i])
        })
    }

    /// Least and greatest torque (N m) that the motor of `axis` can give at `speed` (rad/s).
    ///
    /// The torque limit holds in both directions; above the speed limit a motor can still brake but hardly drive.
    pub fn torque_bounds(&self, axis: usize, speed: f64) -> (f64, f64) {
        let limit = self.train.motor_torque_limit[axis];
        let top = self.train.motor_speed_limit[axis];
        let driving = limit * (1.0 - (speed.abs() - top) / (SPEED_TAPER * top)).clamp(0.0, 1.0);
        if speed >= 0.0 {
            (-limit, driving)
        } else {
            (-driving, limit)
        }
    }

    /// The torques (N m) that the motors give for the command `request` at motor speeds `speed` (rad/s).
    pub fn limited(&self, request: &Vector4<f64>, speed: &Vector4<f64>) -> Vector4<f64> {
        Vector4::from_fn(|i, _| {
            let (least, greatest) = self.torque_bounds(i, speed[i]);
            request[i].clamp(least, greatest)
        })
    }
}
