//! Heat of the motors: the mean square of the effort of each joint (I2t), as a share of what it may be for ever.
//!
//! One axis is looked at in each sample, in turn: a motor warms up in seconds. Moves begin more slowly the warmer the warmest is, so that a
//! cycle that asks for too much settles at the pace that can be kept up. The effort of a motion goes with the square of its pace and the heat
//! with the square of that, which is why a little slower is much cooler.

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
    /// Mean square of the effort over the continuous one.
    shares: Vector4<f32>,
    next: Axis,
}

impl Heat {
    /// Motors that have not done anything for long.
    pub fn new() -> Self {
        Self {
            shares: Vector4::zeros(),
            next: Axis::Shoulder,
        }
    }

    /// Heat of each motor: 1 is what it may have for ever.
    pub fn shares(&self) -> &Vector4<f32> {
        &self.shares
    }

    /// Looks at one axis: `effort` and `continuous` are N m (lift N), `part` is a sample's share of the time constant. Returns the axis and its heat.
    pub fn update(
        &mut self,
        effort: &Vector4<f32>,
        continuous: &Vector4<f32>,
        part: f32,
    ) -> (Axis, f32) {
        let axis = self.next;
        let share = axis.of(effort) / axis.of(continuous);
        let heat = axis.of_mut(&mut self.shares);
        // The sample stands for the three others as well.
        *heat += (share * share - *heat) * clamp(4.0 * part, 0.0, 1.0);
        self.next = axis.next();
        (axis, *heat)
    }

    /// Pace at which moves may begin.
    pub fn pace(&self) -> f32 {
        let cooler = (HOT - self.shares.max()) / (HOT - WARM);
        clamp(cooler, LEAST_PACE, 1.0)
    }
}

impl Default for Heat {
    fn default() -> Self {
        Self::new()
    }
}
