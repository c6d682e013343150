//! Torques that swing from sample to sample, as those of a loop do whose gains are too high for its delay or for its encoders.
//!
//! A planned torque and what corrects it change evenly over some samples; the second difference of a torque that swings to both sides of its
//! mean by `a` in every other sample is 4 `a`.

use nalgebra::Vector4;

use super::fault::CHATTER_PERCENT;
use crate::mechanics::arm::Axis;

/// Samples over which swings are averaged.
const SAMPLES: f32 = 50.0;
/// Period (s) from which on more swing is allowed, in proportion: in a longer one a planned torque changes by more.
const SHORT: f32 = 1e-3;

/// Watches torques for chatter.
#[derive(Clone, Copy, Debug)]
pub struct Chatter {
    last: Vector4<f32>,
    change: Vector4<f32>,
    mean: f32,
}

impl Chatter {
    /// A watch that has seen nothing.
    pub fn new() -> Self {
        Self {
            last: Vector4::zeros(),
            change: Vector4::zeros(),
            mean: 0.0,
        }
    }

    /// Looks at the motor torques of one more sample of `period` seconds, N m. Returns the axis and the mean swing (%) once that is too much.
    pub fn update(
        &mut self,
        torque: &Vector4<f32>,
        limit: &Vector4<f32>,
        period: f32,
    ) -> Option<(Axis, f32)> {
        let change = torque - self.last;
        let swings = (change - self.change).abs().component_div(limit);
        (self.last, self.change) = (*torque, change);
        self.mean += (swings.sum() - self.mean) * (1.0 / SAMPLES);
        let percent = self.mean * 100.0 * (SHORT / period).min(1.0);
        if percent <= f32::from(CHATTER_PERCENT) {
            return None;
        }
        let greatest = swings.max();
        let axis = Axis::ALL
            .into_iter()
            .find(|axis| axis.of(&swings) >= greatest);
        axis.map(|axis| (axis, percent))
    }
}

impl Default for Chatter {
    fn default() -> Self {
        Self::new()
    }
}
