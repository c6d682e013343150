//! The clock of a trajectory: runs with the samples, or is braked to a stop on the path.

use super::Rates;
use super::torque_budget::Braking;
use crate::mechanics::math::sqrt;

/// Trajectory time in whole samples plus a fraction, so that long moves keep their resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    ticks: u32,
    fraction: f32,
    /// Time scale: 1 in motion, 0 when stopped.
    time_scale: f32,
    /// Change of the time scale, 1/s; never positive.
    slope: f32,
}

impl Default for Clock {
    fn default() -> Self {
        Self {
            ticks: 0,
            fraction: 0.0,
            time_scale: 1.0,
            slope: 0.0,
        }
    }
}

impl Clock {
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
        let step = self.time_scale + 0.5 * self.slope * period;
        self.time_scale = (self.time_scale + self.slope * period).max(0.0);
        self.fraction += step.max(0.0);
        if self.fraction >= 1.0 {
            self.fraction -= 1.0;
            self.ticks = self.ticks.saturating_add(1);
        }
    }

    /// Chooses the next slope of a stop: as steep as the torque allows, no sooner than it can be built up, and flattening
    /// towards rest. The arm stays on its path.
    pub fn brake(&mut self, Braking { slope, bend }: Braking, period: f32) {
        if !bend.is_finite() {
            // At rest on the trajectory: nothing to brake.
            self.time_scale = 0.0;
            self.slope = 0.0;
            return;
        }
        let flare = sqrt(2.0 * bend * self.time_scale);
        self.slope = -(bend * period - self.slope).min(slope).min(flare);
    }

    /// The velocities and accelerations of the trajectory as the clock runs through them, `later` seconds from now.
    pub fn apply(&self, rates: &Rates, later: f32) -> Rates {
        let scale = (self.time_scale + self.slope * later).max(0.0);
        Rates {
            qd: rates.qd * scale,
            qdd: rates.qdd * (scale * scale) + rates.qd * self.slope,
        }
    }

    /// Time that passes on the trajectory in the next `later` seconds.
    pub fn lead(&self, later: f32) -> f32 {
        ((self.time_scale + 0.5 * self.slope * later) * later).max(0.0)
    }
}
