//! Input of a law in one sample: the motion, and the kinematics and dynamics evaluated for it.
//!
//! All of it is computed before the law is called, whichever law that is. So a law is a few lines of algebra, and a
//! sample takes about as long with any law.

use nalgebra::Vector4;

use crate::mechanics::arm::Geometry;
use crate::mechanics::body::{Body, MassMatrix};
use crate::mechanics::jacobian::Jacobian;
use crate::mechanics::kinematics::Trig;
use crate::mechanics::math::wrap;
use crate::trajectory::Reference;

/// Everything that a law may use.
#[derive(Clone, Copy, Debug)]
pub struct ControlInput<'a> {
    /// Motion in joint space, measured and desired.
    pub motion: &'a Motion<'a>,
    /// The same in task space.
    pub task: &'a Task,
    /// The equations of motion at the measured position.
    pub model: &'a Model,
    /// Inertia of each axis by itself, for laws without a model.
    pub nominal_inertia: &'a Vector4<f32>,
    /// Efforts that the model does not explain, by the [observer](super::observer): N m, N m, N, N m.
    pub disturbance: &'a Vector4<f32>,
}

/// Motion in joint space: shoulder, elbow, lift (positive down), wrist in rad, rad, m, rad and their derivatives in time;
/// efforts in N m, N m, N, N m.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// Measured joint positions.
    pub q: Vector4<f32>,
    /// Measured joint velocities: means over the last sample, so half a sample old.
    pub qd: Vector4<f32>,
    /// Measured efforts at the joints, means over the last sample: what the motors gave, friction included.
    pub torque: Vector4<f32>,
    /// Reference at the sampling instant.
    pub reference: &'a Reference,
    /// Reference velocity through the same filter as `qd`, so that the two compare without a delay.
    pub mean_qd: Vector4<f32>,
    /// Reference velocity at the middle of the time in which the command will act.
    pub qd_ahead: Vector4<f32>,
    /// Reference acceleration then.
    pub qdd_ahead: Vector4<f32>,
    /// From the sampling instant to the middle of that time, s.
    pub lead: f32,
    /// Sampling period, s.
    pub period: f32,
    /// Time since the last sample that has arrived, s.
    pub elapsed: f32,
    /// What the limits cut off the efforts of the last sample; 0 where nothing was cut.
    pub excess: Vector4<f32>,
}

impl Motion<'_> {
    /// Position error at the sampling instant.
    pub fn position_error(&self) -> Vector4<f32> {
        self.reference.q - self.q
    }

    /// Measured velocity, extrapolated by the change of the reference in the meantime.
    pub fn measured_qd_ahead(&self) -> Vector4<f32> {
        self.qd + (self.qd_ahead - self.mean_qd)
    }

    /// Velocity error over the last sample.
    pub fn velocity_error(&self) -> Vector4<f32> {
        self.mean_qd - self.qd
    }
}

/// Task-space error and its rate, reference minus measured: mu = (x, y, z, yaw) of the flange in frame 0.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// Jacobian at the reference.
    pub desired: Jacobian,
    /// Jacobian at the measured position.
    pub actual: Jacobian,
    /// mu_d - mu: m, m, m, rad (wrapped).
    pub position: Vector4<f32>,
    /// mu_d' - mu': m/s, m/s, m/s, rad/s, means over the last sample.
    pub velocity: Vector4<f32>,
}

impl Task {
    /// Task space of an arm of this geometry at the measured position of `trig`.
    pub fn new(geometry: &Geometry, trig: &Trig, motion: &Motion<'_>) -> Self {
        let desired = Jacobian::new(geometry, &Trig::in_line(&motion.reference.q));
        let actual = Jacobian::new(geometry, trig);
        let ((x_desired, y_desired), (x, y)) = (desired.position(), actual.position());
        // Height and yaw are linear in the joints, and so are their errors.
        let joint = motion.position_error();
        Self {
            position: Vector4::new(
                x_desired - x,
                y_desired - y,
                -joint.z,
                wrap(joint.x + joint.y - joint.w),
            ),
            velocity: desired.task_velocity(&motion.mean_qd) - actual.task_velocity(&motion.qd),
            desired,
            actual,
        }
    }

    /// Joint velocities for the task velocity `task`, or accelerations for an acceleration less J' qd: J^-1 `task`.
    ///
    /// Near the stretched arm the inverse is damped. There `joint`, the same aim in joint space, acts in the direction in
    /// which the tool does not move and the damped inverse does nothing: the elbow is held there too.
    pub fn joint_space(
        &self,
        task: &Vector4<f32>,
        joint: impl FnOnce() -> Vector4<f32>,
    ) -> Vector4<f32> {
        let actual = &self.actual;
        if actual.is_damped() {
            let joint = joint();
            joint + actual.joint_speed_damped(&(task - actual.task_velocity(&joint)))
        } else {
            actual.joint_speed_damped(task)
        }
    }
}

/// The terms of M(q) qdd + C qd + g + friction = tau in one sample: N m, N m, N, N m.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// M, rotors included.
    pub mass: MassMatrix,
    /// C qd at the reference velocity while the command will act.
    pub bias: Vector4<f32>,
    /// g.
    pub gravity: Vector4<f32>,
    /// Friction of the planned motion in the time in which the command will act: that of the measured one would chatter around
    /// rest.
    pub friction: Vector4<f32>,
    /// C^T qd at the measured velocity: the rate of the momentum that no torque causes.
    pub kinetic_gradient: Vector4<f32>,
}

impl Model {
    /// The model at the position of `trig`.
    pub fn new(body: &Body, trig: &Trig, motion: &Motion<'_>) -> Self {
        Self {
            mass: body.mass_matrix(trig),
            bias: body.lagrange.bias(trig, &motion.measured_qd_ahead()),
            gravity: body.lagrange.gravity(),
            friction: body.drive.friction(&motion.qd_ahead),
            kinetic_gradient: body.lagrange.kinetic_gradient(trig, &motion.qd),
        }
    }
}
