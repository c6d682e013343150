//! A curve of any length in bounded memory.

/// Most values of a curve. The pages of a run stay below 1.5 MB with it, and ten cycles of the gate fit in whole.
const MOST: usize = 12_288;

/// One value for every sample, and once there are too many, least and greatest of every few samples instead.
///
/// Values are in pairs, one per span of `2 * samples_per_value` samples. A span of two samples keeps both; a longer one
/// keeps its extremes in the order in which they came. Either way the values are drawn from left to right, no peak is lost,
/// and a curve that is short enough is complete.
#[derive(Clone, Debug)]
pub(super) struct Thinned {
    pairs: Vec<[f32; 2]>,
    /// The current span, and its number of samples so far.
    open: [f32; 2],
    filled: u64,
    /// Samples of a whole span.
    span: u64,
}

impl Thinned {
    pub(super) const fn new() -> Self {
        Self {
            pairs: Vec::new(),
            open: [f32::NAN; 2],
            filled: 0,
            span: 2,
        }
    }

    /// Samples per value.
    pub(super) const fn samples_per_value(&self) -> u64 {
        self.span / 2
    }

    /// Adds the next sample; one that is not a number is a gap.
    pub(super) fn push(&mut self, value: f32) {
        self.open = match self.filled {
            0 => [value, f32::NAN],
            1 if self.span == 2 => [self.open[0], value],
            _ => extremes([self.open[0], self.open[1], value]),
        };
        self.filled += 1;
        if self.filled == self.span {
            self.pairs.push(self.open);
            self.filled = 0;
        }
        if self.pairs.len() == MOST / 2 {
            self.halve();
        }
    }

    fn halve(&mut self) {
        let merged = |two: &[[f32; 2]]| extremes([two[0][0], two[0][1], two[1][0], two[1][1]]);
        self.pairs = self.pairs.chunks_exact(2).map(merged).collect();
        self.span *= 2;
    }

    /// The values so far, including those of the current span.
    pub(super) fn values(&self) -> impl Iterator<Item = f32> {
        let open = (self.filled > 0).then_some(self.open);
        self.pairs.iter().copied().chain(open).flatten()
    }
}

/// Least and greatest of some values, the earlier first; where only one is a number, that one twice.
fn extremes<const N: usize>(values: [f32; N]) -> [f32; 2] {
    let mut least = None;
    let mut greatest = None;
    for (place, value) in values.into_iter().enumerate() {
        if value.is_nan() {
            continue;
        }
        if least.is_none_or(|(_, least)| value < least) {
            least = Some((place, value));
        }
        if greatest.is_none_or(|(_, greatest)| value > greatest) {
            greatest = Some((place, value));
        }
    }
    match (least, greatest) {
        (Some(least), Some(greatest)) if least.0 > greatest.0 => [greatest.1, least.1],
        (Some(least), Some(greatest)) => [least.1, greatest.1],
        _ => [f32::NAN; 2],
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{MOST, Thinned};

    fn of(values: impl IntoIterator<Item = f32>) -> Thinned {
        let mut curve = Thinned::new();
        values.into_iter().for_each(|value| curve.push(value));
        curve
    }

    #[test]
    fn a_short_curve_is_complete() {
        let values: Vec<f32> = (0..MOST as u32 - 1)
            .map(|k| (k * 7919 % 1000) as f32)
            .collect();
        let curve = of(values.iter().copied());
        assert_eq!(curve.samples_per_value(), 1);
        // The current span is open at its end.
        let kept: Vec<f32> = curve.values().take(values.len()).collect();
        assert_eq!(kept, values);
    }

    #[test]
    fn a_gap_stays_a_gap_and_swallows_no_neighbour() {
        let mut values = vec![f32::NAN; MOST];
        values[1] = 7.0;
        let curve = of(values);
        assert_eq!(curve.samples_per_value(), 2);
        let kept: Vec<f32> = curve.values().collect();
        assert_eq!(kept[..2], [7.0, 7.0]);
        assert!(kept[2..].iter().all(|value| value.is_nan()));
    }

    proptest! {
        /// Every value lies between the two that its span keeps, both of them are of the span, and they are bounded in number.
        #[test]
        fn the_envelope_holds_every_value(
            seed in prop::collection::vec(-1e3_f32..1e3, 1..400), length in 1_usize..5 * MOST,
        ) {
            // Neighbours differ, and no two spans are alike.
            let value = |k: usize| seed[k % seed.len()] + (k / seed.len()) as f32;
            let curve = of((0..length).map(value));
            let kept: Vec<f32> = curve.values().collect();
            prop_assert!(kept.len() <= MOST);
            let span = 2 * curve.samples_per_value() as usize;
            prop_assert_eq!(kept.len(), 2 * length.div_ceil(span));
            for (number, pair) in kept.chunks(2).enumerate() {
                let samples: Vec<f32> =
                    (number * span..length.min((number + 1) * span)).map(value).collect();
                let place = |kept: f32| samples.iter().position(|sample| *sample == kept);
                prop_assert!(place(pair[0]).is_some());
                if samples.len() > 1 {
                    let last = samples.iter().rposition(|sample| *sample == pair[1]);
                    prop_assert!(last.is_some() && place(pair[0]) <= last);
                    let [low, high] = [pair[0].min(pair[1]), pair[0].max(pair[1])];
                    prop_assert!(samples.iter().all(|sample| (low..=high).contains(sample)));
                }
            }
        }
    }
}
