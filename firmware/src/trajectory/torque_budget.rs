//! Torque budget: the margin between a motion and the torque, speed and jerk limits.

use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::Reference;
use super::path::PathPoint;
use super::profile::{Bounds, Sample};
use crate::mechanics::arm::{ArmModel, Axis};
use crate::mechanics::body::Body;
use crate::mechanics::kinematics::Trig;
use crate::mechanics::math::{cbrt, clamp, sqrt};

/// Share of the torque that a plan may use. The rest is for feedback control: payload and friction are never known
/// exactly, and a saturated axis leaves the path.
pub const TORQUE_SHARE: f32 = 0.93;

/// The limits of one arm with one payload, as the planner uses them.
#[derive(Clone, Copy, Debug)]
pub struct TorqueBudget<'a> {
    /// The robot.
    pub arm: &'a ArmModel,
    /// Its dynamics with the payload of the move.
    pub body: &'a Body,
}

impl TorqueBudget<'_> {
    /// By what factor the path acceleration of `along` could grow before the first torque
    /// reaches its share; huge where the sample needs hardly any.
    pub fn acceleration_room(&self, here: &PathPoint, along: &Sample) -> f32 {
        let push = here.dq * along.a;
        let rest = Reference {
            q: here.q,
            qd: here.dq * along.v,
            qdd: here.ddq * (along.v * along.v),
        };
        // Less than a hundredth of the limit: another sample decides.
        self.room(&rest, &push, 0.01)
    }

    /// How fast the clock that runs through a trajectory at `time_scale` may be braked, 1/s, before the first torque reaches
    /// its share. `reference` is the trajectory's own. With a load on the lift the two directions differ: its
    /// weight brakes a rise, and takes most of the force on the way down.
    pub fn braking_room(&self, reference: &Reference, time_scale: f32) -> f32 {
        let rest = Reference {
            q: reference.q,
            qd: reference.qd * time_scale,
            qdd: reference.qdd * (time_scale * time_scale),
        };
        self.room(&rest, &-reference.qd, 0.0).max(0.0)
    }

    /// By what factor the accelerations `push` could grow before they and `rest` together need more than their share of
    /// the torque of a joint or motor; those that need no more than a part `least` of it for `push` are left out.
    // Out of line, for the size of two copies.
    #[inline(never)]
    fn room(&self, rest: &Reference, push: &Vector4<f32>, least: f32) -> f32 {
        let Self { arm, body } = self;
        let Reference { q, qd, qdd } = rest;
        let trig = Trig::in_line(q);
        let push = body.inertial(&trig, push);
        let rest = body.inertial(&trig, qdd)
            + body.lagrange.bias(&trig, qd)
            + body.lagrange.gravity()
            + arm.drive.viscous.component_mul(qd)
            + body.drive.coulomb_friction(qd);
        let (joint, motor) = self.torque_limits();
        let mut room = f32::MAX;
        let mut narrow = |push: f32, rest: f32, limit: f32| {
            let (need, rest) = if push < 0.0 {
                (-push, -rest)
            } else {
                (push, rest)
            };
            if need > least * limit {
                room = room.min((limit - rest) / need);
            }
        };
        for ((push, rest), limit) in push.iter().zip(rest.iter()).zip(joint.iter()) {
            narrow(*push, *rest, *limit);
        }
        narrow(self.wrist_motor(&push), self.wrist_motor(&rest), motor);
        room
    }

    /// Whether the arm can creep: hold its weight and overcome friction in either direction with torque to spare.
    ///
    /// # Errors
    /// [`RefusalReason::TorqueTooSmall`] with the axis and the torque, which no time scale reduces.
    pub fn check_creep(&self) -> Result<(), Refusal> {
        let torque = self.body.lagrange.gravity().abs() + self.arm.drive.coulomb;
        let (joint, motor) = self.torque_limits();
        let refuse = |axis: Axis, value: f32, limit: f32| {
            Err(Refusal {
                reason: RefusalReason::TorqueTooSmall,
                axis: axis as u8,
                value,
                limit,
            })
        };
        for ((axis, value), limit) in Axis::ALL.into_iter().zip(torque.iter()).zip(joint.iter()) {
            if value >= limit {
                return refuse(axis, *value, *limit);
            }
        }
        let lift = Vector4::new(0.0, 0.0, torque.z, 0.0);
        let wrist = Vector4::new(0.0, 0.0, 0.0, torque.w);
        let value = self.wrist_motor(&lift).abs() + self.wrist_motor(&wrist).abs();
        if value >= motor {
            return refuse(Axis::Wrist, value, motor);
        }
        Ok(())
    }

    /// The largest time scale, at most 1, at which `reference` keeps the torque limits of joints and
    /// motors, of an arm that [can creep](Self::check_creep).
    pub fn torque_scale(&self, reference: &Reference) -> f32 {
        let Self { arm, body } = self;
        let trig = Trig::in_line(&reference.q);
        let (qd, qdd) = (&reference.qd, &reference.qdd);
        // tau(x) = a x² + b x + c. Coulomb friction does not depend on x.
        let a = body.inertial(&trig, qdd) + body.lagrange.bias(&trig, qd);
        let b = arm.drive.viscous.component_mul(qd);
        let c = body.lagrange.gravity() + body.drive.coulomb_friction(qd);
        let full = a + b + c;
        let (joint, motor) = self.torque_limits();
        // Nearly every sample keeps its limits as it is: then there is nothing to solve.
        if within(&full, &joint) && self.wrist_motor(&full).abs() <= motor {
            return 1.0;
        }
        let wrist = |torque: &Vector4<f32>| self.wrist_motor(torque);
        scale_within(a.x, b.x, c.x, joint.x)
            .min(scale_within(a.y, b.y, c.y, joint.y))
            .min(scale_within(a.z, b.z, c.z, joint.z))
            .min(scale_within(a.w, b.w, c.w, joint.w))
            .min(scale_within(wrist(&a), wrist(&b), wrist(&c), motor))
    }

    /// Torques that a plan or a stop may use: of the joints, as they and the motors that turn one joint each allow, and of the motor of the
    /// wrist, which carries part of the lift's force, too.
    fn torque_limits(&self) -> (Vector4<f32>, f32) {
        let motor = self.arm.drive.motor_torque_limit.w;
        (self.body.effort_limit * TORQUE_SHARE, motor * TORQUE_SHARE)
    }

    fn wrist_motor(&self, torque: &Vector4<f32>) -> f32 {
        self.body.drive.motor_torque(torque).w
    }

    /// The largest time scale, at most 1, at which the motor of the lift, which also turns with the wrist, keeps its speed
    /// limit.
    pub fn lift_motor_scale(&self, qd: &Vector4<f32>) -> f32 {
        let speed = self.body.drive.motor_speed(qd).z.abs();
        let limit = self.arm.drive.motor_speed_limit.z;
        if speed > limit { limit / speed } else { 1.0 }
    }

    /// The largest time scale, at most 1, at which `reference` and the joint jerks `qddd` use no more than `share` of the limits
    /// of speed, acceleration and jerk.
    pub fn derivative_scale(&self, reference: &Reference, qddd: &Vector4<f32>, share: f32) -> f32 {
        let limits = &self.arm.limits;
        let speed = ratio(&(limits.velocity * share), &reference.qd);
        let motor = ratio(
            &(self.arm.drive.motor_speed_limit * share),
            &self.body.drive.motor_speed(&reference.qd),
        );
        let acceleration = ratio(&(limits.acceleration * share), &reference.qdd);
        let jerk = ratio(&(limits.jerk * share), qddd);
        let mut scale = speed.min(motor);
        if acceleration < 1.0 {
            scale = scale.min(sqrt(acceleration));
        }
        if jerk < 1.0 {
            scale = scale.min(cbrt(jerk));
        }
        scale
    }

    /// Largest joint speeds: the joint's own limit or the motor's, whichever is lower.
    pub fn speed(&self) -> Vector4<f32> {
        let motor = self
            .body
            .drive
            .joint_speed(&self.arm.drive.motor_speed_limit)
            .abs();
        self.arm.limits.velocity.inf(&motor)
    }

    /// Bounds of the vertical strokes of a jump, up and down, over at most `height` m. Gravity and friction are
    /// subtracted from the available force; friction never adds to it.
    #[inline(never)]
    pub fn lift(&self, height: f32) -> (Bounds, Bounds) {
        let limits = &self.arm.limits;
        let mass = self.body.nominal_inertia.z;
        let weight = -self.body.lagrange.gravity().z;
        let cap = limits.acceleration.z;
        let speed = self.speed().z;
        let peak = sqrt(cap * height).min(speed);
        let friction = self.arm.drive.coulomb.z + self.arm.drive.viscous.z * peak;
        let force = self.torque().z;
        // Strokes that the drive cannot hold have been refused: this keeps the bound positive for one close to the
        // limit.
        let within = |force: f32| clamp(force / mass, 0.01 * cap, cap);
        let up = Bounds {
            speed,
            accelerate: within(force - weight - friction),
            brake: within(force + weight),
            jerk: limits.jerk.z,
        };
        let down = Bounds {
            speed,
            accelerate: within(force + weight - friction),
            brake: within(force - weight),
            jerk: limits.jerk.z,
        };
        (up, down)
    }

    fn torque(&self) -> Vector4<f32> {
        self.arm.limits.effort * TORQUE_SHARE
    }
}

fn within(value: &Vector4<f32>, limit: &Vector4<f32>) -> bool {
    value
        .iter()
        .zip(limit.iter())
        .all(|(value, limit)| value.abs() <= *limit)
}

/// Smallest ratio of limit to value where a value exceeds its limit; otherwise at least 1.
fn ratio(limit: &Vector4<f32>, value: &Vector4<f32>) -> f32 {
    let mut least = 1.0f32;
    for (limit, value) in limit.iter().zip(value.iter()) {
        let value = value.abs();
        if value * least > *limit {
            least = limit / value;
        }
    }
    least
}

/// Largest `x`, at most 1, with `a x² + b x + c` within the limit.
fn scale_within(a: f32, b: f32, c: f32, limit: f32) -> f32 {
    let full = a + b + c;
    if full > limit {
        largest_scale(a, b, limit - c)
    } else if full < -limit {
        largest_scale(-a, -b, limit + c)
    } else {
        1.0
    }
}

/// The positive root of `a x² + b x = room`, for a + b > room > 0.
#[cold]
fn largest_scale(a: f32, b: f32, room: f32) -> f32 {
    // In the form that does not cancel. For a < 0, b > room - a makes the discriminant positive.
    let root = sqrt((b * b + 4.0 * a * room).max(0.0));
    (2.0 * room / (b + root)).min(1.0)
}
