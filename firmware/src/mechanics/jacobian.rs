//! Differential kinematics: joint speeds to tool velocity and back, damped near the singularity.
//!
//! A SCARA has one singularity in reach, the stretched arm (theta2 = 0), and it is in the 2 x 2 block that maps the
//! speeds of shoulder and elbow to the horizontal velocity. The other nonzero elements are 1 and -1, so a [`Jacobian`]
//! holds that block alone.

use nalgebra::{Matrix4, Matrix6x4, Vector4};

use crate::mechanics::arm::Geometry;
use crate::mechanics::kinematics::Trig;
use crate::mechanics::math::sqrt;

/// Least |sin theta2| at which the plain inverse is defined: 0.06 degrees from the stretched arm.
///
/// `sin theta2` has an absolute error of 2.5 u, so below this the relative error of the inverse exceeds 1.5e-4, and the
/// joint speeds are a thousand times the ordinary ones anyway.
pub const SINGULAR_SINE: f32 = 1e-3;

/// Damping of the inverse sets in where the least singular value falls below this fraction of the stretched arm's
/// length.
///
/// For the IRB 930 that is 7.6 degrees from the stretched arm; farther away the damped inverse is the inverse.
pub const DAMPING_ONSET: f32 = 0.03;

/// The Jacobian of the flange at one joint position, in frame 0 (paper, eq. 20 to 27).
///
/// Task velocities are `[vx, vy, vz, wz]` (m/s, rad/s).
///
/// Error of any element: `(5 a1 + 12 a2) u`, of which 2.5 and 9.1 come from [`Trig`], the rest from rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jacobian {
    /// d x / d theta1 = -y (m).
    x1: f32,
    /// d x / d theta2 (m).
    x2: f32,
    /// d y / d theta1 = x (m).
    y1: f32,
    /// d y / d theta2 (m).
    y2: f32,
    /// sin theta2.
    s2: f32,
    /// a1 a2 sin theta2, without the cancellation in x1 y2 - x2 y1 (m^2).
    determinant: f32,
    /// The least singular value at which the inverse is not damped (m).
    onset: f32,
}

impl Jacobian {
    /// The Jacobian of an arm of this geometry at the joint position of `trig`.
    #[must_use]
    pub fn new(geometry: &Geometry, trig: &Trig) -> Self {
        let (x2, y2) = (-geometry.a2 * trig.s12, geometry.a2 * trig.c12);
        Self {
            x1: x2 - geometry.a1 * trig.s1,
            x2,
            y1: y2 + geometry.a1 * trig.c1,
            y2,
            s2: trig.s2,
            determinant: geometry.a1 * geometry.a2 * trig.s2,
            onset: DAMPING_ONSET * geometry.reach(),
        }
    }

    /// The same of an arm whose flange is at this position in x and y of frame 0 (m), with the sine and cosine of theta1, and the sine of theta2.
    #[inline(always)]
    pub(crate) fn of_place(
        geometry: &Geometry,
        (x, y): (f32, f32),
        (s1, c1): (f32, f32),
        s2: f32,
    ) -> Self {
        Self {
            x1: -y,
            x2: geometry.a1 * s1 - y,
            y1: x,
            y2: x - geometry.a1 * c1,
            s2,
            determinant: geometry.a1 * geometry.a2 * s2,
            onset: DAMPING_ONSET * geometry.reach(),
        }
    }

    /// The geometric Jacobian, rows vx, vy, vz, wx, wy, wz (paper, eq. 27).
    #[must_use]
    pub fn geometric(&self) -> Matrix6x4<f32> {
        let Self { x1, x2, y1, y2, .. } = *self;
        #[rustfmt::skip]
        let jacobian = Matrix6x4::new(
            x1, x2, 0.0, 0.0,
            y1, y2, 0.0, 0.0,
            0.0, 0.0, -1.0, 0.0,
            0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0,
            1.0, 1.0, 0.0, -1.0,
        );
        jacobian
    }

    /// The task Jacobian, rows vx, vy, vz, wz: the geometric one without the two rows that are always zero, so that it
    /// has an inverse. (The paper inverts the 6 x 4 matrix, eq. 21.)
    #[must_use]
    pub fn task(&self) -> Matrix4<f32> {
        let Self { x1, x2, y1, y2, .. } = *self;
        #[rustfmt::skip]
        let jacobian = Matrix4::new(
            x1, x2, 0.0, 0.0,
            y1, y2, 0.0, 0.0,
            0.0, 0.0, -1.0, 0.0,
            1.0, 1.0, 0.0, -1.0,
        );
        jacobian
    }

    /// Position of the flange in x and y of frame 0 (m), from two elements of the Jacobian.
    #[must_use]
    pub fn position(&self) -> (f32, f32) {
        (self.y1, -self.x1)
    }

    /// Determinant of the task Jacobian, `a1 a2 sin theta2` (m^2). Its magnitude is Yoshikawa's manipulability; the
    /// determinant of the paper's eq. 29 lacks a2.
    #[must_use]
    pub fn determinant(&self) -> f32 {
        self.determinant
    }

    /// Sum of the squares of the planar block (m^2), which is also that of its singular values.
    fn norm_squared(&self) -> f32 {
        self.x1 * self.x1 + self.x2 * self.x2 + self.y1 * self.y1 + self.y2 * self.y2
    }

    /// Singular values of the planar block, the greater first (m): greatest and least horizontal speed of the flange
    /// for speeds of shoulder and elbow on the unit circle.
    ///
    /// Paper function; not on the control path.
    #[must_use]
    pub fn singular_values(&self) -> (f32, f32) {
        let product = self.determinant.abs();
        let sum = self.norm_squared();
        let gap = (sum - 2.0 * product) * (sum + 2.0 * product);
        let greatest = sqrt(0.5 * (sum + sqrt(if gap > 0.0 { gap } else { 0.0 })));
        (greatest, product / greatest)
    }

    /// Forward differential kinematics: task velocity for joint speeds `qd` (paper, eq. 20).
    #[must_use]
    pub fn task_velocity(&self, qd: &Vector4<f32>) -> Vector4<f32> {
        Vector4::new(
            self.x1 * qd.x + self.x2 * qd.y,
            self.y1 * qd.x + self.y2 * qd.y,
            -qd.z,
            qd.x + qd.y - qd.w,
        )
    }

    /// Time derivative of the task Jacobian at joint speeds `qd`.
    ///
    /// Paper function; not on the control path.
    #[must_use]
    pub fn time_derivative(&self, qd: &Vector4<f32>) -> Matrix4<f32> {
        let Self { x1, x2, y1, y2, .. } = *self;
        let (w1, w12) = (qd.x, qd.x + qd.y);
        let (x2_rate, y2_rate) = (-y2 * w12, x2 * w12);
        let (x1_rate, y1_rate) = (x2_rate - (y1 - y2) * w1, y2_rate + (x1 - x2) * w1);
        #[rustfmt::skip]
        let rate = Matrix4::new(
            x1_rate, x2_rate, 0.0, 0.0,
            y1_rate, y2_rate, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0,
        );
        rate
    }

    /// Task acceleration at joint speeds `qd` and zero joint acceleration: the rate of the Jacobian times `qd`, at the
    /// actual position and speed. (The paper's eq. 49 takes the desired ones.)
    #[must_use]
    pub fn bias(&self, qd: &Vector4<f32>) -> Vector4<f32> {
        let Self { x1, x2, y1, y2, .. } = *self;
        let (w1, w12) = (qd.x, qd.x + qd.y);
        let (w1_squared, w12_squared) = (w1 * w1, w12 * w12);
        Vector4::new(
            -(y1 - y2) * w1_squared - y2 * w12_squared,
            (x1 - x2) * w1_squared + x2 * w12_squared,
            0.0,
            0.0,
        )
    }

    /// Inverse differential kinematics: joint speeds for a task velocity (paper, eq. 21); also joint accelerations for
    /// `task acceleration - bias`. `None` within [`SINGULAR_SINE`] of the stretched or folded arm.
    #[must_use]
    pub fn joint_speed(&self, v: &Vector4<f32>) -> Option<Vector4<f32>> {
        if self.s2.abs() < SINGULAR_SINE {
            return None;
        }
        Some(self.joint_speed_undamped(v))
    }

    /// The inverse of the task Jacobian; `None` where [`Jacobian::joint_speed`] has none.
    ///
    /// Paper function; not on the control path.
    #[must_use]
    pub fn inverse(&self) -> Option<Matrix4<f32>> {
        let unit = [Vector4::x(), Vector4::y(), Vector4::z(), Vector4::w()];
        let [x, y, z, w] = unit.map(|v| self.joint_speed(&v));
        Some(Matrix4::from_columns(&[x?, y?, z?, w?]))
    }

    /// Square of the damping (m^2): zero beyond [`DAMPING_ONSET`], growing to a quarter of the squared onset at the singularity.
    ///
    /// It uses `det^2 / (s_max^2 + s_min^2)` for the square of the least singular value. That is never greater and,
    /// where damping acts, hardly less, and it costs a division instead of two roots.
    fn damping_squared(&self) -> f32 {
        let least_squared = self.determinant * self.determinant / self.norm_squared();
        let gap = self.onset * self.onset - least_squared;
        if gap > 0.0 { 0.25 * gap } else { 0.0 }
    }

    /// Whether [`Jacobian::joint_speed_damped`] differs from [`Jacobian::joint_speed`].
    #[must_use]
    pub fn is_damped(&self) -> bool {
        self.determinant * self.determinant < self.onset * self.onset * self.norm_squared()
    }

    /// [`Jacobian::joint_speed`] of an arm that is not [damped](Jacobian::is_damped), and so not stretched.
    #[must_use]
    pub fn joint_speed_undamped(&self, v: &Vector4<f32>) -> Vector4<f32> {
        let scale = 1.0 / self.determinant;
        let w1 = (self.y2 * v.x - self.x2 * v.y) * scale;
        let w2 = (self.x1 * v.y - self.y1 * v.x) * scale;
        Vector4::new(w1, w2, -v.z, w1 + w2 - v.w)
    }

    /// Joint speeds for a task velocity, damped near the stretched arm: defined everywhere, bounded, continuous.
    ///
    /// Damped least squares (Nakamura and Hanafusa 1986) on the planar block with a damping that grows towards the
    /// singularity (after Maciejewski and Klein 1988). Writing e for the onset, the gain `s / (s^2 + (e^2 - s^2) / 4)` of a
    /// singular value s is greatest at `s = e / sqrt 3`, so that the speeds of shoulder and elbow never exceed
    /// `1.155 / e` times the horizontal velocity (37 rad/s per m/s for the IRB 930). The flange slows down or deviates
    /// from the desired direction instead. The wrist follows the damped speeds, so yaw and height stay exact.
    #[must_use]
    pub fn joint_speed_damped(&self, v: &Vector4<f32>) -> Vector4<f32> {
        let Self {
            x1,
            x2,
            y1,
            y2,
            determinant,
            ..
        } = *self;
        let damping = self.damping_squared();
        // (J^T J + damping I)^-1 J^T of a 2 x 2 matrix is (det J adj J + damping J^T) over this sum of squares, which
        // does not square the condition number as the normal equations would.
        let scale = 1.0 / (determinant * determinant + damping * (self.norm_squared() + damping));
        let w1 = (determinant * (y2 * v.x - x2 * v.y) + damping * (x1 * v.x + y1 * v.y)) * scale;
        let w2 = (determinant * (x1 * v.y - y1 * v.x) + damping * (x2 * v.x + y2 * v.y)) * scale;
        Vector4::new(w1, w2, -v.z, w1 + w2 - v.w)
    }
}
