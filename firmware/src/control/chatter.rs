//! Torques that swing from sample to sample, as those of a loop do whose gains are too high for its delay or for its encoders.
//!
//! A planned torque and what corrects it change evenly over some samples; the second difference of a torque that swings to both sides of its
//! mean by `a` in every other sample is 4 `a`. Torques are kept in every sample, and looked at now and then. Swings are shares of a motor's limit,
//! summed over the motors.

use nalgebra::Vector4;

use super::fault::CHATTER_PERCENT;
use crate::mechanics::arm::Axis;
use crate::mechanics::math::{clamp, least};

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

/// Share of swing that stands for a torque that for long changes as fast as that of a plan does at the most.
const STEEP: f32 = CHATTER_PERCENT as f32 * 1e-2;
/// Times that a torque is cut to one side and then to the other that are a swing.
const TURNS: u8 = 5;
/// Time between two cuts below which a plan cannot be the reason, as a multiple of the time that one takes from no torque to the greatest: it takes
/// twice that time from limit to limit.
const SOON: f32 = 2.0;

/// Watches torques for chatter.
#[derive(Clone, Copy, Debug)]
pub struct Chatter {
    /// Torques of the last samples, in turn.
    torques: [Vector4<f32>; KEPT],
    /// Samples kept until now, which number them.
    kept: u16,
    mean: f32,
    /// Mean rates of change, as shares of the greatest one of a plan.
    slopes: Vector4<f32>,
    cuts: [Cut; 4],
}

/// What has been cut off the torque of an axis.
#[derive(Clone, Copy, Debug, Default)]
struct Cut {
    /// Whether it was above 0 when it was last cut.
    was_above: bool,
    /// Times in a row that it was cut to the other side sooner than a plan can.
    turns: u8,
    /// Number of the last sample in which it was cut.
    last: u16,
}

impl Chatter {
    /// A watch that has seen nothing. That torques begin counts as one swing.
    pub fn new() -> Self {
        Self {
            torques: [Vector4::zeros(); KEPT],
            kept: 0,
            mean: 0.0,
            slopes: Vector4::zeros(),
            cuts: [Cut::default(); 4],
        }
    }

    /// Keeps the motor torques of a sample, N m.
    pub fn keep(&mut self, torque: &Vector4<f32>) {
        if let Some(place) = self.torques.get_mut(usize::from(self.kept) % KEPT) {
            *place = *torque;
        }
        self.kept = self.kept.wrapping_add(1);
    }

    /// Motor torques of the last samples, N m, in no order.
    pub fn torques(&self) -> &[Vector4<f32>; KEPT] {
        &self.torques
    }

    /// Motor torques of the last sample, N m.
    pub fn last(&self) -> Vector4<f32> {
        let last = usize::from(self.kept.wrapping_sub(1)) % KEPT;
        self.torques.get(last).copied().unwrap_or_default()
    }

    /// Looks at the last samples, `period` seconds apart. Returns the axis that swings most and the mean swing of all (%) if that is too much, or
    /// that of a slower swing in the same measure. A plan takes `rise` seconds from no torque to the greatest.
    pub fn look(
        &mut self,
        limit: &Vector4<f32>,
        rise: &Vector4<f32>,
        period: f32,
    ) -> Option<(Axis, f32)> {
        // In their order, by reference: in registers they would leave no room for what follows.
        let [a, b, c, d] = &self.torques;
        let [a, b, c, d] = match usize::from(self.kept) % KEPT {
            0 => [a, b, c, d],
            1 => [b, c, d, a],
            2 => [c, d, a, b],
            _ => [d, a, b, c],
        };
        let before = (a - b * 2.0 + c).abs();
        let now = (b - c * 2.0 + d).abs();
        let swings = before.sup(&now);
        // Less what noise may have to do with it.
        let slopes = ((d - a).abs() - swings).component_div(limit);
        let slopes = slopes.component_mul(rise) / (period * (KEPT - 1) as f32);
        self.slopes += (slopes.map(|slope| clamp(slope, 0.0, MOST)) - self.slopes) / LOOKS;
        let swings = swings.component_div(limit);
        let sum = swings.sum() * least(SHORT / period, 1.0);
        self.mean += (least(sum, MOST) - self.mean) / LOOKS;
        let steepest = self.slopes.max() * STEEP;
        let (share, shares) = if steepest > self.mean {
            (steepest, &self.slopes)
        } else {
            (self.mean, &swings)
        };
        let percent = share * 100.0;
        if percent <= f32::from(CHATTER_PERCENT) {
            return None;
        }
        let greatest = shares.max();
        let mut axes = Axis::ALL.into_iter();
        let axis = axes.find(|axis| axis.of(shares) >= greatest)?;
        Some((axis, percent))
    }

    /// Judges what is cut off the torques of the sample that comes next. Returns the axis whose torque swings from limit to limit and back; a plan
    /// takes `rise` samples from none to the greatest torque.
    // Out of line: rare in a sample.
    #[inline(never)]
    pub fn cut(&mut self, excess: &Vector4<f32>, rise: &Vector4<f32>) -> Option<Axis> {
        let now = self.kept;
        let mut swinging = None;
        let axes = Axis::ALL
            .into_iter()
            .zip(excess.as_slice().iter().zip(rise.as_slice()));
        for ((axis, (excess, rise)), cut) in axes.zip(self.cuts.iter_mut()) {
            if *excess == 0.0 {
                continue;
            }
            let is_above = *excess > 0.0;
            if is_above != cut.was_above {
                let soon = f32::from(now.wrapping_sub(cut.last)) < SOON * rise;
                cut.turns = if soon { cut.turns.saturating_add(1) } else { 0 };
                if cut.turns >= TURNS {
                    swinging = Some(axis);
                }
            }
            (cut.was_above, cut.last) = (is_above, now);
        }
        swinging
    }
}

impl Default for Chatter {
    fn default() -> Self {
        Self::new()
    }
}
