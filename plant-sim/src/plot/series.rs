//! Curves of any length in bounded memory.

/// Bins of a series: as many as the pixels of a curve, or up to twice that.
const BINS: usize = 2048;
/// Width of a bin at the start, us.
const FINEST_US: u64 = 250;

/// Least and greatest value in each of a fixed number of equal spans of time.
///
/// When time passes the last bin, neighbours are merged and bins become twice as wide: a curve of any length uses at
/// least half of the bins, and keeps every peak.
pub(super) struct Series {
    width_us: u64,
    bins: Vec<Option<Bin>>,
}

/// Values of one span of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bin {
    pub min: f32,
    pub max: f32,
}

impl Default for Series {
    fn default() -> Self {
        Self {
            width_us: FINEST_US,
            bins: Vec::new(),
        }
    }
}

impl Series {
    /// Whether it has no value.
    pub(super) fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// Adds a value. Time counts from the start of the trace.
    pub(super) fn push(&mut self, time_us: u64, value: f32) {
        while time_us / self.width_us >= BINS as u64 {
            self.bins = self
                .bins
                .chunks(2)
                .map(|pair| merge(pair[0], pair.get(1).copied().flatten()))
                .collect();
            self.width_us *= 2;
        }
        let index = (time_us / self.width_us) as usize;
        if index >= self.bins.len() {
            self.bins.resize(index + 1, None);
        }
        let bin = Bin {
            min: value,
            max: value,
        };
        self.bins[index] = merge(self.bins[index], Some(bin));
    }

    /// Middle of the span, us, and values, of every span that has any.
    pub(super) fn bins(&self) -> impl Iterator<Item = (f64, Bin)> {
        let width = self.width_us as f64;
        self.bins
            .iter()
            .enumerate()
            .filter_map(move |(index, bin)| bin.map(|bin| ((index as f64 + 0.5) * width, bin)))
    }
}

fn merge(one: Option<Bin>, other: Option<Bin>) -> Option<Bin> {
    match (one, other) {
        (Some(one), Some(other)) => Some(Bin {
            min: one.min.min(other.min),
            max: one.max.max(other.max),
        }),
        (one, other) => one.or(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Memory is bounded, no extreme is lost, and every value lies within the bin of its time.
        #[test]
        fn the_envelope_holds_every_value(mut values in prop::collection::vec((0_u64..1 << 40, -1e3_f32..1e3), 1..300)) {
            values.sort_by_key(|(time, _)| *time);
            let mut series = Series::default();
            for &(time, value) in &values {
                series.push(time, value);
            }
            prop_assert!(series.bins.len() <= BINS);
            let half = series.width_us as f64 / 2.0;
            for &(time, value) in &values {
                let time = time as f64 + 0.5;
                let covered = series.bins().any(|(middle, bin)| {
                    (middle - time).abs() <= half && bin.min <= value && value <= bin.max
                });
                prop_assert!(covered);
            }
            let least = values.iter().map(|(_, value)| *value).fold(f32::MAX, f32::min);
            let found = series.bins().map(|(_, bin)| bin.min).fold(f32::MAX, f32::min);
            prop_assert_eq!(least, found);
        }
    }
}
