//! Torque budget: the margin between a motion and the limits of torque, its rate of change, and speed.

use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::path::PathPoint;
use super::profile::{Bounds, HalfBounds, Sample};
use super::{Rates, Reference};
use crate::mechanics::arm::{ArmModel, Axis};
use crate::mechanics::body::{Body, Torques};
use crate::mechanics::dynamics::lagrange::Couplings;
use crate::mechanics::kinematics::Trig;
use crate::mechanics::math::{cbrt, clamp, least};

/// Share of the torque's rate of change that a profile may use. The rest is for what lies between two samples.
const RATE_SHARE: f32 = 0.95;

/// The same for the mean over a step of the last pass; above it, so that this pass does not slow down what just keeps it.
const VERIFIED_RATE: f32 = 0.952;
/// Share of the torque's rate of change that a stop may use: the move's own change keeps the rest.
pub(super) const STOP_SHARE: f32 = 0.5;
/// The same for another pace, which nobody needs at once: what a plan leaves.
pub(super) const RAMP_SHARE: f32 = 0.05;

/// The limits of one arm with one payload, as the planner uses them.
#[derive(Clone, Copy, Debug)]
pub struct TorqueBudget<'a> {
    /// The robot.
    pub arm: &'a ArmModel,
    /// Its dynamics with the payload of the move.
    pub body: &'a Body,
}

/// What a motion along a path needs: torque in proportion to the acceleration along it, and torque for everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// For each unit of acceleration along the path.
    push: Torques,
    /// Without acceleration along the path.
    rest: Torques,
}

impl TorqueBudget<'_> {
    /// The acceleration along the path, 1/s², and the jerk, 1/s³, that the torques and their rates of change allow an arm at rest.
    pub fn from_rest(&self, here: &PathPoint) -> (f32, f32) {
        let push = self.body.inertial(&self.couplings(&here.q), &here.dq);
        let need = Need {
            push: self.torques(&push),
            rest: self.torques(&self.body.lagrange.gravity()),
        };
        (self.room(&need, true), self.quickest(&need))
    }

    /// By what factor the path acceleration of `along` could grow before the first torque
    /// reaches its share; huge where the sample needs hardly any.
    pub fn acceleration_room(&self, here: &PathPoint, along: &Sample) -> f32 {
        let Sample { v, a, .. } = *along;
        let couplings = self.couplings(&here.q);
        let push = self.torques(&self.body.inertial(&couplings, &(here.dq * a)));
        let rest = self.load(&couplings, &(here.dq * v), &(here.ddq * (v * v)));
        // Unlike `room` it looks over what hardly pushes.
        let limits = &self.body.planned_torque;
        let mut room = f32::MAX;
        let each = push.as_slice().iter().zip(rest.as_slice());
        for ((push, rest), limit) in each.zip(limits.as_slice()) {
            let left = if *push < 0.0 {
                limit + rest
            } else {
                limit - rest
            };
            let need = push.abs();
            // Less than a hundredth of the limit: another sample decides.
            if need > 0.01 * limit && left < room * need {
                room = left / need;
            }
        }
        room
    }

    /// How fast the motors can change the acceleration along the path, 1/s³; infinite where nothing moves.
    fn quickest(&self, need: &Need) -> f32 {
        let each = need
            .push
            .as_slice()
            .iter()
            .zip(self.body.torque_rate.as_slice());
        each.fold(f32::INFINITY, |quickest, (push, rate)| {
            slower(quickest, RATE_SHARE * rate, *push)
        })
    }

    /// What it takes to brake or speed up the clock that runs at `time_scale` through a trajectory, whose own motion at `q` is `rates`.
    #[inline(never)]
    pub fn need(&self, q: &Vector4<f32>, rates: &Rates, time_scale: f32) -> Need {
        let couplings = self.couplings(q);
        let (qd, qdd) = (rates.qd * time_scale, rates.qdd * (time_scale * time_scale));
        Need {
            push: self.torques(&self.body.inertial(&couplings, &rates.qd)),
            rest: self.load(&couplings, &qd, &qdd),
        }
    }

    /// Greatest change of the slope of the time scale, 1/s², with this share of the torques' rates; infinite at rest.
    pub fn bend(&self, need: &Need, rates: &Rates, share: f32) -> f32 {
        let bend = share * self.quickest(need);
        if self.arm.limits.caps_acceleration() {
            self.cap_bend(rates, share, bend)
        } else {
            bend
        }
    }

    /// How fast the time scale may fall, or rise where it gets `faster`, before the first torque reaches its share, 1/s. With a load on the lift
    /// the two differ: its weight brakes a rise, and takes most of the force on the way down.
    pub fn steepest(&self, need: &Need, rates: &Rates, time_scale: f32, faster: bool) -> f32 {
        let steepest = self.room(need, faster);
        if self.arm.limits.caps_acceleration() {
            self.cap_slope(rates, time_scale, faster, steepest)
        } else {
            steepest
        }
    }

    // Out of line, for the size of one copy.
    #[inline(never)]
    fn couplings(&self, q: &Vector4<f32>) -> Couplings {
        self.body.lagrange.couplings(&Trig::relative_in_line(q))
    }

    /// Torques of a motion.
    #[inline(never)]
    fn load(&self, couplings: &Couplings, qd: &Vector4<f32>, qdd: &Vector4<f32>) -> Torques {
        let dry = self.body.drive.coulomb_friction(qd);
        self.torques(&(self.smooth(couplings, qd, qdd) + dry))
    }

    /// Joint torques of a motion without Coulomb friction.
    #[inline(always)]
    fn smooth(&self, couplings: &Couplings, qd: &Vector4<f32>, qdd: &Vector4<f32>) -> Vector4<f32> {
        let viscous = self.arm.drive.viscous.component_mul(qd);
        self.body.frictionless(couplings, qd, qdd) + viscous
    }

    /// How far `push` may go down from none, or up, before it and `rest` together need more than their share of a torque.
    // Out of line, for the size of one copy.
    #[inline(never)]
    fn room(&self, need: &Need, up: bool) -> f32 {
        let limits = &self.body.planned_torque;
        let mut room = f32::MAX;
        let each = need.push.as_slice().iter().zip(need.rest.as_slice());
        for ((push, rest), limit) in each.zip(limits.as_slice()) {
            let left = if (*push < 0.0) == up {
                limit + rest
            } else {
                limit - rest
            };
            room = slower(room, left.max(0.0), *push);
        }
        room
    }

    /// Whether the arm can creep: hold its weight and overcome friction in either direction with torque to spare.
    ///
    /// # Errors
    /// [`RefusalReason::TorqueTooSmall`] with the axis and the torque, which no time scale reduces.
    pub fn check_creep(&self) -> Result<(), Refusal> {
        let torque = self.body.lagrange.gravity().abs() + self.arm.drive.coulomb;
        let limits = &self.body.planned_torque;
        let refuse = |axis: Axis, value: f32, limit: f32| {
            Err(Refusal {
                reason: RefusalReason::TorqueTooSmall,
                axis: axis as u8,
                value,
                limit,
            })
        };
        let each = Axis::ALL.into_iter().zip(torque.as_slice());
        for ((axis, value), limit) in each.zip(limits.as_slice()) {
            if value >= limit {
                return refuse(axis, *value, *limit);
            }
        }
        let lift = Vector4::new(0.0, 0.0, torque.z, 0.0);
        let wrist = Vector4::new(0.0, 0.0, 0.0, torque.w);
        let value = self.wrist_motor(&lift).abs() + self.wrist_motor(&wrist).abs();
        if value >= limits.a {
            return refuse(Axis::Wrist, value, limits.a);
        }
        Ok(())
    }

    /// The largest time scale, at most 1, at which `reference` keeps the torque limits of joints and motors, of an arm that
    /// [can creep](Self::check_creep); and its torques without Coulomb friction, which sets in at once.
    // Out of line, for the size of one copy.
    #[inline(never)]
    pub fn torque_scale(&self, reference: &Reference) -> (f32, Torques) {
        let (full, smooth) = self.torques_of(reference);
        let scale = if self.keeps_torque(&full) {
            1.0
        } else {
            self.scale_of(&full, &reference.qd)
        };
        (scale, smooth)
    }

    /// The torques of a motion; and those without Coulomb friction.
    #[inline(never)]
    pub fn torques_of(&self, reference: &Reference) -> (Torques, Torques) {
        let Reference { q, qd, qdd } = reference;
        let smooth = self.torques(&self.smooth(&self.couplings(q), qd, qdd));
        let dry = self.torques(&self.body.drive.coulomb_friction(qd));
        (smooth + dry, smooth)
    }

    /// Whether torques keep their limits.
    pub fn keeps_torque(&self, torque: &Torques) -> bool {
        within(torque, &self.body.planned_torque)
    }

    /// The largest time scale, at most 1, at which a motion with the speeds `qd` keeps the torque limits, where it has these torques at 1.
    #[inline(never)]
    pub fn scale_of(&self, torque: &Torques, qd: &Vector4<f32>) -> f32 {
        // tau(x) = a x² + b x + c. Coulomb friction does not depend on x.
        let b = self.torques(&self.arm.drive.viscous.component_mul(qd));
        let dry = self.body.drive.coulomb_friction(qd);
        let c = self.torques(&(self.body.lagrange.gravity() + dry));
        let a = torque - b - c;
        let limits = &self.body.planned_torque;
        let mut scale = 1.0f32;
        let each = a.as_slice().iter().zip(b.as_slice()).zip(c.as_slice());
        for (((a, b), c), limit) in each.zip(limits.as_slice()) {
            scale = least(scale, scale_within(*a, *b, *c, *limit));
        }
        scale
    }

    /// The largest time scale, at most 1, at which torques change no faster than by `change` within `time` s.
    pub fn rate_scale(&self, change: &Torques, time: f32) -> f32 {
        let rates = self.body.torque_rate * (VERIFIED_RATE * time);
        let ratio = ratio(rates.as_slice(), change.as_slice());
        // All but a small part of the change is inertial, and goes with the cube of the time scale.
        if ratio < 1.0 { cbrt(ratio) } else { 1.0 }
    }

    /// Whether it is 1.
    pub fn keeps_rate(&self, change: &Torques, time: f32) -> bool {
        within(change, &(self.body.torque_rate * (VERIFIED_RATE * time)))
    }

    fn torques(&self, joint: &Vector4<f32>) -> Torques {
        Torques::new(joint.x, joint.y, joint.z, joint.w, self.wrist_motor(joint))
    }

    fn wrist_motor(&self, torque: &Vector4<f32>) -> f32 {
        self.body.drive.motor_torque(torque).w
    }

    /// The largest time scale, at most 1, at which the joint speeds `qd` use no more than `share` of the limits of joints and
    /// motors. Lift and wrist share one.
    #[inline(never)]
    pub fn speed_scale(&self, qd: &Vector4<f32>, share: f32) -> f32 {
        let joint = ratio((self.arm.limits.velocity * share).as_slice(), qd.as_slice());
        let motor = self.arm.drive.motor_speed_limit * share;
        let speed = self.body.drive.motor_speed(qd);
        least(joint, ratio(motor.as_slice(), speed.as_slice()))
    }

    /// The same of the motor alone that lift and wrist share, for a motion whose joints keep their own limits.
    pub fn shared_speed_scale(&self, qd: &Vector4<f32>) -> f32 {
        let limit = self.arm.drive.motor_speed_limit.z;
        let speed = self.body.drive.motor_speed(qd).z.abs();
        if speed > limit { limit / speed } else { 1.0 }
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

    /// Bounds of a vertical stroke of a jump, up or down, over at most `height` m. Friction takes from the force that speeds
    /// up, the more the faster it goes; dry friction adds to the one that brakes.
    #[inline(never)]
    pub fn lift(&self, height: f32, down: bool) -> Bounds {
        let limits = &self.arm.limits;
        let mass = self.body.nominal_inertia.z;
        let gravity = self.body.lagrange.gravity().z;
        let force = self.body.planned_torque.z;
        let coulomb = self.arm.drive.coulomb.z;
        let viscous = self.arm.drive.viscous.z;
        let cap = limits
            .acceleration
            .z
            .min((force + gravity.abs() + coulomb) / mass);
        // Strokes that the drive cannot hold have been refused: this keeps the bound positive for one close to the
        // limit.
        let within = |force: f32| clamp(force / mass, 0.01 * cap, cap);
        // Viscous friction grows with the speed while the acceleration grows.
        let rate = RATE_SHARE * self.body.torque_rate.z;
        let jerk = limits
            .jerk
            .z
            .min((rate - viscous * cap).max(0.1 * rate) / mass);
        // Gravity is negative: upwards is against it.
        let weight = if down { gravity } else { -gravity };
        let (lifting, braking) = (force - weight - coulomb, force + weight + coulomb);
        let (up, back) = (within(lifting), within(braking));
        // The peak speed of these accelerations over the height, or a little more: from the greatest, by steps towards the root of a
        // parabola.
        let speed = self.speed().z;
        let square = 0.5 / up + 0.5 / back;
        let linear = 0.5 * (up + back) / jerk;
        let mut peak = speed;
        for _ in 0..4 {
            peak = peak.min((square * peak * peak + height) / (2.0 * square * peak + linear));
        }
        // Speed that a ramp takes.
        let ramp = 0.5 * up * up / jerk;
        Bounds {
            speed,
            jerk,
            accelerate: HalfBounds {
                jerk,
                slow: within(lifting - viscous * ramp.min(peak)),
                fast: within(lifting - viscous * (peak - ramp).max(0.0)),
            },
            brake: HalfBounds::even(back, jerk),
        }
    }
}

/// The lower one of `fastest` and the acceleration for which `push` takes one second to be built up at `rate`.
// Out of line, for the size of one copy.
#[inline(never)]
pub(super) fn slower(fastest: f32, rate: f32, push: f32) -> f32 {
    let push = push.abs();
    if push * fastest > rate {
        rate / push
    } else {
        fastest
    }
}

fn within(value: &Torques, limit: &Torques) -> bool {
    value
        .as_slice()
        .iter()
        .zip(limit.as_slice())
        .all(|(value, limit)| value.abs() <= *limit)
}

/// Smallest ratio of limit to value where a value exceeds its limit; otherwise at least 1.
// Out of line, for the size of one copy.
#[inline(never)]
pub(super) fn ratio(limit: &[f32], value: &[f32]) -> f32 {
    let mut least = 1.0f32;
    for (limit, value) in limit.iter().zip(value) {
        let value = value.abs();
        if value * least > *limit {
            least = limit / value;
        }
    }
    least
}

/// Largest `x`, at most 1, with `a x² + b x + c` within the limit.
#[inline(never)]
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

/// The positive root of `a x² + b x = room`, for a + b > room > 0, by Newton's method: from above where the parabola opens upwards, from
/// below where it opens downwards, so that no step passes the root. Within 0.6 % for samples that need up to eight times what
/// there is, and much nearer for the few per cent that are usual; a root costs several times as much.
fn largest_scale(a: f32, b: f32, room: f32) -> f32 {
    let mut x = if a < 0.0 { room / b } else { 1.0 };
    for _ in 0..4 {
        x = (a * x * x + room) / (2.0 * a * x + b);
    }
    x
}

#[cfg(test)]
mod tests;
