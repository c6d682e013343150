//! The clock of a trajectory: runs with the samples, slower than they do, or not at all. Whatever it does, the arm stays on its
//! path.

use super::torque_budget::TorqueBudget;
use super::{Rates, Setpoint};
use crate::mechanics::math::{clamp, greatest, least, sqrt};

/// Trajectory time in whole samples plus a fraction, so that long moves keep their resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    ticks: u32,
    fraction: f32,
    /// Time scale: 1 at full pace, 0 when stopped.
    time_scale: f32,
    /// Change of the time scale, 1/s.
    slope: f32,
    /// Where the time scale is to go.
    pace: f32,
}

impl Clock {
    /// Before the beginning of a trajectory: its first sample finds the arm at rest, where any time scale is as good as
    /// another, and looks ahead to where it moves.
    pub fn new(pace: f32) -> Self {
        Self {
            ticks: 0,
            fraction: -1.0,
            time_scale: pace,
            slope: 0.0,
            pace,
        }
    }

    /// Part of a sample, or after a gap a few, past the beginning of a trajectory, which has moved the arm by micrometres so far: any time
    /// scale is still as good as another.
    pub fn begun(pace: f32, samples: f32) -> Self {
        Self {
            fraction: samples,
            ..Self::new(pace)
        }
    }

    /// Goes on with a trajectory that began `begun` s after this one.
    pub fn go_over(&mut self, begun: f32, period: f32) {
        let samples = begun / period;
        let whole = samples as u32;
        self.ticks = self.ticks.saturating_sub(whole);
        self.fraction -= samples - whole as f32;
        if self.fraction < 0.0 && self.ticks > 0 {
            self.ticks -= 1;
            self.fraction += 1.0;
        }
        // Below 0 it would not have begun.
        self.fraction = greatest(self.fraction, 0.0);
    }

    /// Where the time scale is to go from now on, 0 to 1.
    pub fn set_pace(&mut self, pace: f32) {
        self.pace = pace;
        if self.ticks == 0 && self.fraction <= 0.0 {
            self.time_scale = pace;
            self.slope = 0.0;
        }
    }

    /// Whether the time scale stays as it is.
    pub fn is_even(&self) -> bool {
        self.time_scale == self.pace && self.slope == 0.0
    }

    /// Whether time passes as it was planned.
    pub fn is_full(&self) -> bool {
        self.is_even() && self.time_scale == 1.0
    }

    /// Time on the trajectory, s.
    pub fn time(&self, period: f32) -> f32 {
        (self.ticks as f32 + self.fraction) * period
    }

    /// How fast time on the trajectory passes.
    pub fn time_scale(&self) -> f32 {
        self.time_scale
    }

    /// Whether a stop has come to rest.
    pub fn is_stopped(&self) -> bool {
        self.time_scale <= 0.0
    }

    /// Advances by one sample.
    pub fn advance(&mut self, period: f32) {
        if self.fraction < 0.0 {
            if self.time_scale > 0.0 {
                self.fraction = 0.0;
            }
            return;
        }
        let before = self.time_scale;
        if self.slope != 0.0 {
            self.time_scale = clamp(before + self.slope * period, 0.0, 1.0);
            // There, or past it.
            if (before - self.pace) * (self.time_scale - self.pace) <= 0.0 {
                self.time_scale = self.pace;
                self.slope = 0.0;
            }
        }
        self.fraction += 0.5 * (before + self.time_scale);
        if self.fraction >= 1.0 {
            self.fraction -= 1.0;
            self.ticks = self.ticks.saturating_add(1);
        }
    }

    /// Chooses the next slope towards the pace, of a trajectory whose own motion is `setpoint`: as steep as the torque allows, no sooner than
    /// with this share of its rates it can be built up, flattening towards the pace, and one that is `stopping` gets no faster.
    pub fn ramp(
        &mut self,
        budget: &TorqueBudget<'_>,
        setpoint: &Setpoint,
        share: f32,
        period: f32,
        stopping: bool,
    ) {
        // The torque is that of the instant in which the command acts.
        let ahead = &setpoint.ahead;
        let need = budget.need(&setpoint.reference.q, ahead, self.time_scale);
        let bend = budget.bend(&need, ahead, share);
        if !bend.is_finite() {
            // At rest on the trajectory, where any time scale is as good as another.
            self.time_scale = self.pace;
            self.slope = 0.0;
            return;
        }
        let left = self.pace - self.time_scale;
        let (toward, flare) = if left < 0.0 {
            (-self.slope, sqrt(-2.0 * bend * left))
        } else {
            (self.slope, sqrt(2.0 * bend * left))
        };
        let toward = (toward + bend * period).min(flare);
        let slope = if left < 0.0 { -toward } else { toward };
        let faster = slope > 0.0;
        let steepest = if faster && stopping {
            0.0
        } else {
            budget.steepest(&need, ahead, self.time_scale, faster)
        };
        self.slope = if faster {
            least(slope, steepest)
        } else {
            greatest(slope, -steepest)
        };
    }

    /// The velocities and accelerations of the trajectory as the clock runs through them, `later` seconds from now.
    pub fn apply(&self, rates: &Rates, later: f32) -> Rates {
        let scale = greatest(self.time_scale + self.slope * later, 0.0);
        Rates {
            qd: rates.qd * scale,
            qdd: rates.qdd * (scale * scale) + rates.qd * self.slope,
        }
    }

    /// Time that passes on the trajectory in the next `later` seconds.
    pub fn lead(&self, later: f32) -> f32 {
        greatest((self.time_scale + 0.5 * self.slope * later) * later, 0.0)
    }
}
