//! Heat of the motors: the mean square of the effort of each joint (I2t), as a share of what it may be for ever.
//!
//! Moves begin more slowly the warmer the warmest is, so that a cycle that asks for too much settles at the pace that can be kept up. The
//! effort of a motion goes with the square of its pace and the heat with the square of that: a little slower is much cooler.

use nalgebra::Vector4;

use crate::mechanics::arm::Axis;
use crate::mechanics::math::clamp;

/// Heat from which on moves begin more slowly.
pub const WARM: f32 = 0.9;
/// Heat at which they are as slow as they get.
const HOT: f32 = 1.0;
/// Least pace for want of cooling. A motor that is too hot even so holds a load that is too heavy.
pub const LEAST_PACE: f32 = 0.3;

/// Heat of the motors: of some samples in a row, now and then.
#[derive(Clone, Copy, Debug)]
pub struct Heat {
    /// Mean square of the effort over the continuous one.
    shares: Vector4<f32>,
}

impl Heat {
    /// Motors that have not done anything for long.
    pub fn new() -> Self {
        Self {
            shares: Vector4::zeros(),
        }
    }

    /// Heat of each motor: 1 is what it may have for ever.
    pub fn shares(&self) -> &Vector4<f32> {
        &self.shares
    }

    /// Accounts for a part of the time constant in which the torques were like these four, N m (lift N), each for a quarter of it. Returns
    /// the warmest axis.
    pub fn account(
        &mut self,
        [a, b, c, d]: &[Vector4<f32>; 4],
        continuous: &Vector4<f32>,
        part: f32,
    ) -> (Axis, f32) {
        let square = |torque: &Vector4<f32>| torque.component_mul(torque);
        let mean = (square(a) + square(b) + square(c) + square(d)) * 0.25;
        // What four steps of a quarter leave of what there was is (1 - quarter)^4.
        let quarter = clamp(0.25 * part, 0.0, 1.0);
        let rest = 1.0 - quarter;
        let change = quarter * (1.0 + rest) * (1.0 + rest * rest);
        self.shares += (mean.component_div(&square(continuous)) - self.shares) * change;
        let mut warmest = (Axis::Shoulder, 0.0);
        for axis in Axis::ALL {
            let share = axis.of(&self.shares);
            if share > warmest.1 {
                warmest = (axis, share);
            }
        }
        warmest
    }
}

/// Pace at which moves may begin when the warmest motor has this heat.
pub fn pace(heat: f32) -> f32 {
    let slower = (heat - WARM) / (HOT - WARM) * (1.0 - LEAST_PACE);
    clamp(1.0 - slower, LEAST_PACE, 1.0)
}

impl Default for Heat {
    fn default() -> Self {
        Self::new()
    }
}
