//! Times from one frame to the next: extremes, mean, deviation and distribution, in memory that does not grow with the
//! trace.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

/// Bins per factor of two: neighbouring edges differ by at most 0.4 %. Below twice this number, every microsecond has
/// its own bin.
const BINS: u64 = 256;
/// Most bins of a histogram.
const SHOWN: usize = 12;
/// Share of the periods below the 90 % range, and above it.
const TAIL: f64 = 0.05;

/// Periods of one identifier, in us.
#[derive(Default)]
pub(super) struct Periods {
    pub count: u64,
    pub mean: f64,
    squares: f64,
    min: u64,
    max: u64,
    /// Counts by bin number.
    bins: BTreeMap<u64, u64>,
}

impl Periods {
    /// Mean and deviation in one pass (Welford 1962).
    pub(super) fn add(&mut self, period_us: u64) {
        self.min = if self.count == 0 {
            period_us
        } else {
            self.min.min(period_us)
        };
        self.max = self.max.max(period_us);
        self.count += 1;
        let value = period_us as f64;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
        *self.bins.entry(bin(period_us)).or_default() += 1;
    }

    /// The statistics; `None` without a period.
    pub(super) fn statistics(&self) -> Option<PeriodStatistics> {
        let (low, high) = (self.quantile(TAIL)?, self.quantile(1.0 - TAIL)?);
        Some(PeriodStatistics {
            min_ms: self.min as f64 / 1e3,
            mean_ms: self.mean / 1e3,
            max_ms: self.max as f64 / 1e3,
            jitter_ms: (self.squares / self.count as f64).sqrt() / 1e3,
            range_90_ms: [
                self.clamp(start(low)) as f64 / 1e3,
                self.clamp(start(high + 1) - 1) as f64 / 1e3,
            ],
            histogram: self.histogram(),
        })
    }

    /// Clamps the edge of a bin to the extremes seen.
    fn clamp(&self, period_us: u64) -> u64 {
        period_us.clamp(self.min, self.max)
    }

    /// The bin up to which this share of the periods lies.
    fn quantile(&self, share: f64) -> Option<u64> {
        let rank = ((share * self.count as f64).ceil() as u64).max(1);
        let mut seen = 0;
        self.bins.iter().find_map(|(&bin, &count)| {
            seen += count;
            (seen >= rank).then_some(bin)
        })
    }

    /// Neighbouring bins merged until few are left, each of about as many bins and none empty.
    fn histogram(&self) -> Vec<Bin> {
        let (Some((&first, _)), Some((&last, _))) =
            (self.bins.first_key_value(), self.bins.last_key_value())
        else {
            return Vec::new();
        };
        let width = (last - first + 1).div_ceil(SHOWN as u64);
        let mut histogram: Vec<(u64, Bin)> = Vec::new();
        for (&bin, &count) in &self.bins {
            let group = (bin - first) / width;
            match histogram.last_mut() {
                Some((last, shown)) if *last == group => shown.count += count,
                _ => {
                    let edge = first + group * width;
                    let shown = Bin {
                        from_ms: self.clamp(start(edge)) as f64 / 1e3,
                        to_ms: self.clamp(start(edge + width) - 1) as f64 / 1e3,
                        count,
                    };
                    histogram.push((group, shown));
                }
            }
        }
        histogram.into_iter().map(|(_, bin)| bin).collect()
    }
}

/// Number of the bin of a period: as a floating-point number with eight bits of mantissa.
fn bin(period_us: u64) -> u64 {
    let shift = u64::from((period_us / BINS).checked_ilog2().unwrap_or(0));
    shift * BINS + (period_us >> shift)
}

/// Least period of a bin.
fn start(bin: u64) -> u64 {
    let shift = (bin / BINS).saturating_sub(1);
    let mantissa = bin - shift * BINS;
    if shift > u64::from(mantissa.leading_zeros()) {
        return u64::MAX;
    }
    mantissa << shift
}

/// Time from one frame to the next, ms.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PeriodStatistics {
    /// Shortest.
    pub min_ms: f64,
    /// Mean.
    pub mean_ms: f64,
    /// Longest.
    pub max_ms: f64,
    /// Standard deviation.
    pub jitter_ms: f64,
    /// Range of nine periods in ten: one in twenty is shorter, one in twenty longer. Accurate to 0.4 %.
    pub range_90_ms: [f64; 2],
    /// Counts by length; empty bins are left out.
    pub histogram: Vec<Bin>,
}

/// Periods of about the same length.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Bin {
    /// Shortest in this bin, ms.
    pub from_ms: f64,
    /// Longest in this bin, ms.
    pub to_ms: f64,
    /// Count.
    pub count: u64,
}

#[cfg(test)]
mod tests {
    use super::{BINS, bin, start};

    #[test]
    fn every_period_lies_in_its_bin_and_bins_are_narrow() {
        for period in (0..100_000).chain((17..64).map(|bit| (1_u64 << bit) + 12345)) {
            let bin = bin(period);
            assert!(start(bin) <= period && period < start(bin + 1), "{period}");
            assert!(
                start(bin + 1) - start(bin) <= (period / BINS).max(1),
                "{period}"
            );
        }
    }
}
