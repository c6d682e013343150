//! Torques that swing from sample to sample, as those of a loop do whose gains are too high for its delay or for its encoders.
//!
//! A planned torque and what corrects it change evenly over some samples; the second difference of a torque that swings to both sides of its
//! mean by `a` in every other sample is 4 `a`. Torques are kept in every sample, and looked at now and then.

use nalgebra::Vector4;

use super::fault::CHATTER_PERCENT;
use crate::mechanics::arm::Axis;

/// Looks over which swings are averaged.
const LOOKS: f32 = 10.0;
/// Period (s) from which on more swing is allowed, in proportion: in a longer one a planned torque changes by more.
const SHORT: f32 = 1e-3;

/// Watches torques for chatter.
#[derive(Clone, Copy, Debug)]
pub struct Chatter {
    /// Torques of the last three samples, in turn.
    torques: [Vector4<f32>; 3],
    oldest: u8,
    mean: f32,
}

impl Chatter {
    /// A watch that has seen nothing. That torques begin counts as one swing.
    pub fn new() -> Self {
        Self {
            torques: [Vector4::zeros(); 3],
            oldest: 0,
            mean: 0.0,
        }
    }

    /// Keeps the motor torques of a sample, N m.
    pub fn keep(&mut self, torque: &Vector4<f32>) {
        if let Some(place) = self.torques.get_mut(usize::from(self.oldest)) {
            *place = *torque;
        }
        self.oldest = if self.oldest < 2 { self.oldest + 1 } else { 0 };
    }

    /// Motor torques of the last three samples, N m, in no order.
    pub fn torques(&self) -> &[Vector4<f32>; 3] {
        &self.torques
    }

    /// Looks at the last three samples, `period` seconds apart. Returns the axis that swings most and the mean swing of all (%) if that is too
    /// much.
    pub fn look(&mut self, limit: &Vector4<f32>, period: f32) -> Option<(Axis, f32)> {
        let [a, b, c] = self.torques;
        let middle = match self.oldest {
            0 => b,
            1 => c,
            _ => a,
        };
        let swings = (a + b + c - middle * 3.0).abs().component_div(limit);
        // One great swing, as where a reading jumps, is not chatter yet.
        self.mean += (swings.sum().min(1.0) - self.mean) / LOOKS;
        let percent = self.mean * 100.0 * (SHORT / period).min(1.0);
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
