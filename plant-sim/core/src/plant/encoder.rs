//! Multiturn absolute encoders on the motor shafts.

use std::f64::consts::TAU;

/// An encoder of finite resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    counts_per_turn: f64,
}

impl Encoder {
    /// An encoder with this many counts per turn of the motor.
    pub fn new(counts_per_turn: u32) -> Self {
        Self {
            counts_per_turn: f64::from(counts_per_turn),
        }
    }

    /// Reading at a motor angle (rad): the nearest count, so off by half a count at most.
    ///
    /// The reading is a 32-bit register, which wraps; at 17 bits per turn that is after 16384 turns in each
    /// direction.
    pub fn counts(&self, angle: f64) -> i32 {
        (angle / TAU * self.counts_per_turn).round() as i64 as i32
    }

    /// Counts per radian of the motor.
    pub(super) fn counts_per_radian(&self) -> f64 {
        self.counts_per_turn / TAU
    }

    /// Motor angle (rad) at the middle of a count.
    pub fn angle(&self, counts: i32) -> f64 {
        f64::from(counts) * TAU / self.counts_per_turn
    }
}
