//! Broken parts of the robot.

use nalgebra::Vector4;
use oorandom::Rand64;

use super::Plant;

/// What is wrong with an encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncoderDefect {
    /// The reading does not change.
    Stuck,
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
}

/// What is broken.
#[derive(Clone, Debug, Default)]
pub(super) struct Defects {
    encoders: [Option<BrokenEncoder>; 4],
    motors: [Option<MotorDefect>; 4],
    /// While the brake is stuck: its last command, `true` to close.
    brake: Option<bool>,
}

#[derive(Clone, Debug)]
struct BrokenEncoder {
    defect: EncoderDefect,
    /// Reading when it broke.
    held: i32,
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
            counts,
            random: Rand64::new(u128::from(seed) << 8 | axis as u128),
        });
    }

    /// Breaks or repairs the motor of `axis`.
    pub fn break_motor(&mut self, axis: usize, defect: Option<MotorDefect>) {
        self.defects.motors[axis] = defect;
    }

    /// Blocks the brake in its present position, or lets it follow its last command again.
    pub fn break_brake(&mut self, is_stuck: bool) {
        if is_stuck {
            self.defects.brake = Some(self.brake.is_engaged());
        } else if let Some(engaged) = self.defects.brake.take() {
            self.set_brake(engaged);
        }
    }
}

impl Defects {
    /// Readings of the encoders instead of the right ones.
    pub(super) fn read(&mut self, mut counts: [i32; 4]) -> [i32; 4] {
        for (reading, broken) in counts.iter_mut().zip(&mut self.encoders) {
            if let Some(broken) = broken {
                *reading = broken.read(*reading);
            }
        }
        counts
    }

    /// Torques of the motors instead of those that sound ones would give; `peak` are the greatest.
    pub(super) fn torque(&self, mut torque: Vector4<f64>, peak: &[f64; 4]) -> Vector4<f64> {
        for (axis, motor) in self.motors.iter().enumerate() {
            match motor {
                None => {}
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

impl BrokenEncoder {
    fn read(&mut self, right: i32) -> i32 {
        let off = |joint: f64| right.wrapping_add((joint * self.counts).round() as i64 as i32);
        match self.defect {
            EncoderDefect::Stuck => self.held,
            EncoderDefect::Jump(by) => off(by),
            EncoderDefect::Noise(most) => off(most * (2.0 * self.random.rand_float() - 1.0)),
            EncoderDefect::Reversed => self.held.wrapping_sub(right.wrapping_sub(self.held)),
            EncoderDefect::BitLost(bit) => right & !(1_i32 << bit),
        }
    }
}
