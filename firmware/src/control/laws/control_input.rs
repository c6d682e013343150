//! Input of a law in one sample: the motion, and what all laws and the observer need of kinematics and dynamics.

use nalgebra::Vector4;

use crate::mechanics::arm::Geometry;
use crate::mechanics::body::Body;
use crate::mechanics::dynamics::lagrange::Couplings;
use crate::mechanics::jacobian::Jacobian;
use crate::mechanics::kinematics::Trig;
use crate::mechanics::math::wrap;
use crate::trajectory::Setpoint;

/// Everything that a law may use.
#[derive(Clone, Copy, Debug)]
pub struct ControlInput<'a> {
    /// Motion in joint space, measured and desired.
    pub motion: &'a Motion<'a>,
    /// Lengths of the arm.
    pub geometry: &'a Geometry,
    /// Dynamics of the arm with its payload.
    pub body: &'a Body,
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
    /// What to follow, at the sampling instant and at the middle of the time in which the command will act.
    pub setpoint: &'a Setpoint,
    /// Velocity error over the last sample: reference velocity through the same filter as `qd`, so that the two compare without a
    /// delay, minus `qd`.
    pub velocity_error: Vector4<f32>,
    /// Measured velocities, extrapolated to that time by the change of the reference in the meantime.
    pub qd_ahead: Vector4<f32>,
    /// From the sampling instant to the middle of that time, s.
    pub lead: f32,
    /// Sampling period, s.
    pub period: f32,
    /// Time since the last sample that has arrived, s.
    pub elapsed: f32,
    /// Position error at the sampling instant, reference minus measured.
    pub error: &'a Vector4<f32>,
    /// What the limits cut off the efforts of the last sample; 0 where nothing was cut.
    pub excess: &'a Vector4<f32>,
}

impl Motion<'_> {
    /// Mean reference velocity over the last sample.
    pub fn mean_qd(&self) -> Vector4<f32> {
        self.qd + self.velocity_error
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
    /// Task space of a motion, of which there are the sines and cosines of elbow and wrist.
    #[inline(always)]
    pub fn new(input: &ControlInput<'_>, trig: &Trig) -> Self {
        let ControlInput {
            motion, geometry, ..
        } = *input;
        let desired = Jacobian::new(geometry, &Trig::in_line(&motion.setpoint.reference.q));
        let actual = Jacobian::new(geometry, &trig.with_shoulder(motion.q.x));
        let ((x_desired, y_desired), (x, y)) = (desired.position(), actual.position());
        // Height and yaw are linear in the joints, and so are their errors.
        let joint = motion.error;
        Self {
            position: Vector4::new(
                x_desired - x,
                y_desired - y,
                -joint.z,
                wrap(joint.x + joint.y - joint.w),
            ),
            velocity: desired.task_velocity(&motion.mean_qd()) - actual.task_velocity(&motion.qd),
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
            actual.joint_speed_undamped(task)
        }
    }
}

/// What a law gives in one sample, and what it has in common with the observer of M(q) qdd + C qd + g + friction = tau.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// Joint torques without those of the observer: N m, N m, N, N m.
    pub torque: Vector4<f32>,
    /// Inertia at the measured position.
    pub couplings: Couplings,
    /// Friction of the planned motion in the time in which the command will act: that of the measured one would chatter around
    /// rest. N m, N m, N, N m.
    pub friction: Vector4<f32>,
}
