//! Drive train: gears, ball-screw spline, rotor inertia, friction.
//!
//! Motor angles follow joint positions through a constant matrix, `phi = A q`:
//!
//! ```text
//! phi1 = N1 theta1      phi3 = N3 (k d3 + hand theta4)      k = 2 pi / lead
//! phi2 = N2 theta2      phi4 = N4 theta4
//! ```
//!
//! A ball-screw spline is two nuts on one shaft. Turning the spline nut turns the shaft, which then also screws through the
//! ball nut unless motor 3 follows: hence the coupling of lift and wrist. Torques go the other way through the
//! transpose, `tau_joint = A^T tau_motor`, and rotor inertia Jm appears at the joints as `A^T Jm A`.
//!
//! Rotors are assumed to spin about their own axes only; the contribution of the turning arm is of the order 1/N.

use core::f32::consts::TAU;

use nalgebra::{Matrix4, Vector4};

use crate::mechanics::arm::DriveTrain;
use crate::mechanics::math::{clamp, tanh};

/// A drive train in the coefficients that conversions need.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Diagonal of A: motor radians per joint unit (rad/rad, lift rad/m).
    ratio: Vector4<f32>,
    /// Motor 3 radians per radian of the wrist.
    coupling: f32,
    /// Rotor inertia (kg m^2, motor side).
    rotor: Vector4<f32>,
    viscous: Vector4<f32>,
    coulomb: Vector4<f32>,
    /// Reciprocal of the model's `coulomb_eps`.
    per_eps: Vector4<f32>,
    /// Motor angle of one encoder count (rad).
    count: f32,
}

impl Drive {
    /// Prepares the conversions for `train`.
    #[must_use]
    pub fn new(train: &DriveTrain) -> Self {
        let gear = train.gear_ratio;
        Self {
            ratio: Vector4::new(gear.x, gear.y, gear.z * (TAU / train.screw_lead), gear.w),
            coupling: gear.z * train.screw_hand,
            rotor: train.rotor_inertia,
            viscous: train.viscous,
            coulomb: train.coulomb,
            per_eps: train.coulomb_eps.map(|eps| 1.0 / eps),
            count: TAU / train.encoder_counts as f32,
        }
    }

    /// Motor angles `A q` (rad) at joint position `q`. The map is linear and also holds for speeds and accelerations.
    #[must_use]
    pub fn motor_angle(&self, q: &Vector4<f32>) -> Vector4<f32> {
        let mut phi = self.ratio.component_mul(q);
        phi.z += self.coupling * q.w;
        phi
    }

    /// Joint position for motor angles `phi` (rad): the inverse of [`Drive::motor_angle`].
    #[must_use]
    pub fn joint_angle(&self, phi: &Vector4<f32>) -> Vector4<f32> {
        let wrist = phi.w / self.ratio.w;
        Vector4::new(
            phi.x / self.ratio.x,
            phi.y / self.ratio.y,
            (phi.z - self.coupling * wrist) / self.ratio.z,
            wrist,
        )
    }

    /// Motor speeds (rad/s) at joint speeds `qd`.
    #[must_use]
    pub fn motor_speed(&self, qd: &Vector4<f32>) -> Vector4<f32> {
        self.motor_angle(qd)
    }

    /// Joint speeds at motor speeds `speed` (rad/s).
    #[must_use]
    pub fn joint_speed(&self, speed: &Vector4<f32>) -> Vector4<f32> {
        self.joint_angle(speed)
    }

    /// Motor torques `A^-T tau` (N m) for joint efforts `tau`. A lift force loads the wrist motor too.
    #[must_use]
    pub fn motor_torque(&self, tau: &Vector4<f32>) -> Vector4<f32> {
        let lift = tau.z / self.ratio.z;
        Vector4::new(
            tau.x / self.ratio.x,
            tau.y / self.ratio.y,
            lift,
            (tau.w - self.coupling * lift) / self.ratio.w,
        )
    }

    /// Joint efforts (N m, lift N) of motor torques without the coupling: what each axis gets from its own motor.
    #[must_use]
    pub fn own_torque(&self, motor: &Vector4<f32>) -> Vector4<f32> {
        self.ratio.component_mul(motor)
    }

    /// Joint efforts `A^T tau_motor` (N m, lift N) of motor torques: the inverse of [`Drive::motor_torque`].
    #[must_use]
    pub fn joint_torque(&self, motor: &Vector4<f32>) -> Vector4<f32> {
        let mut tau = self.own_torque(motor);
        tau.w += self.coupling * motor.z;
        tau
    }

    /// Inertia of the rotors at the joints, `A^T Jm A`, to add to the mass matrix.
    #[must_use]
    pub fn rotor_inertia(&self) -> Matrix4<f32> {
        let reflected = self.rotor.component_mul(&self.ratio);
        let mut inertia = Matrix4::from_diagonal(&reflected.component_mul(&self.ratio));
        inertia.m44 += self.coupling * self.coupling * self.rotor.z;
        inertia.m34 = self.coupling * reflected.z;
        inertia.m43 = inertia.m34;
        inertia
    }

    /// Friction efforts at joint speeds `qd` (N m, lift N), with the sign of the effort that overcomes them: viscous, and
    /// Coulomb smoothed over the model's `coulomb_eps`.
    #[inline(always)]
    #[must_use]
    pub fn friction(&self, qd: &Vector4<f32>) -> Vector4<f32> {
        let x = qd.component_mul(&self.per_eps);
        let step = Vector4::new(tanh(x.x), tanh(x.y), tanh(x.z), tanh(x.w));
        self.viscous.component_mul(qd) + self.coulomb.component_mul(&step)
    }

    /// Coulomb friction at joint speeds `qd` (N m, lift N) for plans: a straight line replaces the hyperbolic
    /// tangent of [`Drive::friction`], in a third of the time. The two differ by at most a quarter of the friction, and
    /// only near rest, where torque is plentiful.
    #[must_use]
    pub fn coulomb_friction(&self, qd: &Vector4<f32>) -> Vector4<f32> {
        let step = qd.component_mul(&self.per_eps);
        self.coulomb
            .component_mul(&step.map(|x| clamp(x, -1.0, 1.0)))
    }

    /// Motor angles (rad) at encoder readings, counted from the zero of the joints. Relative error at most 3 u.
    #[must_use]
    pub fn motor_angle_of_counts(&self, counts: &[i32; 4]) -> Vector4<f32> {
        Vector4::from(counts.map(|n| n as f32)) * self.count
    }

    /// What each axis by itself moves by in a count of its encoder: rad, rad, m, rad.
    #[must_use]
    pub fn own_count(&self) -> Vector4<f32> {
        Vector4::repeat(self.count).component_div(&self.ratio)
    }

    /// Dry friction of the joints, N m, lift N.
    #[must_use]
    pub fn coulomb(&self) -> &Vector4<f32> {
        &self.coulomb
    }

    /// Encoder readings nearest to motor angles `phi` (rad), saturated to the range; 0 for NaN.
    ///
    /// Not on the control path: for drives in tests, the inverse of [`Drive::motor_angle_of_counts`].
    #[must_use]
    pub fn counts_of_motor_angle(&self, phi: &Vector4<f32>) -> [i32; 4] {
        let nearest = |angle: f32| {
            let counts = angle / self.count;
            (counts + 0.5_f32.copysign(counts)) as i32
        };
        [
            nearest(phi.x),
            nearest(phi.y),
            nearest(phi.z),
            nearest(phi.w),
        ]
    }
}
