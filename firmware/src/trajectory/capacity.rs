//! What the drives can do: the room that a motion leaves to torque, speed and jerk limits.

use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::Reference;
use super::path::PathPoint;
use super::profile::{Bounds, Sample};
use crate::arm::{ArmModel, Axis};
use crate::body::Body;
use crate::kinematics::Trig;
use crate::math::{cbrt, clamp, sqrt};

/// Share of the torque that a plan may use. The rest is for the feedback: payload and friction
/// are never known exactly, and a saturated axis leaves the path.
pub const TORQUE_SHARE: f32 = 0.92;

/// The limits of one arm with one payload, as the planner uses them.
#[derive(Clone, Copy, Debug)]
pub struct Capacity<'a> {
    /// The robot.
    pub arm: &'a ArmModel,
    /// Its dynamics with the payload that it will carry.
    pub body: &'a Body,
}

impl Capacity<'_> {
    /// By what factor the path acceleration of `along` could grow before the first joint torque
    /// reaches its share; huge where the sample needs hardly any.
    pub fn acceleration_room(&self, here: &PathPoint, along: &Sample) -> f32 {
        let trig = Trig::new(&here.q);
        let qd = here.dq * along.v;
        let push = self.body.mass_matrix(&trig) * here.dq * along.a;
        let rest = self
            .body
            .inverse(&trig, &qd, &(here.ddq * (along.v * along.v)));
        let mut room = f32::MAX;
        for ((push, rest), limit) in push.iter().zip(rest.iter()).zip(self.torque().iter()) {
            let (need, rest) = if *push < 0.0 {
                (-push, -rest)
            } else {
                (*push, *rest)
            };
            // Less than a hundredth of the limit: another sample decides.
            if need > 0.01 * limit {
                room = room.min((limit - rest) / need);
            }
        }
        room
    }

    /// The largest time scale, at most 1, at which `reference` keeps every limit; of the limits
    /// of speed, acceleration and jerk only `share`.
    ///
    /// # Errors
    /// [`RefusalReason::OutOfRange`] with the axis and torque that not even rest can hold.
    pub fn time_scale(&self, reference: &Reference, share: f32) -> Result<f32, Refusal> {
        let Self { arm, body } = self;
        let trig = Trig::new(&reference.q);
        let (qd, qdd) = (&reference.qd, &reference.qdd);
        // tau(x) = quadratic x² + linear x + constant. Coulomb friction does not fade with x.
        let quadratic = body.mass_matrix(&trig) * qdd + body.lagrange.bias(&trig, qd);
        let linear = arm.drive.viscous.component_mul(qd);
        let constant = body.lagrange.gravity() + body.drive.friction(qd) - linear;
        let drive = &body.drive;
        let joint_limit = self.torque();
        let motor_limit = arm.drive.motor_torque_limit * TORQUE_SHARE;
        let full = quadratic + linear + constant;
        // Nearly every sample keeps its limits as it is and at rest: then there is nothing to solve.
        let keeps = within(&full, &joint_limit)
            && within(&constant, &joint_limit)
            && within(&drive.motor_torque(&full), &motor_limit)
            && within(&drive.motor_torque(&constant), &motor_limit);
        let torque = if keeps {
            1.0
        } else {
            let joint = torque_scale(&quadratic, &linear, &constant, &joint_limit)?;
            let motor = torque_scale(
                &drive.motor_torque(&quadratic),
                &drive.motor_torque(&linear),
                &drive.motor_torque(&constant),
                &motor_limit,
            )?;
            joint.min(motor)
        };
        let limits = &arm.limits;
        let share = |limit: &Vector4<f32>| limit * share;
        let speed = ratio(&share(&limits.velocity), qd).min(ratio(
            &share(&arm.drive.motor_speed_limit),
            &drive.motor_speed(qd),
        ));
        let acceleration = ratio(&share(&limits.acceleration), qdd);
        let jerk = ratio(&share(&limits.jerk), &reference.qddd);
        let mut scale = torque.min(speed);
        if acceleration < 1.0 {
            scale = scale.min(sqrt(acceleration));
        }
        if jerk < 1.0 {
            scale = scale.min(cbrt(jerk));
        }
        Ok(scale)
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

    /// Bounds of the vertical strokes of a jump, up and down, over at most `height` m. Gravity
    /// and friction are taken from the force; friction is never counted as help.
    pub fn lift(&self, height: f32) -> (Bounds, Bounds) {
        let limits = &self.arm.limits;
        let mass = self.body.mass_matrix(&Trig::new(&Vector4::zeros())).m33;
        let weight = -self.body.lagrange.gravity().z;
        let cap = limits.acceleration.z;
        let speed = self.speed().z;
        let peak = sqrt(cap * height).min(speed);
        let friction = self.arm.drive.coulomb.z + self.arm.drive.viscous.z * peak;
        let force = self.torque().z;
        // A stroke that the drive cannot hold is refused by the last pass: keep this positive.
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

/// Least of limit over value, where a value is larger than its limit; else at least 1.
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

fn torque_scale(
    quadratic: &Vector4<f32>,
    linear: &Vector4<f32>,
    constant: &Vector4<f32>,
    limit: &Vector4<f32>,
) -> Result<f32, Refusal> {
    let mut scale = 1.0f32;
    for ((((axis, a), b), c), limit) in Axis::ALL
        .into_iter()
        .zip(quadratic.iter())
        .zip(linear.iter())
        .zip(constant.iter())
        .zip(limit.iter())
    {
        let upward = largest_scale(*a, *b, limit - c);
        let downward = largest_scale(-a, -b, limit + c);
        let (Some(upward), Some(downward)) = (upward, downward) else {
            return Err(Refusal {
                reason: RefusalReason::TorqueTooSmall,
                axis: axis as u8,
                value: *c,
                limit: *limit,
            });
        };
        scale = scale.min(upward).min(downward);
    }
    Ok(scale)
}

/// Largest `x` in 0..=1 with `a x² + b x <= room`; `None` where even rest is beyond the limit.
fn largest_scale(a: f32, b: f32, room: f32) -> Option<f32> {
    if room <= 0.0 {
        return None;
    }
    if a + b <= room {
        return Some(1.0);
    }
    // The positive root in the form that does not cancel; a + b > room > 0 makes it real.
    let root = sqrt((b * b + 4.0 * a * room).max(0.0));
    Some((2.0 * room / (b + root)).min(1.0))
}
