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
    /// The diagonal of A; radians of the motor per radian, for the lift per metre.
    ratio: Vector4<f64>,
    /// Its entry beside the lift's: radians that the nut follows per radian of the wrist.
    follow: f64,
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
        let [j1, j2, j3, j4] = train.rotor_inertia;
        #[rustfmt::skip]
        let rotor_inertia = Matrix4::new(
            n1 * n1 * j1, 0.0, 0.0, 0.0,
            0.0, n2 * n2 * j2, 0.0, 0.0,
            0.0, 0.0, nut * nut * j3, nut * follow * j3,
            0.0, 0.0, nut * follow * j3, n4 * n4 * j4 + follow * follow * j3,
        );
        Self {
            train: *train,
            ratio: Vector4::new(n1, n2, nut, n4),
            follow,
            rotor_inertia,
        }
    }

    /// Radians that the motor of `axis` turns per radian of the joint, or per metre of the lift.
    pub(super) fn ratio(&self, axis: usize) -> f64 {
        self.ratio[axis]
    }

    /// Motor angles (rad) for joint positions, or motor speeds (rad/s) for joint speeds.
    pub fn to_motor(&self, q: &Vector4<f64>) -> Vector4<f64> {
        let mut phi = self.ratio.component_mul(q);
        phi[2] += self.follow * q[3];
        phi
    }

    /// Joint positions for motor angles (rad), or joint speeds for motor speeds.
    pub fn to_joint(&self, phi: &Vector4<f64>) -> Vector4<f64> {
        let mut q = phi.component_div(&self.ratio);
        q[2] -= self.follow * q[3] / self.ratio[2];
        q
    }

    /// Joint efforts of the motor torques (N m).
    pub fn joint_effort(&self, motor_torque: &Vector4<f64>) -> Vector4<f64> {
        let mut effort = self.ratio.component_mul(motor_torque);
        effort[3] += self.follow * motor_torque[2];
        effort
    }

    /// Motor torques (N m) for these joint efforts.
    pub fn motor_torque(&self, joint_effort: &Vector4<f64>) -> Vector4<f64> {
        let mut torque = joint_effort.component_div(&self.ratio);
        torque[3] -= self.follow * torque[2] / self.ratio[3];
        torque
    }

    /// `A^T J A`: contribution of the rotors to the mass matrix.
    pub fn rotor_inertia(&self) -> &Matrix4<f64> {
        &self.rotor_inertia
    }

    /// Friction against joint speeds `qd`: `viscous qd + coulomb tanh(qd / eps)`.
    pub fn friction(&self, qd: &Vector4<f64>) -> Vector4<f64> {
        let train = &self.train;
        let coulomb = coulomb(&train.coulomb, &train.coulomb_eps, &(*qd).into());
        Vector4::from_fn(|i, _| train.viscous[i] * qd[i] + coulomb[i])
    }

    /// Friction divided by speed, positive even at rest.
    pub fn friction_secant(&self, qd: &Vector4<f64>) -> Vector4<f64> {
        let train = &self.train;
        let coulomb = coulomb_secant(&train.coulomb, &train.coulomb_eps, &(*qd).into());
        Vector4::from_fn(|i, _| train.viscous[i] + coulomb[i])
    }

    /// Least and greatest torque (N m) that the motor of `axis` can give at `speed` (rad/s).
    ///
    /// The torque limit holds in both directions; above the speed limit a motor can still brake but hardly drive.
    pub fn torque_bounds(&self, axis: usize, speed: f64) -> (f64, f64) {
        let limit = self.train.motor_torque_limit[axis];
        let top = self.train.motor_speed_limit[axis];
        let beyond = speed.abs() - top;
        if beyond <= 0.0 {
            return (-limit, limit);
        }
        let driving = limit * (1.0 - beyond / (SPEED_TAPER * top)).max(0.0);
        if speed > 0.0 {
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

    /// Which of the motors the command `request` (N m) takes to their limit at motor speeds `speed` (rad/s). At the limit to
    /// single precision counts.
    pub fn at_limit(&self, request: &Vector4<f64>, speed: &Vector4<f64>) -> [bool; 4] {
        std::array::from_fn(|i| {
            let (braking, driving) = self.torque_bounds(i, speed[i]);
            let rounding = f64::from(f32::EPSILON) * driving.max(-braking);
            match request[i] {
                up if up > 0.0 => up >= driving - rounding,
                down if down < 0.0 => down <= braking + rounding,
                _ => false,
            }
        })
    }
}
