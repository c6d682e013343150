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

/// What is broken.
#[derive(Clone, Debug, Default)]
pub(super) struct Defects {
    encoders: [Option<BrokenEncoder>; 4],
    motors: [Option<MotorDefect>; 4],
    /// While the brake is stuck: its last command, `true` to close.
    brake: Option<bool>,
    /// What the flange carries besides its payload, kg.
    extra: f64,
    spring: Option<Spring>,
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
    /// Breaks or repairs the encoder of `axis`; `seed` is that of its noise.
    pub fn break_encoder(&mut self, axis: usize, defect: Option<EncoderDefect>, seed: u64) {
        let held = self.encoder_counts()[axis];
        let counts = self.encoder.counts_per_radian() * self.drive.ratio(axis);
        self.defects.encoders[axis] = defect.map(|defect| BrokenEncoder {
            defect,
            held,
            last: held,
            time: self.now,
            lag: 0.0,
            counts,
            random: Rand64::new(u128::from(seed) << 8 | axis as u128),
        });
    }

    /// Breaks or repairs the motor of `axis`.
    pub fn break_motor(&mut self, axis: usize, defect: Option<MotorDefect>) {
        self.defects.motors[axis] = defect;
    }

    /// Breaks or repairs the brake. One that is repaired does what it was told last.
    pub fn break_brake(&mut self, defect: Option<BrakeDefect>) {
        let told = self.defects.brake.unwrap_or(self.brake.is_engaged());
        self.brake.delay(match defect {
            Some(BrakeDefect::Slow(seconds)) => (seconds * 1e9).round() as u64,
            _ => 0,
        });
        match defect {
            Some(BrakeDefect::StuckOpen) => self.brake.force(false),
            Some(BrakeDefect::StuckClosed) => self.brake.force(true),
            Some(BrakeDefect::Stuck | BrakeDefect::Slow(_)) | None => {}
        }
        let is_stuck = !matches!(defect, Some(BrakeDefect::Slow(_)) | None);
        self.defects.brake = is_stuck.then_some(told);
        self.set_brake(told);
    }

    /// Changes what the flange carries, or undoes it.
    pub fn disturb_load(&mut self, defect: LoadDefect, is_broken: bool) {
        match defect {
            LoadDefect::Dropped => {}
            LoadDefect::Heavier(kg) => {
                self.defects.extra = if is_broken { kg } else { 0.0 };
                self.hold(self.payload);
            }
            LoadDefect::Caught(stiffness) => {
                let (at, _) = self.arm.flange(&self.arm.at(&self.q));
                self.defects.spring = is_broken.then_some(Spring { stiffness, at });
            }
        }
    }

    /// Whether a drive has no power.
    pub fn has_dip(&self) -> bool {
        self.defects.motors.contains(&Some(MotorDefect::Dip))
    }
}

impl Defects {
    /// Readings of the encoders instead of the right ones.
    pub(super) fn read(&mut self, mut counts: [i32; 4], now: u64) -> [i32; 4] {
        for (reading, broken) in counts.iter_mut().zip(&mut self.encoders) {
            if let Some(broken) = broken {
                *reading = broken.read(*reading, now);
            }
        }
        counts
    }

    /// Torques of the motors instead of those that sound ones would give; `peak` are the greatest.
    pub(super) fn torque(&self, mut torque: Vector4<f64>, peak: &[f64; 4]) -> Vector4<f64> {
        for (axis, motor) in self.motors.iter().enumerate() {
            match motor {
                None => {}
                Some(MotorDefect::Dip) => torque[axis] = 0.0,
                Some(MotorDefect::Weak(share)) => torque[axis] *= share,
                Some(MotorDefect::Runaway) => torque[axis] = peak[axis],
            }
        }
        torque
    }

    /// Whether a command of the brake gets through; one that does not is remembered.
    pub(super) fn brake_follows(&mut self, engaged: bool) -> bool {
        match &mut self.brake {
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
        burdened(payload, self.extra)
    }

    /// Adds the efforts of the spring at the joints.
    pub(super) fn pull(&self, arm: &Arm, at: &Configuration, effort: &mut Vector4<f64>) {
        if let Some(spring) = self.spring {
            let force = (spring.at - arm.flange(at).0) * spring.stiffness;
            *effort += arm.jacobian(at).fixed_rows::<3>(0).transpose() * force;
        }
    }

    /// Energy in the spring, J.
    pub(super) fn elastic(&self, arm: &Arm, at: &Configuration) -> f64 {
        self.spring.map_or(0.0, |spring| {
            0.5 * spring.stiffness * (arm.flange(at).0 - spring.at).norm_squared()
        })
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
