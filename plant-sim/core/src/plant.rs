//! The robot as physics: rigid arm, drives, friction, brake, end stops, encoders.
//!
//! Joint vectors are `[theta1, theta2, d3, theta4]`; SI units; efforts are torques in N m, on axis 3 a force in N,
//! positive downwards. Nothing here knows what controls the robot or how it is connected.

pub mod arm;
pub mod brake;
pub mod defect;
pub mod drive;
pub mod encoder;
mod energy;
pub(crate) mod factor;
mod friction;
mod integrator;
pub mod kinematics;
pub mod stop;

use crate::model::{Payload, RobotModel};
use arm::{Arm, Configuration};
use brake::Brake;
use defect::Defects;
use drive::Drive;
use encoder::Encoder;
pub use energy::Energy;
use factor::Factor;
use integrator::{Rates, Slope};
use kinematics::Pose;
use nalgebra::{Matrix4, Vector4};
use stop::EndStops;

/// Index of the lift among the joints.
const LIFT: usize = 2;

/// The robot in motion.
///
/// A new plant is at rest as after power-up: torque off, brake closed, no payload, time 0.
#[derive(Clone, Debug)]
pub struct Plant {
    model: RobotModel,
    payload: Option<Payload>,
    arm: Arm,
    drive: Drive,
    encoder: Encoder,
    stops: EndStops,
    brake: Brake,
    q: Vector4<f64>,
    qd: Vector4<f64>,
    request: Vector4<f64>,
    torque_enabled: bool,
    saturated: bool,
    now: u64,
    max_step: u64,
    ledger: Rates,
    latched: (u64, Vector4<f64>),
    defects: Defects,
}

/// Measurements of the drives, sampled by [`Plant::latch`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Motor encoders.
    pub counts: [i32; 4],
    /// Mean motor torque since the previous sample, N m.
    pub motor_torque: [f64; 4],
}

/// Efforts and losses at one state.
struct Balance {
    /// Sum of efforts that accelerate the joints.
    effort: Vector4<f64>,
    rates: Rates,
}

impl Plant {
    /// Longest step of integration, ns: the rest of a millisecond after the command has arrived. The fastest motion to
    /// resolve is a joint on its end stop (400 rad/s): three tenths of a radian per step. Only a robot with extremely
    /// steep friction gets shorter steps.
    pub const MAX_STEP_NS: u64 = 800_000;

    /// Shortest step that a robot may make necessary, ns.
    pub const MIN_STEP_NS: u64 = 10_000;

    /// Longest step while the brake slides, ns.
    const BRAKING_STEP_NS: u64 = 250_000;

    /// The robot of `model` at rest at joint positions `q`.
    pub fn new(model: &RobotModel, q: [f64; 4]) -> Self {
        let arm = Arm::new(model, None);
        let drive = Drive::new(&model.drive);
        let stretched = arm.mass_matrix(&arm.at(&Vector4::zeros())) + drive.rotor_inertia();
        Self {
            payload: None,
            arm,
            encoder: Encoder::new(model.drive.encoder_counts),
            stops: EndStops::new(&model.limits, &stretched.diagonal()),
            max_step: integrator::resolvable_step(
                &stretched,
                &drive.friction_secant(&Vector4::zeros()),
            )
            .min(stop::resolvable_step(model))
            .clamp(Self::MIN_STEP_NS, Self::MAX_STEP_NS),
            drive,
            brake: Brake::new(model.limits.effort[LIFT]),
            model: model.clone(),
            q: q.into(),
            qd: Vector4::zeros(),
            request: Vector4::zeros(),
            torque_enabled: false,
            saturated: false,
            now: 0,
            ledger: Rates::zeros(),
            latched: (0, Vector4::zeros()),
            defects: Defects::default(),
        }
    }

    /// Sets the longest step of integration, ns (at least 1).
    pub fn set_max_step(&mut self, ns: u64) {
        self.max_step = ns.max(1);
    }

    /// Sets the joint speeds, to start in the middle of a motion. A lift held by the brake stays at rest.
    pub fn set_speed(&mut self, qd: [f64; 4]) {
        self.qd = qd.into();
        if self.brake.is_sticking() {
            self.qd[LIFT] = 0.0;
        }
    }

    /// Commands motor torques (N m) from now on.
    ///
    /// Returns which of them are saturated: beyond the torque limit, or beyond what remains above the speed limit. NaN
    /// counts as zero and as saturated.
    pub fn set_motor_torque(&mut self, torque: [f64; 4]) -> [bool; 4] {
        self.request = Vector4::from(torque).map(|t| if t.is_nan() { 0.0 } else { t });
        let given = self
            .drive
            .limited(&self.request, &self.drive.to_motor(&self.qd));
        let saturated = std::array::from_fn(|i| torque[i] != given[i]);
        self.saturated = saturated.contains(&true);
        saturated
    }

    /// Whether the last command exceeded what a motor can give.
    pub fn is_saturated(&self) -> bool {
        self.saturated
    }

    /// Which motors are at their limit now; none while they are off.
    pub fn at_limit(&self) -> [bool; 4] {
        let speed = self.drive.to_motor(&self.qd);
        let at_limit = self.drive.at_limit(&self.request, &speed);
        at_limit.map(|limited| limited && self.torque_enabled)
    }

    /// Switches all motors on or off. The last command is kept.
    pub fn set_torque_enabled(&mut self, enabled: bool) {
        self.torque_enabled = enabled;
    }

    /// Commands the brake of the lift; it follows after [`Brake::ENGAGE_NS`] or [`Brake::RELEASE_NS`].
    pub fn set_brake(&mut self, engaged: bool) {
        if self.defects.brake_follows(engaged) {
            self.brake.command(engaged, self.now);
        }
    }

    /// Puts a payload into the gripper, in place of any other, at the speed of the flange.
    pub fn attach(&mut self, payload: Payload) {
        self.hold(Some(payload));
    }

    /// Releases the payload.
    pub fn release(&mut self) {
        self.hold(None);
    }

    fn hold(&mut self, payload: Option<Payload>) {
        self.payload = payload;
        self.arm = Arm::new(&self.model, self.defects.burden(payload).as_ref());
    }

    /// Integrates up to time `t` (ns). An earlier time has no effect.
    ///
    /// Steps are of fixed length, except that the last one and one ended by a change of the brake are shorter.
    pub fn advance_to(&mut self, t: u64) {
        self.brake.update(self.now);
        while self.now < t {
            let end = t
                .min(self.now + self.longest_step())
                .min(self.brake.due().unwrap_or(u64::MAX));
            self.step((end - self.now) as f64 * 1e-9);
            self.now = end;
            self.brake.update(end);
        }
    }

    /// Shorter while a brake slides: it stops within one step, and its error is up to half of that step.
    fn longest_step(&self) -> u64 {
        if self.brake.is_closed() && !self.brake.is_sticking() {
            self.max_step.min(Self::BRAKING_STEP_NS)
        } else {
            self.max_step
        }
    }

    fn step(&mut self, h: f64) {
        let at = self.arm.at(&self.q);
        let mass = self.total_mass(&at);
        let mut damping = self.damping(&self.qd);
        let friction = damping.component_mul(&self.qd);
        let balance = self.balance(&at, &self.q, &self.qd, &friction);
        if self.brake.is_sticking() {
            let load = self.effort_on_brake(&mass, &balance.effort);
            self.brake.load(load);
            // One that has begun to slip; at rest that changes no effort.
            damping[LIFT] += self.brake.sliding_secant(self.qd[LIFT]);
        }
        let mass = self.constrained(mass);
        let first = Slope {
            force: self.free(balance.effort),
            rates: balance.rates,
        };
        let (mut q, mut qd) = (self.q, self.qd);
        let ledger = integrator::step(&mut q, &mut qd, h, &mass, &damping, first, |q, qd| {
            let at = self.arm.at(q);
            let balance = self.balance(&at, q, qd, &self.friction(qd));
            Slope {
                force: mass * self.acceleration(&self.total_mass(&at), &balance.effort),
                rates: balance.rates,
            }
        });
        (self.q, self.qd) = (q, qd);
        self.ledger += ledger;
        if self.brake.grip(self.qd[LIFT]) {
            self.stop_lift();
        }
    }

    /// Stops a gripped lift from its last millimetre per second by an impulse at the lift.
    fn stop_lift(&mut self) {
        let mass = self.total_mass(&self.arm.at(&self.q));
        let response = Factor::of(&mass).solve(&Vector4::ith(LIFT, 1.0));
        let impulse = -self.qd[LIFT] / response[LIFT];
        // The work of an impulse is at the mean of the speeds before and after.
        self.ledger[5] -= 0.5 * impulse * self.qd[LIFT];
        self.qd += response * impulse;
        self.qd[LIFT] = 0.0;
    }

    fn total_mass(&self, at: &Configuration) -> Matrix4<f64> {
        self.arm.mass_matrix(at) + self.drive.rotor_inertia()
    }

    /// The mass matrix, without the lift while the brake holds it.
    fn constrained(&self, mut mass: Matrix4<f64>) -> Matrix4<f64> {
        if self.brake.is_sticking() {
            mass.fill_row(LIFT, 0.0);
            mass.fill_column(LIFT, 0.0);
            mass[(LIFT, LIFT)] = 1.0;
        }
        mass
    }

    /// Efforts, without the one on the lift while the brake holds it.
    fn free(&self, mut effort: Vector4<f64>) -> Vector4<f64> {
        if self.brake.is_sticking() {
            effort[LIFT] = 0.0;
        }
        effort
    }

    fn acceleration(&self, mass: &Matrix4<f64>, effort: &Vector4<f64>) -> Vector4<f64> {
        Factor::of(&self.constrained(*mass)).solve(&self.free(*effort))
    }

    /// What a sticking brake must hold, N.
    fn effort_on_brake(&self, mass: &Matrix4<f64>, effort: &Vector4<f64>) -> f64 {
        effort[LIFT] - (mass * self.acceleration(mass, effort))[LIFT]
    }

    fn friction(&self, qd: &Vector4<f64>) -> Vector4<f64> {
        let mut friction = self.drive.friction(qd);
        friction[LIFT] += self.brake.sliding_friction(qd[LIFT]);
        friction
    }

    /// Friction over speed.
    fn damping(&self, qd: &Vector4<f64>) -> Vector4<f64> {
        let mut damping = self.drive.friction_secant(qd);
        damping[LIFT] += self.brake.sliding_secant(qd[LIFT]);
        damping
    }

    fn balance(
        &self,
        at: &Configuration,
        q: &Vector4<f64>,
        qd: &Vector4<f64>,
        friction: &Vector4<f64>,
    ) -> Balance {
        let speed = self.drive.to_motor(qd);
        let torque = self.given_torque(&speed);
        let (stop, into_springs) = self.stops.push(q, qd);
        let mut effort = self.drive.joint_effort(&torque) - self.arm.bias(at, qd) - friction + stop;
        self.defects.pull(&self.arm, at, &mut effort);
        let lost = friction.dot(qd) - stop.dot(qd) - into_springs;
        let rates = Rates::new(
            torque[0],
            torque[1],
            torque[2],
            torque[3],
            torque.dot(&speed),
            lost,
        );
        Balance { effort, rates }
    }

    fn given_torque(&self, motor_speed: &Vector4<f64>) -> Vector4<f64> {
        if self.torque_enabled {
            let given = self.drive.limited(&self.request, motor_speed);
            self.defects
                .torque(given, &self.model.drive.motor_torque_limit)
        } else {
            Vector4::zeros()
        }
    }

    /// Samples encoders and the mean torque since the last sample.
    pub fn latch(&mut self) -> Sample {
        let (since, before) = self.latched;
        let total: Vector4<f64> = self.ledger.fixed_rows::<4>(0).into();
        let motor_torque = if self.now > since {
            ((total - before) / ((self.now - since) as f64 * 1e-9)).into()
        } else {
            self.motor_torque()
        };
        self.latched = (self.now, total);
        Sample {
            counts: self.defects.read(self.encoder_counts(), self.now),
            motor_torque,
        }
    }

    /// Readings of the motor encoders, were they sound.
    pub fn encoder_counts(&self) -> [i32; 4] {
        <[f64; 4]>::from(self.drive.to_motor(&self.q)).map(|angle| self.encoder.counts(angle))
    }

    /// Time, ns.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// True joint positions, rad and m.
    pub fn q(&self) -> [f64; 4] {
        self.q.into()
    }

    /// True joint speeds, rad/s and m/s.
    pub fn qd(&self) -> [f64; 4] {
        self.qd.into()
    }

    /// True pose of the flange.
    pub fn pose(&self) -> Pose {
        self.arm.pose(&self.arm.at(&self.q))
    }

    /// Present motor torques, after all limits, N m.
    pub fn motor_torque(&self) -> [f64; 4] {
        self.given_torque(&self.drive.to_motor(&self.qd)).into()
    }

    /// Present efforts of the motors at the joints, after all limits, N m and N. The wrist bears the torque of the lift's nut as well.
    pub fn joint_effort(&self) -> [f64; 4] {
        self.drive.joint_effort(&self.motor_torque().into()).into()
    }

    /// The rigid arm with its payload.
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// The drives.
    pub fn drive(&self) -> &Drive {
        &self.drive
    }

    /// The brake of the lift.
    pub fn brake(&self) -> &Brake {
        &self.brake
    }

    /// The payload, if any.
    pub fn payload(&self) -> Option<&Payload> {
        self.payload.as_ref()
    }
}
