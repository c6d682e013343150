//! Offset of a tool from its target.

use std::f64::consts::TAU;

use crate::maths::{remainder, square};

/// Offset of a tool from its target; neither part is negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset {
    /// m.
    pub position: f64,
    /// rad, the shorter way round.
    pub yaw: f64,
}

impl Offset {
    /// So far (m), and so far turned (rad).
    pub const fn new(position: f64, yaw: f64) -> Self {
        Self { position, yaw }
    }

    /// Between two poses x, y, z (m), yaw (rad).
    pub fn between([x, y, z, yaw]: &[f64; 4], to: &[f64; 4]) -> Self {
        Self {
            position: (square(x - to[0]) + square(y - to[1]) + square(z - to[2])).sqrt(),
            yaw: remainder(yaw - to[3], TAU).abs(),
        }
    }

    /// Whether neither part is greater than that of `radius`.
    pub fn is_within(self, radius: Self) -> bool {
        self.position <= radius.position && self.yaw <= radius.yaw
    }
}
