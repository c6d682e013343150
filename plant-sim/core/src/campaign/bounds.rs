//! How far, fast and deep the arm may go, from the robot's own limits and from the parameters that docs/protocol.md promises.
//!
//! | bound | where from |
//! |---|---|
//! | no motor is asked for more than its peak torque, and for none while torque is not enabled | model |
//! | an axis off its reference, too fast or out of its range is reported at the 4th sample in a row | default parameters: three samples, and one to answer |
//! | in manual operation a tool faster than 250 mm/s is reported at the 4th sample in a row | ISO 10218-1; a tool is whatever lies within 100 mm of the axis of the flange |
//! | and it is nowhere faster than that and what the greatest torques add to it in 8 samples, and free fall in the 30 ms of the brake | until then a fault may drive the arm |
//! | but where an encoder is stuck or slow, 700 mm/s; where one is reversed, 1.2 m/s, from 1 kHz on 800 mm/s; both from 500 Hz on | nothing else tells its speed, and the loop is slow in manual operation: measured, `tests/stance.rs` |
//! | torque is off 0.7 s after a fault was reported, with 22 kg | 1.25 times the time in which the slowest axis of the stretched arm stops from full speed with the torque that its weight leaves, and the time of the brake |
//! | a brake that stays open is reported 60 ms and 8 samples after it was to close | the time of the brake, and of two controllers' answers |
//! | while torque is on after that, the tool travels no further than at its greatest speed for the time of such a stop | the same |
//! | no kinetic energy beyond that of all axes at 1.1 times their speed limit | the monitor's speed limit |
//! | once torque is off, no kinetic energy but from the weight of the lift | nothing else drives the arm |
//! | the lift goes down no further than under the greatest torque for 8 samples, in free fall for 30 ms, and what brake or motor need to stop it | the drives hold the last torque; the brake closes in 30 ms |
//! | after standstill nothing moves by a tenth of a millimetre | what stands, stands |

use nalgebra::{Vector4, Vector6};
use protocol::messages::{Command, ControlWord};
use protocol::time::Duration;

use crate::maths::hypot;
use crate::model::{Payload, RobotModel};
use crate::observer::Truth;
use crate::plant::arm::{Arm, Configuration};
use crate::plant::brake::Brake;
use crate::plant::drive::Drive;
use crate::plant::factor::Factor;
use crate::plant::stop::EndStops;

const LIFT: usize = 2;
/// The place of the tool among the kinds of limits.
const TOOL: usize = 3;

/// Following error of an axis that stops the arm: rad, rad, m, rad.
pub const FOLLOWING_ERROR: [f64; 4] = [0.05, 0.05, 0.01, 0.2];
/// How far past its range an axis may go.
const RANGE_MARGIN: [f64; 4] = [0.02, 0.02, 0.002, 0.05];
/// Speed that stops the arm, as a multiple of the axis' limit.
const SPEED_FACTOR: f64 = 1.1;
/// Consecutive samples beyond a limit until it is reported, the sample of the answer included.
const SAMPLES_TO_REPORT: u32 = 4;
/// From a report until the brake is told at the latest: the drives hold a command for 5 samples, and 5 ms at least, and a stop that an axis
/// does not follow is given up at the 4th sample.
fn to_brake_s(period: f64) -> f64 {
    (5.0 * period).max(0.005) + 3.0 * period
}
/// For a stop that uses 0.95 of the torque, builds it up at half its rate, and has more axes to stop than one.
const STOP_MARGIN: f64 = 1.25;
/// The brake closes within this, s.
const BRAKE_S: f64 = 0.03;
/// The controller waits this long for the brake, s.
const BRAKE_WAIT_S: f64 = 0.06;
/// Speed of the tool in manual operation, m/s, at every point within so many m of the axis of the flange.
const TOOL_SPEED: f64 = 0.25;
const TOOL_REACH: f64 = 0.1;
/// The same where a reading is wrong, and where it is reversed below 1 kHz and above; not below the rate.
const MISREAD_SPEED: f64 = 0.7;
const REVERSED_SPEED: [f64; 2] = [1.2, 0.8];
const MISREAD_PERIOD: f64 = 1.0 / 500.0 * (1.0 + ROUNDING);
const QUICK_PERIOD: f64 = 1.0 / 1000.0 * (1.0 + ROUNDING);
/// Movement of a standing axis that does not count, rad and m.
pub const STANDING: f64 = 1e-4;
/// Rounding of f32 and of the integrator.
const ROUNDING: f64 = 1e-4;

/// What the encoders show of the arm, the worst last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reading {
    /// Where it is, or a step that is told at once.
    Right,
    /// Where it is, with a noise that a sound encoder does not have.
    Noisy,
    /// How one of its axes moved a while ago, that it does not, or some of both.
    Wrong,
    /// The way of one of its axes backwards.
    Reversed,
}

/// Bounds for one robot and its payload.
#[derive(Clone, Debug)]
pub struct Bounds {
    model: RobotModel,
    arm: Arm,
    drive: Drive,
    stops: EndStops,
    payload: f64,
    period: f64,
    is_manual: bool,
}

impl Bounds {
    /// The bounds for `model`, sampled every `period` seconds, with nothing in the gripper, in automatic operation.
    pub fn new(model: &RobotModel, period: f64) -> Self {
        let (arm, drive) = (Arm::new(model, None), Drive::new(&model.drive));
        let stretched = arm.mass_matrix(&arm.at(&Vector4::zeros())) + drive.rotor_inertia();
        Self {
            model: model.clone(),
            arm,
            drive,
            stops: EndStops::new(&model.limits, &stretched.diagonal()),
            payload: 0.0,
            period,
            is_manual: false,
        }
    }

    /// The same in manual operation, or not.
    pub fn in_manual_operation(self, is_manual: bool) -> Self {
        Self { is_manual, ..self }
    }

    /// Takes a payload into account. One that falls out of the gripper still counts: it falls on something.
    pub fn carry(&mut self, payload: &Payload) {
        self.arm = Arm::new(&self.model, Some(payload));
        self.payload = payload.mass;
    }

    /// Whether the motors may be asked for the torques of this command: for none while torque is not enabled.
    pub fn allows_torque(
        &self,
        Command {
            control, torque, ..
        }: &Command,
    ) -> bool {
        if !control.contains(ControlWord::TORQUE_ENABLE) {
            return *torque == [0.0; 4];
        }
        let limits = self.model.drive.motor_torque_limit;
        let mut both = torque.iter().zip(limits);
        both.all(|(asked, limit)| f64::from(asked.abs()) <= limit * (1.0 + ROUNDING))
    }

    /// Whether an axis has been off its reference, too fast, or out of its range for so many samples in a row that it has to have been
    /// reported; `counts` counts them.
    pub fn is_long_beyond(&self, counts: &mut [u32; 4], truth: &Truth, reading: Reading) -> bool {
        let Truth { plant, mind } = truth;
        let mut beyond = self.is_beyond(&plant.q, &plant.qd, &mind.q);
        // Of the tool only the encoders tell.
        beyond[TOOL] &= reading == Reading::Right || self.period > MISREAD_PERIOD;
        for (count, is_beyond) in counts.iter_mut().zip(beyond) {
            *count = if is_beyond { *count + 1 } else { 0 };
        }
        counts.iter().any(|count| *count > SAMPLES_TO_REPORT)
    }

    /// Whether an axis is off its reference, too fast, or out of its range, or the tool too fast.
    fn is_beyond(&self, q: &[f64; 4], qd: &[f64; 4], reference: &[f64; 4]) -> [bool; 4] {
        let limits = &self.model.limits;
        let any = |of: &dyn Fn(usize) -> bool| (0..4).any(of);
        [
            // The reference is as old as the sample before: a sample at full speed is allowed for.
            any(&|i| {
                let moved = SPEED_FACTOR * limits.velocity[i] * self.period;
                (reference[i] - q[i]).abs() > FOLLOWING_ERROR[i] + moved
            }),
            any(&|i| qd[i].abs() > limits.velocity[i] * SPEED_FACTOR * (1.0 + ROUNDING)),
            any(&|i| {
                let room = RANGE_MARGIN[i] + ROUNDING;
                !(limits.lower[i] - room..=limits.upper[i] + room).contains(&q[i])
            }),
            self.is_manual && self.tool_speed(q, qd) > TOOL_SPEED * (1.0 + ROUNDING),
        ]
    }

    /// Speed of the fastest point that may be one of the tool, m/s.
    pub fn tool_speed(&self, q: &[f64; 4], qd: &[f64; 4]) -> f64 {
        let at = self.arm.at(&Vector4::from(*q));
        tool_speed(&self.arm.twist(&at, &Vector4::from(*qd)))
    }

    /// The greatest speed of the tool where it may be told too late, as the encoders show another.
    fn misread_speed(&self, reading: Reading) -> Option<f64> {
        let [slow, quick] = REVERSED_SPEED;
        match reading {
            _ if self.period > MISREAD_PERIOD => None,
            Reading::Right | Reading::Noisy => None,
            Reading::Wrong => Some(MISREAD_SPEED),
            Reading::Reversed if self.period > QUICK_PERIOD => Some(slow),
            Reading::Reversed => Some(quick),
        }
    }

    /// Whether the tool is faster than a fault may make it until the arm is stopped.
    pub fn is_tool_too_fast(&self, q: &[f64; 4], qd: &[f64; 4], reading: Reading) -> bool {
        let excess = if self.is_manual {
            self.tool_speed(q, qd) - TOOL_SPEED
        } else {
            0.0
        };
        if excess <= 0.0 {
            return false;
        }
        if let Some(greatest) = self.misread_speed(reading) {
            return excess > greatest - TOOL_SPEED;
        }
        let at = self.arm.at(&Vector4::from(*q));
        let inertia = Factor::of(&(self.arm.mass_matrix(&at) + self.drive.rotor_inertia()));
        let motors = Vector4::from(self.model.drive.motor_torque_limit);
        let effort = self.drive.joint_effort(&motors);
        let driven = |signs: u32| {
            let signed = Vector4::from_fn(|i, _| {
                if signs >> i & 1 == 0 {
                    effort[i]
                } else {
                    -effort[i]
                }
            });
            tool_speed(&self.arm.twist(&at, &inertia.solve(&signed)))
        };
        let greatest = (0..8).map(driven).fold(0.0, f64::max);
        excess > greatest * to_brake_s(self.period) + self.model.gravity.max(0.0) * BRAKE_S
    }

    /// Kinetic energy of arm, rotors and payload, J.
    pub fn energy(&self, q: &[f64; 4], qd: &[f64; 4]) -> f64 {
        self.energy_at(&self.arm.at(&Vector4::from(*q)), qd)
    }

    fn energy_at(&self, at: &Configuration, qd: &[f64; 4]) -> f64 {
        let qd = Vector4::from(*qd);
        let rotors = 0.5 * qd.dot(&(self.drive.rotor_inertia() * qd));
        self.arm.kinetic_energy(at, &qd) + rotors
    }

    /// Energy in the springs of the end stops, J.
    pub fn elastic(&self, q: &[f64; 4]) -> f64 {
        self.stops.energy(&Vector4::from(*q))
    }

    /// Whether this is more kinetic energy (J) than the speed limits allow at this pose.
    pub fn is_too_fast(&self, q: &[f64; 4], energy: f64) -> bool {
        let at = self.arm.at(&Vector4::from(*q));
        let speed = self.model.limits.velocity.map(|limit| SPEED_FACTOR * limit);
        let signed = |signs: u32| {
            let qd = std::array::from_fn(|i| {
                if signs >> i & 1 == 0 {
                    speed[i]
                } else {
                    -speed[i]
                }
            });
            self.energy_at(&at, &qd)
        };
        // The opposite of all four has the same energy. Most often the first is enough.
        (0..8).all(|signs| energy > signed(signs))
    }

    /// Energy that the moving part of the lift sets free on its way from `high` to `low` (m, downwards positive), J.
    pub fn weight_work(&self, high: f64, low: f64) -> f64 {
        (self.lifted() * self.model.gravity * (low - high)).max(0.0)
    }

    /// Longest time from a report until torque is off, s.
    pub fn torque_off_s(&self) -> f64 {
        self.stop_s() + BRAKE_WAIT_S + to_brake_s(self.period)
    }

    /// Longest time from the command to close the brake until one that stays open is reported.
    pub fn brake_told(&self) -> Duration {
        Duration::from_seconds(BRAKE_WAIT_S + to_brake_s(self.period))
    }

    /// Longest time of a controlled stop, s.
    pub fn stop_s(&self) -> f64 {
        let limits = &self.model.limits;
        let stretched = self.arm.at(&Vector4::zeros());
        let inertia = self.arm.mass_matrix(&stretched) + self.drive.rotor_inertia();
        let weight = self.arm.gravity(&stretched);
        let motors = self
            .drive
            .joint_effort(&Vector4::from(self.model.drive.motor_torque_limit));
        let axis = |i: usize| {
            let most = limits.effort[i].min(motors[i]);
            let torque = (most - weight[i].abs()).max(0.0) / inertia[(i, i)];
            let cap = limits.acceleration.map_or(f64::INFINITY, |cap| cap[i]);
            let slowing = torque.min(cap);
            let jerk = limits.jerk.map_or(f64::INFINITY, |cap| cap[i]);
            let rise = limits.effort_rise_time[i].max(slowing / jerk);
            limits.velocity[i] / slowing + rise
        };
        STOP_MARGIN * (0..4).map(axis).fold(0.0, f64::max)
    }

    /// How far the lift may go down that moves down at `speed` (m/s) when its fault is reported, m.
    pub fn drop(&self, speed: f64) -> f64 {
        let gravity = self.model.gravity.max(0.0);
        let effort = self.model.limits.effort[LIFT];
        let mass = self.lifted() + self.drive.rotor_inertia()[(LIFT, LIFT)];
        let weight = self.lifted() * gravity;
        // The last torque that was commanded may be the greatest, downwards.
        let driven = effort + weight;
        let (held, fastest) = fall(speed.max(0.0), driven / mass, to_brake_s(self.period));
        let (fallen, fastest) = fall(fastest, gravity, BRAKE_S);
        // The weaker of the two that can stop it.
        let holding = effort.min(Brake::new(effort).capacity());
        let slowing = (holding - weight) / mass;
        held + fallen + fastest * fastest / (2.0 * slowing)
    }

    /// Mass that goes up and down, kg.
    fn lifted(&self) -> f64 {
        self.model.links[2].mass + self.model.links[3].mass + self.payload
    }
}

/// Speed of the fastest point of the tool where the flange has this velocity.
fn tool_speed(flange: &Vector6<f64>) -> f64 {
    hypot(
        hypot(flange[0], flange[1]) + TOOL_REACH * flange[5].abs(),
        flange[2],
    )
}

/// Way and speed after `time` at this acceleration.
fn fall(speed: f64, acceleration: f64, time: f64) -> (f64, f64) {
    let way = speed * time + 0.5 * acceleration * time * time;
    (way, speed + acceleration * time)
}
