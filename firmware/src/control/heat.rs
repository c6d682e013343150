//! Heat of the motors: the mean square of the effort of each joint (I2t), as a share of what it may be for ever.
//!
//! Moves begin more slowly the warmer the warmest is, so that a cycle that asks for too much settles at the pace that can be kept up. The
//! effort of a motion goes with the square of its pace and the heat with the square of that: a little slower is much cooler.

use nalgebra::Vector4;

use crate::mechanics::arm::Axis;
use crate::mechanics::math::clamp;

/// Heat from which on moves begin more slowly, and at which they are as slow as they get.
const WARM: f32 = 0.9;
const HOT: f32 = 1.0;
/// Least pace for want of cooling. A motor that is too hot even so holds a load that is too heavy.
const LEAST_PACE: f32 = 0.3;

/// Heat of the motors.
#[derive(Clone, Copy, Debug)]
pub struct Heat {
    /// Squares of the efforts since the last account, and how many.
    squares: Vector4<f32>,
    samples: u32,
    /// Mean square of the effort over the continuous one.
    shares: Vector4<f32>,
}

impl Heat {
    /// Motors that have not done anything for long.
    pub fn new() -> Self {
        Self {
            squares: Vector4::zeros(),
            samples: 0,
            shares: Vector4::zeros(),
        }
    }

    /// Heat of each motor: 1 is what it may have for ever.
    pub fn shares(&self) -> &Vector4<f32> {
        &self.shares
    }

    /// Takes the efforts of a sample, N m (lift N).
    pub fn add(&mut self, effort: &Vector4<f32>) {
        self.squares += effort.component_mul(effort);
        self.samples = self.samples.saturating_add(1);
    }

    /// Accounts for what was taken since the last time; `part` is a sample's share of the time constant. Returns the warmest axis.
    pub fn account(&mut self, continuous: &Vector4<f32>, part: f32) -> (Axis, f32) {
        let samples = self.samples as f32;
        let passed = clamp(samples * part, 0.0, 1.0);
        let mut warmest = (Axis::Shoulder, 0.0);
        for axis in Axis::ALL {
            let continuous = axis.of(continuous);
            let mean = axis.of(&self.squares) / (continuous * continuous * samples);
            let share = axis.of_mut(&mut self.shares);
            *share += (mean - *share) * passed;
            if *share > warmest.1 {
                warmest = (axis, *share);
            }
        }
        (self.squares, self.samples) = (Vector4::zeros(), 0);
        warmest
    }
}

/// Pace at which moves may begin when the warmest motor has this heat.
pub fn pace(heat: f32) -> f32 {
    clamp((HOT - heat) / (HOT - WARM), LEAST_PACE, 1.0)
}

impl Default for Heat {
    fn default() -> Self {
        Self::new()
    }
}
