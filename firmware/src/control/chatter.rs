//! Torques that swing from sample to sample, as those of a loop do whose gains are too high for its delay or for its encoders.
//!
//! A planned torque and what corrects it change evenly over some samples; the second difference of a torque that swings to both sides of its
//! mean by `a` in every other sample is 4 `a`. Torques are kept in every sample, and looked at now and then. Swings are shares of a motor's limit,
//! summed over the motors.

use nalgebra::Vector4;

use super::fault::CHATTER_PERCENT;
use crate::mechanics::arm::Axis;

/// Samples of a look: two second differences, of which one shows a swing of four or five samples that the looks happen to keep time
/// with.
const KEPT: usize = 4;
/// Looks over which swings are averaged.
const LOOKS: f32 = 10.0;
/// Most of one look, so that a single great swing is not chatter yet, as where a reading jumps.
const MOST: f32 = 2.0;
/// Period (s) from which on more swing is allowed, in proportion: in a longer one a planned torque changes by more. Above 5 ms none can be told
/// from that.
const SHORT: f32 = 1e-3;

/// Watches torques for chatter.
#[derive(Clone, Copy, Debug)]
pub struct Chatter {
    /// Torques of the last samples, in turn.
    torques: [Vector4<f32>; KEPT],
    oldest: u8,
    mean: f32,
}

impl Chatter {
    /// A watch that has seen nothing. That torques begin counts as one swing.
    pub fn new() -> Self {
        Self {
            torques: [Vector4::zeros(); KEPT],
            oldest: 0,
            mean: 0.0,
        }
    }

    /// Keeps the motor torques of a sample, N m.
    pub fn keep(&mut self, torque: &Vector4<f32>) {
        if let Some(place) = self.torques.get_mut(usize::from(self.oldest)) {
            *place = *torque;
        }
        self.oldest = (self.oldest + 1) % KEPT as u8;
    }

    /// Motor torques of the last samples, N m, in no order.
    pub fn torques(&self) -> &[Vector4<f32>; KEPT] {
        &self.torques
    }

    /// Looks at the last samples, `period` seconds apart. Returns the axis that swings most and the mean swing of all (%) if that is too much.
    pub fn look(&mut self, limit: &Vector4<f32>, period: f32) -> Option<(Axis, f32)> {
        let [a, b, c, d] = self.torques;
        let [a, b, c, d] = match self.oldest {
            0 => [a, b, c, d],
            1 => [b, c, d, a],
            2 => [c, d, a, b],
            _ => [d, a, b, c],
        };
        let before = (a - b * 2.0 + c).abs();
        let now = (b - c * 2.0 + d).abs();
        let swings = before.sup(&now).component_div(limit);
        let sum = swings.sum() * (SHORT / period).min(1.0);
        self.mean += (sum.min(MOST) - self.mean) / LOOKS;
        let percent = self.mean * 100.0;
        if percent <= f32::from(CHATTER_PERCENT) {
            return None;
        }
        let greatest = swings.max();
        let mut axes = Axis::ALL.into_iter();
        let axis = axes.find(|axis| axis.of(&swings) >= greatest)?;
        Some((axis, percent))
    }
}

impl Default for Chatter {
    fn default() -> Self {
        Self::new()
    }
}
