//! Efforts over a cycle, and what becomes of them where the whole motion is slower.
//!
//! A motion that is played `s` times as fast needs `a + b s + c s^2`: weight and dry friction stay, viscous friction goes with the
//! speed, everything that accelerates with its square. The mean square is therefore a polynomial of `s`, of which a run at full
//! speed gives the coefficients.

/// Halvings of an interval: more than a double has digits.
const HALVINGS: usize = 60;

/// Sums of products over the samples of a motion, and of squares over those at rest, by axis.
#[derive(Clone, Debug, Default)]
pub(super) struct Load {
    /// Coefficients of 1, s, s^2, s^3, s^4.
    moving: [[f64; 5]; 4],
    moving_samples: u64,
    resting: [f64; 4],
    resting_samples: u64,
}

/// What an axis needs at a sample: whatever the speed, in proportion to it, and to its square.
pub(super) type Parts = [f64; 3];

impl Load {
    /// A sample in motion.
    pub(super) fn moving(&mut self, parts: &[Parts; 4]) {
        for (sums, [a, b, c]) in self.moving.iter_mut().zip(parts) {
            let products = [a * a, 2.0 * a * b, b * b + 2.0 * a * c, 2.0 * b * c, c * c];
            for (sum, product) in sums.iter_mut().zip(products) {
                *sum += product;
            }
        }
        self.moving_samples += 1;
    }

    /// A sample at rest.
    pub(super) fn resting(&mut self, efforts: &[f64; 4]) {
        for (sum, effort) in self.resting.iter_mut().zip(efforts) {
            *sum += effort * effort;
        }
        self.resting_samples += 1;
    }

    /// Root mean square over the rating, of the worst axis, without a pause, at `speed` times full speed.
    pub(super) fn rms_share(&self, ratings: &[f64; 4], speed: f64) -> f64 {
        let samples = self.moving_samples.max(1) as f64;
        let shares = self.moving.iter().zip(ratings).map(|(sums, rating)| {
            let square = sums.iter().rev().fold(0.0, |sum, next| sum * speed + next);
            (square / samples).sqrt() / rating
        });
        shares.fold(0.0, f64::max)
    }

    /// The share of full speed at which no axis exceeds its rating; `None` where standing already does.
    pub(super) fn continuous_speed(&self, ratings: &[f64; 4]) -> Option<f64> {
        let bearable = |speed| self.rms_share(ratings, speed) <= 1.0;
        if bearable(1.0) {
            return Some(1.0);
        }
        if !bearable(0.0) {
            return None;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = (low + high) / 2.0;
            if bearable(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(low)
    }

    /// The pause after a cycle of `cycle` s at full speed with which no axis exceeds its rating, s; `None` where holding the arm
    /// still already does.
    pub(super) fn pause(&self, ratings: &[f64; 4], cycle: f64) -> Option<f64> {
        let mean = |sum: f64, samples: u64| sum / samples.max(1) as f64;
        let axes = self.moving.iter().zip(&self.resting).zip(ratings);
        let mut longest = 0.0_f64;
        for ((moving, resting), rating) in axes {
            let allowed = rating * rating;
            let moving = mean(moving.iter().sum(), self.moving_samples);
            let resting = mean(*resting, self.resting_samples);
            if moving > allowed {
                if resting >= allowed {
                    return None;
                }
                longest = longest.max(cycle * (moving - allowed) / (allowed - resting));
            }
        }
        Some(longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An axis of rating 1 that holds 0.5 and accelerates with +-2: by hand, 0.25 + 4 s^4 = 1.
    #[test]
    fn a_slower_cycle_and_a_pause_keep_the_rating() {
        let mut load = Load::default();
        for c in [2.0, -2.0] {
            load.moving(&[[0.5, 0.0, c], [0.0; 3], [0.0; 3], [0.0; 3]]);
            load.resting(&[0.5, 0.0, 0.0, 0.0]);
        }
        let ratings = [1.0; 4];
        assert!((load.rms_share(&ratings, 1.0) - 4.25_f64.sqrt()).abs() < 1e-12);
        let speed = load.continuous_speed(&ratings).unwrap();
        assert!((speed - (0.75_f64 / 4.0).powf(0.25)).abs() < 1e-12);
        // 4.25 * 2 + 0.25 * pause = 2 + pause.
        let pause = load.pause(&ratings, 2.0).unwrap();
        assert!((pause - 6.5 / 0.75).abs() < 1e-12);
    }

    /// At half the speed, 1 + 2 / 2 + 3 / 4.
    #[test]
    fn each_part_goes_with_its_power_of_the_speed() {
        let mut load = Load::default();
        load.moving(&[[0.0; 3], [0.0; 3], [0.0; 3], [1.0, 2.0, 3.0]]);
        assert!((load.rms_share(&[1.0; 4], 0.5) - 2.75).abs() < 1e-12);
        assert!((load.rms_share(&[1.0; 4], 1.0) - 6.0).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_held_has_no_speed_and_no_pause() {
        let mut load = Load::default();
        load.moving(&[[0.0; 3], [1.5, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
        load.resting(&[0.0, 1.5, 0.0, 0.0]);
        assert_eq!(load.continuous_speed(&[1.0; 4]), None);
        assert_eq!(load.pause(&[1.0; 4], 1.0), None);
        assert_eq!(load.continuous_speed(&[2.0; 4]), Some(1.0));
        assert_eq!(load.pause(&[2.0; 4], 1.0), Some(0.0));
    }
}
