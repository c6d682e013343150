//! Closed-form dynamics by Lagrange's equations.
//!
//! Seen from above, a SCARA is a chain of three bodies in a plane: arm 1, arm 2 with the lift carriage, and the shaft
//! with the tool. Written in their *absolute* turning rates `w1 = theta1'`, `w2 = theta1' + theta2'`, `w4 = theta1' +
//! theta2' - theta4'`, the kinetic energy has constant coefficients on the squares, and one coupling for each pair that
//! depends on the angle between the two bodies alone:
//!
//! ```text
//! 2 T = A w1^2 + B w2^2 + G w4^2 + 2 k12 w1 w2 + 2 k14 w1 w4 + 2 k24 w2 w4 + m d3'^2
//! ```
//!
//! With `d` the derivative of a coupling with respect to its angle, Lagrange's equations in these rates have two
//! centrifugal terms each and nothing else:
//!
//! ```text
//! f1 = A w1' + k12 w2' + k14 w4' + d12 w2^2 + d14 w4^2
//! f2 = k12 w1' + B w2' + k24 w4' - d12 w1^2 + d24 w4^2
//! f4 = k14 w1' + k24 w2' + G w4' - d14 w1^2 - d24 w2^2
//! ```
//!
//! and `tau1 = f1 + f2 + f4`, `tau2 = f2 + f4`, `tau4 = -f4` map the efforts back to the joints. Gravity acts along the
//! lift alone. Every body, including the payload, may have its centre of mass off its axis.
//!
//! The paper's eq. 40 to 43 describe a vertical arm of three revolute joints and are not used.
//!
//! # Accuracy
//!
//! Take the equations above with every coefficient, sine, cosine, speed and acceleration replaced by its magnitude (sine
//! and cosine by 1) and every minus by a plus. The error of an effort is at most 32 u times the resulting value:
//! a lumped coefficient carries at most 10 roundings, sine and cosine of a difference of angles 2.5 u four times and
//! two roundings (9 u, as a fraction of 1: see [`Trig`]), the square of an absolute rate 5, and the sums 8.
//! This is for exact inputs; an angle error of e adds e times the same value.

use nalgebra::{Matrix4, Vector3, Vector4};

use crate::mechanics::arm::{ArmModel, Payload};
use crate::mechanics::kinematics::Trig;

/// The dynamics of one arm with one payload, in the lumped coefficients of the equations. Rebuild it when the
/// payload changes; that is cheap, but not meant for every tick.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub struct Lagrange {
    /// A, B, G: inertia about their own axes of arm 1, arm 2 and tool, each with the mass carried at its end (kg m^2).
    inertia: Vector3<f32>,
    /// Coefficients of cos and of sin in k12(theta2).
    arm1_arm2: Coupling,
    /// Coefficients in k14(theta2 - theta4).
    arm1_tool: Coupling,
    /// Coefficients in k24(-theta4).
    arm2_tool: Coupling,
    /// Mass that moves with the lift, rotors included (kg).
    lift_mass: f32,
    /// Weight on the lift (N).
    weight: f32,
}

/// Inertial coupling of two bodies, `k(angle) = x cos - y sin` (kg m^2): length of the inner body times the first
/// moment of mass (x, y) of the outer one, rotated by the angle between them.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
struct Coupling {
    x: f32,
    y: f32,
}

impl Coupling {
    /// The coupling and its derivative with respect to the angle.
    fn at(&self, sin: f32, cos: f32) -> (f32, f32) {
        (self.x * cos - self.y * sin, -self.x * sin - self.y * cos)
    }
}

/// The couplings at one position, and their derivatives (kg m^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Couplings {
    k12: f32,
    k14: f32,
    k24: f32,
    d12: f32,
    d14: f32,
    d24: f32,
}

impl Couplings {
    /// Coriolis and centrifugal efforts C qd (N m, lift N).
    #[must_use]
    pub fn bias(&self, qd: &Vector4<f32>) -> Vector4<f32> {
        joint_efforts(&self.centrifugal(&absolute_rates(qd)), 0.0)
    }

    /// Gradient of the kinetic energy with respect to q (N m, lift N), which is C^T qd: the rate of the momentum `M qd`
    /// that no effort causes. Zero for the shoulder, since no inertia depends on it.
    #[must_use]
    pub fn kinetic_gradient(&self, qd: &Vector4<f32>) -> Vector4<f32> {
        let w = absolute_rates(qd);
        let arms = self.d12 * w.x * w.y;
        let arm1_tool = self.d14 * w.x * w.z;
        let arm2_tool = self.d24 * w.y * w.z;
        Vector4::new(0.0, arms + arm1_tool, 0.0, -(arm1_tool + arm2_tool))
    }

    /// Centrifugal terms of the three equations in absolute rates (arm 1, arm 2, tool).
    fn centrifugal(&self, w: &Vector3<f32>) -> Vector3<f32> {
        let Self { d12, d14, d24, .. } = *self;
        let squared = w.component_mul(w);
        Vector3::new(
            d12 * squared.y + d14 * squared.z,
            d24 * squared.z - d12 * squared.x,
            -d14 * squared.x - d24 * squared.y,
        )
    }
}

impl Lagrange {
    /// Lumps the links of `arm` and `payload`.
    #[must_use]
    pub fn new(arm: &ArmModel, payload: &Payload) -> Self {
        let (a1, a2) = (arm.geometry.a1, arm.geometry.a2);
        let [arm1, arm2, carriage, shaft] = &arm.links;

        // Frames 3 and 4 have y reversed relative to the frame of arm 2 with z up.
        let (tool_x, tool_y) = (
            shaft.mass * shaft.com.x + payload.mass * payload.com.x,
            -(shaft.mass * shaft.com.y + payload.mass * payload.com.y),
        );
        let carriage_x = a2 + carriage.com.x;
        let tool_mass = shaft.mass + payload.mass;
        let lift_mass = carriage.mass + tool_mass;

        let square = |x: f32, y: f32| x * x + y * y;
        let inertia = Vector3::new(
            arm1.inertia.z
                + arm1.mass * square(arm1.com.x, arm1.com.y)
                + (arm2.mass + lift_mass) * (a1 * a1),
            arm2.inertia.z
                + arm2.mass * square(arm2.com.x, arm2.com.y)
                + carriage.inertia.z
                + carriage.mass * square(carriage_x, carriage.com.y)
                + tool_mass * (a2 * a2),
            shaft.inertia.z
                + shaft.mass * square(shaft.com.x, shaft.com.y)
                + payload.inertia.z
                + payload.mass * square(payload.com.x, payload.com.y),
        );
        Self {
            inertia,
            arm1_arm2: Coupling {
                x: a1 * (arm2.mass * arm2.com.x + carriage.mass * carriage_x + tool_mass * a2),
                y: a1 * (arm2.mass * arm2.com.y - carriage.mass * carriage.com.y),
            },
            arm1_tool: Coupling {
                x: a1 * tool_x,
                y: a1 * tool_y,
            },
            arm2_tool: Coupling {
                x: a2 * tool_x,
                y: a2 * tool_y,
            },
            lift_mass,
            weight: lift_mass * arm.gravity,
        }
    }

    /// Adds inertias that move with the shoulder (kg m^2) or the lift (kg) alone, and weigh nothing.
    #[must_use]
    pub fn with_rotors(mut self, shoulder: f32, lift: f32) -> Self {
        self.inertia.x += shoulder;
        self.lift_mass += lift;
        self
    }

    /// What depends on the position.
    #[must_use]
    pub fn couplings(&self, trig: &Trig) -> Couplings {
        let (k12, d12) = self.arm1_arm2.at(trig.s2, trig.c2);
        let sin = trig.s2 * trig.c4 - trig.c2 * trig.s4;
        let cos = trig.c2 * trig.c4 + trig.s2 * trig.s4;
        let (k14, d14) = self.arm1_tool.at(sin, cos);
        let (k24, d24) = self.arm2_tool.at(-trig.s4, trig.c4);
        Couplings {
            k12,
            k14,
            k24,
            d12,
            d14,
            d24,
        }
    }

    /// Mass matrix M (kg m^2, kg in the third diagonal element): symmetric, positive definite.
    #[must_use]
    pub fn mass_matrix(&self, trig: &Trig) -> Matrix4<f32> {
        let Couplings { k12, k14, k24, .. } = self.couplings(trig);
        let (a, b, g) = (self.inertia.x, self.inertia.y, self.inertia.z);
        let m44 = g;
        let m24 = -(g + k24);
        let m14 = m24 - k14;
        let m22 = b + k24 - m24;
        let m12 = m22 + k12 + k14;
        let m11 = a + k12 + k14 + m12;
        #[rustfmt::skip]
        let mass = Matrix4::new(
            m11, m12, 0.0, m14,
            m12, m22, 0.0, m24,
            0.0, 0.0, self.lift_mass, 0.0,
            m14, m24, 0.0, m44,
        );
        mass
    }

    /// Coriolis matrix C from Christoffel symbols, so that `M' - 2 C` is skew-symmetric.
    ///
    /// Paper function; not on the control path.
    #[must_use]
    pub fn coriolis(&self, trig: &Trig, qd: &Vector4<f32>) -> Matrix4<f32> {
        let Couplings { d12, d14, d24, .. } = self.couplings(trig);
        let w = absolute_rates(qd);
        // Under a constant change of coordinates S, Christoffel symbols change like the mass matrix: C = S^T C_absolute S.
        let (c12, c14, c24) = (d12 * w.y, d14 * w.z, d24 * w.z);
        let (c21, c41, c42) = (-d12 * w.x, -d14 * w.x, -d24 * w.y);
        let row2 = c21 + c24 + c41 + c42;
        let row1 = c12 + c14;
        #[rustfmt::skip]
        let coriolis = Matrix4::new(
            row1 + row2, row1 + c24 + c42, 0.0, -(c14 + c24),
            row2, c24 + c42, 0.0, -c24,
            0.0, 0.0, 0.0, 0.0,
            -(c41 + c42), -c42, 0.0, 0.0,
        );
        coriolis
    }

    /// Efforts that hold the arm at rest against gravity (N m, lift N): the weight on the lift, upwards.
    #[must_use]
    pub fn gravity(&self) -> Vector4<f32> {
        Vector4::new(0.0, 0.0, -self.weight, 0.0)
    }

    /// Coriolis and centrifugal efforts C qd (N m, lift N).
    #[must_use]
    pub fn bias(&self, trig: &Trig, qd: &Vector4<f32>) -> Vector4<f32> {
        self.couplings(trig).bias(qd)
    }

    /// Inverse dynamics: efforts M qdd + C qd + g for joint accelerations `qdd` (N m, lift N).
    #[must_use]
    pub fn inverse(&self, trig: &Trig, qd: &Vector4<f32>, qdd: &Vector4<f32>) -> Vector4<f32> {
        self.inverse_with(&self.couplings(trig), qd, qdd)
    }

    /// Like [`Lagrange::inverse`], for a caller that already has the couplings.
    #[must_use]
    pub fn inverse_with(
        &self,
        couplings: &Couplings,
        qd: &Vector4<f32>,
        qdd: &Vector4<f32>,
    ) -> Vector4<f32> {
        let planar =
            self.planar_inertial(couplings, qdd) + couplings.centrifugal(&absolute_rates(qd));
        joint_efforts(&planar, self.lift_mass * qdd.z - self.weight)
    }

    /// Inertial efforts M qdd (N m, lift N).
    #[must_use]
    pub fn inertial(&self, couplings: &Couplings, qdd: &Vector4<f32>) -> Vector4<f32> {
        joint_efforts(
            &self.planar_inertial(couplings, qdd),
            self.lift_mass * qdd.z,
        )
    }

    /// Inertial terms of the three equations in absolute rates.
    fn planar_inertial(&self, couplings: &Couplings, qdd: &Vector4<f32>) -> Vector3<f32> {
        let Couplings { k12, k14, k24, .. } = *couplings;
        let w = absolute_rates(qdd);
        Vector3::new(
            self.inertia.x * w.x + k12 * w.y + k14 * w.z,
            k12 * w.x + self.inertia.y * w.y + k24 * w.z,
            k14 * w.x + k24 * w.y + self.inertia.z * w.z,
        )
    }

    /// Forward dynamics: joint accelerations under the efforts `tau` (rad/s^2, lift m/s^2).
    ///
    /// The planar block is eliminated as `L D L^T` without pivoting, which is backward stable because it is positive definite.
    ///
    /// Paper function; not on the control path.
    #[must_use]
    pub fn forward(&self, trig: &Trig, qd: &Vector4<f32>, tau: &Vector4<f32>) -> Vector4<f32> {
        let couplings = self.couplings(trig);
        let Couplings { k12, k14, k24, .. } = couplings;
        let f = absolute_efforts(tau) - couplings.centrifugal(&absolute_rates(qd));

        let (l21, l31) = (k12 / self.inertia.x, k14 / self.inertia.x);
        let d2 = self.inertia.y - l21 * k12;
        let e32 = k24 - l31 * k12;
        let l32 = e32 / d2;
        let d3 = self.inertia.z - l31 * k14 - l32 * e32;
        let y2 = f.y - l21 * f.x;
        let y3 = f.z - l31 * f.x - l32 * y2;
        let tool = y3 / d3;
        let arm2 = y2 / d2 - l32 * tool;
        let arm1 = f.x / self.inertia.x - l21 * arm2 - l31 * tool;
        joint_rates(
            &Vector3::new(arm1, arm2, tool),
            (tau.z + self.weight) / self.lift_mass,
        )
    }
}

/// Turning rates of arm 1, arm 2 and tool in frame 0, from joint rates; accelerations alike.
fn absolute_rates(joint: &Vector4<f32>) -> Vector3<f32> {
    let arm2 = joint.x + joint.y;
    Vector3::new(joint.x, arm2, arm2 - joint.w)
}

/// Inverse of [`absolute_rates`], with the lift inserted.
fn joint_rates(absolute: &Vector3<f32>, lift: f32) -> Vector4<f32> {
    Vector4::new(
        absolute.x,
        absolute.y - absolute.x,
        lift,
        absolute.y - absolute.z,
    )
}

/// Joint efforts from generalised forces on the absolute rates: the transpose of [`absolute_rates`], with the lift
/// inserted.
fn joint_efforts(absolute: &Vector3<f32>, lift: f32) -> Vector4<f32> {
    let elbow = absolute.y + absolute.z;
    Vector4::new(absolute.x + elbow, elbow, lift, -absolute.z)
}

/// Inverse of [`joint_efforts`].
fn absolute_efforts(joint: &Vector4<f32>) -> Vector3<f32> {
    Vector3::new(joint.x - joint.y, joint.y + joint.w, -joint.w)
}
