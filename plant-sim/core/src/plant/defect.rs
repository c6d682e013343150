//! Broken parts of the robot.

use nalgebra::{Vector3, Vector4};
use oorandom::Rand64;

use super::arm::{Arm, Configuration};
use super::{Payload, Plant};
use crate::maths::exp;

/// What is wrong with an encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncoderDefect {
    /// The reading does not change.
    Stuck,
    /// The reading follows with this time constant, s.
    Slow(f64),
    /// The reading is off by this much, rad or m of the joint.
    Jump(f64),
    /// The reading is off by up to this much, rad or m of the joint, anew in every sample.
    Noise(f64),
    /// The reading goes backwards from where it is.
    Reversed,
    /// This bit of the reading is always 0.
    BitLost(u32),
}

/// What is wrong with a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorDefect {
    /// It gives this share of the torque that it is asked for.
    Weak(f64),
    /// It gives its peak torque while torque is enabled.
    Runaway,
    /// It gives no torque, for want of power, and its drive says so.
    Dip,
}

/// What is wrong with the brake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BrakeDefect {
    /// It stays as it is.
    Stuck,
    /// It is open, whatever it is told.
    StuckOpen,
    /// It is closed, whatever it is told.
    StuckClosed,
    /// It takes so much longer, s.
    Slow(f64),
}

/// What is wrong with the payload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadDefect {
    /// It falls out of the gripper.
    Dropped,
    /// There is so much more of it, kg.
    Heavier(f64),
    /// A spring of this stiffness (N/m) holds the flange where it is.
    Caught(f64),
}

/// What is broken. Defects of the same part are in effect together, in the order in which they began.
#[derive(Clone, Debug, Default)]
pub(super) struct Defects {
    encoders: [Vec<BrokenEncoder>; 4],
    motors: [Vec<MotorDefect>; 4],
    brake: Vec<BrakeDefect>,
    /// While the brake is stuck: its last command, `true` to close.
    told: Option<bool>,
    /// What the flange carries besides its payload, kg.
    extra: Vec<f64>,
    springs: Vec<Spring>,
}

/// A spring between a place and the flange.
#[derive(Clone, Copy, Debug)]
struct Spring {
    stiffness: f64,
    /// Where it is slack, m in frame 0.
    at: Vector3<f64>,
}

#[derive(Clone, Debug)]
struct BrokenEncoder {
    defect: EncoderDefect,
    /// Reading when it broke.
    held: i32,
    /// Of a slow one: the last right reading, its time (ns), and how far behind it was, counts.
    last: i32,
    time: u64,
    lag: f64,
    /// Counts per rad or m of the joint.
    counts: f64,
    random: Rand64,
}

impl Plant {
    /// Breaks or repairs the encoder of `axis`; `seed` is that of its noise. What is broken besides stays so: the later defect acts on what
    /// the earlier one leaves of the reading.
    pub fn break_encoder(
        &mut self,
        axis: usize,
        defect: EncoderDefect,
        seed: u64,
        is_broken: bool,
    ) {
        let right = self.encoder_counts();
        let held = self.defects.read(right, self.now)[axis];
        let counts = self.encoder.counts_per_radian() * self.drive.ratio(axis);
        let broken = &mut self.defects.encoders[axis];
        // The same defect twice at once is not the same noise.
        let seed = (broken.len() as u128) << 72 | u128::from(seed) << 8 | axis as u128;
        let defect = BrokenEncoder {
            defect,
            held,
            last: held,
            time: self.now,
            lag: 0.0,
            counts,
            random: Rand64::new(seed),
        };
        set(
            broken,
            defect,
            |one, other| one.defect == other.defect,
            is_broken,
        );
    }

    /// Breaks or repairs the motor of `axis`.
    pub fn break_motor(&mut self, axis: usize, defect: MotorDefect, is_broken: bool) {
        set(
            &mut self.defects.motors[axis],
            defect,
            PartialEq::eq,
            is_broken,
        );
    }

    /// Breaks or repairs the brake. One that is repaired does what it was told last. Where it is stuck in several ways, it is where the last
    /// of them put it.
    pub fn break_brake(&mut self, defect: BrakeDefect, is_broken: bool) {
        let told = self.defects.told.unwrap_or(self.brake.is_engaged());
        let defects = &mut self.defects.brake;
        set(defects, defect, PartialEq::eq, is_broken);
        let slow = |defect: &BrakeDefect| match defect {
            BrakeDefect::Slow(seconds) => (seconds * 1e9).round() as u64,
            _ => 0,
        };
        self.brake.delay(defects.iter().map(slow).sum());
        let place = |defect: &BrakeDefect| match defect {
            BrakeDefect::StuckOpen => Some(false),
            BrakeDefect::StuckClosed => Some(true),
            BrakeDefect::Stuck | BrakeDefect::Slow(_) => None,
        };
        if let Some(closed) = defects.iter().rev().find_map(place) {
            self.brake.force(closed);
        }
        let is_stuck = |defect: &BrakeDefect| !matches!(defect, BrakeDefect::Slow(_));
        self.defects.told = defects.iter().any(is_stuck).then_some(told);
        self.set_brake(told);
    }

    /// Changes what the flange carries, or undoes it.
    pub fn disturb_load(&mut self, defect: LoadDefect, is_broken: bool) {
        match defect {
            LoadDefect::Dropped => {}
            LoadDefect::Heavier(kg) => {
                set(&mut self.defects.extra, kg, PartialEq::eq, is_broken);
                self.hold(self.payload);
            }
            LoadDefect::Caught(stiffness) => {
                let (at, _) = self.arm.flange(&self.arm.at(&self.q));
                let is_same = |one: &Spring, other: &Spring| one.stiffness == other.stiffness;
                let spring = Spring { stiffness, at };
                set(&mut self.defects.springs, spring, is_same, is_broken);
            }
        }
    }

    /// Whether a drive has no power.
    pub fn has_dip(&self) -> bool {
        let mut motors = self.defects.motors.iter();
        motors.any(|motor| motor.contains(&MotorDefect::Dip))
    }
}

/// Adds a defect to those of a part, or takes the first that is the same from them.
fn set<T>(defects: &mut Vec<T>, defect: T, is_same: impl Fn(&T, &T) -> bool, is_broken: bool) {
    if is_broken {
        defects.push(defect);
    } else if let Some(at) = defects.iter().position(|other| is_same(other, &defect)) {
        defects.remove(at);
    }
}

impl Defects {
    /// Readings of the encoders instead of the right ones.
    pub(super) fn read(&mut self, mut counts: [i32; 4], now: u64) -> [i32; 4] {
        for (reading, broken) in counts.iter_mut().zip(&mut self.encoders) {
            for broken in broken {
                *reading = broken.read(*reading, now);
            }
        }
        counts
    }

    /// Torques of the motors instead of those that sound ones would give; `peak` are the greatest. A motor that runs away and is weak
    /// gives that share of its peak, and none of it without power.
    pub(super) fn torque(&self, mut torque: Vector4<f64>, peak: &[f64; 4]) -> Vector4<f64> {
        for (axis, motor) in self.motors.iter().enumerate() {
            if motor.contains(&MotorDefect::Runaway) {
                torque[axis] = peak[axis];
            }
            for defect in motor {
                match defect {
                    MotorDefect::Dip => torque[axis] = 0.0,
                    MotorDefect::Weak(share) => torque[axis] *= share,
                    MotorDefect::Runaway => {}
                }
            }
        }
        torque
    }

    /// Whether a command of the brake gets through; one that does not is remembered.
    pub(super) fn brake_follows(&mut self, engaged: bool) -> bool {
        match &mut self.told {
            None => true,
            Some(last) => {
                *last = engaged;
                false
            }
        }
    }
}

impl Defects {
    /// What the flange carries in truth, of a payload that is all that was meant.
    pub(super) fn burden(&self, payload: Option<Payload>) -> Option<Payload> {
        burdened(payload, self.extra.iter().sum())
    }

    /// Adds the efforts of the spring at the joints.
    pub(super) fn pull(&self, arm: &Arm, at: &Configuration, effort: &mut Vector4<f64>) {
        for spring in &self.springs {
            let force = (spring.at - arm.flange(at).0) * spring.stiffness;
            *effort += arm.jacobian(at).fixed_rows::<3>(0).transpose() * force;
        }
    }

    /// Energy in the spring, J.
    pub(super) fn elastic(&self, arm: &Arm, at: &Configuration) -> f64 {
        let energy = |spring: &Spring| {
            let by = arm.flange(at).0 - spring.at;
            0.5 * spring.stiffness * by.dot(&by)
        };
        self.springs.iter().map(energy).sum()
    }
}

/// A payload that is heavier by `extra` (kg): the same body, denser, or a point at the flange where there is none.
pub fn burdened(payload: Option<Payload>, extra: f64) -> Option<Payload> {
    match payload {
        payload if extra == 0.0 => payload,
        Some(Payload { mass, com, inertia }) if mass > 0.0 => Some(Payload {
            mass: mass + extra,
            com,
            inertia: inertia.map(|moment| moment * (mass + extra) / mass),
        }),
        _ => Some(Payload {
            mass: extra,
            com: [0.0; 3],
            inertia: [0.0; 3],
        }),
    }
}

impl BrokenEncoder {
    fn read(&mut self, right: i32, now: u64) -> i32 {
        let off = |joint: f64| right.wrapping_add((joint * self.counts).round() as i64 as i32);
        match self.defect {
            EncoderDefect::Stuck => self.held,
            EncoderDefect::Slow(constant) => {
                let passed = (now - self.time) as f64 * 1e-9;
                let way = f64::from(right.wrapping_sub(self.last));
                (self.last, self.time) = (right, now);
                if constant == 0.0 {
                    self.lag = 0.0;
                } else if passed > 0.0 {
                    // Exact for a speed that does not change meanwhile.
                    let left = exp(-passed / constant);
                    self.lag = self.lag * left + way / passed * constant * (1.0 - left);
                }
                right.wrapping_sub(self.lag.round() as i64 as i32)
            }
            EncoderDefect::Jump(by) => off(by),
            EncoderDefect::Noise(most) => off(most * (2.0 * self.random.rand_float() - 1.0)),
            EncoderDefect::Reversed => self.held.wrapping_sub(right.wrapping_sub(self.held)),
            EncoderDefect::BitLost(bit) => right & !(1_i32 << bit),
        }
    }
}
