//! One requirement while the run goes.

use protocol::messages::Mode;

use super::Verdict;
use crate::scenario::{Axis, Quantity, Requirement, StateName};

/// One requirement, and what has been measured for it so far.
pub(super) struct Watch {
    requirement: Requirement,
    nearest: Option<Nearest>,
    /// What adds up over the window, by axis where it is of one.
    sums: [f64; 4],
    /// Number of squares in the sums.
    squares: u64,
    /// Samples in the window, and the last of them.
    samples: u64,
    last: f64,
    /// The last of what is counted.
    counted: Option<f64>,
}

/// The value nearest to a limit, or farthest beyond it.
#[derive(Clone, Copy)]
struct Nearest {
    time_s: f64,
    value: Option<f64>,
    margin: f64,
}

impl Watch {
    pub(super) fn new(requirement: &Requirement) -> Self {
        Self {
            requirement: requirement.clone(),
            nearest: None,
            sums: [0.0; 4],
            squares: 0,
            samples: 0,
            last: 0.0,
            counted: None,
        }
    }

    pub(super) fn quantity(&self) -> Quantity {
        self.requirement.quantity
    }

    /// Whether an instant in this cycle is in the window.
    pub(super) fn admits(&self, t: f64, cycle: Option<u32>) -> bool {
        let Requirement {
            during, cycle: of, ..
        } = &self.requirement;
        during.is_none_or(|[from, until]| (from..=until).contains(&t))
            && (of.is_none() || *of == cycle)
    }

    /// A sample is in the window.
    pub(super) fn sample(&mut self, t: f64) {
        self.samples += 1;
        self.last = t;
    }

    /// The greatest value of these axes, or that of the one that is asked for.
    pub(super) fn of_axes(&self, values: &[f64; 4], axes: &[usize]) -> f64 {
        match self.requirement.axis {
            Some(Axis(axis)) => values[axis],
            None => axes
                .iter()
                .map(|axis| values[*axis])
                .fold(0.0_f64, f64::max),
        }
    }

    /// The time at which the state is reached, once.
    pub(super) fn reached(&self, mode: Mode, t: f64) -> Option<f64> {
        (self.nearest.is_none() && self.requirement.state == Some(StateName(mode))).then_some(t)
    }

    /// Something that is counted has happened.
    pub(super) fn count(&mut self, t: f64) {
        self.sums[0] += 1.0;
        self.counted = Some(t);
    }

    pub(super) fn add(&mut self, axis: usize, value: f64) {
        self.sums[axis] += value;
    }

    /// The sums have one more square each.
    pub(super) fn weigh(&mut self) {
        self.squares += 1;
    }

    /// A value; none for what never comes, which is beyond every limit.
    pub(super) fn observe(&mut self, time_s: f64, value: Option<f64>) {
        let Requirement { max, min, .. } = &self.requirement;
        let margin = value.map_or(f64::NEG_INFINITY, |value| {
            let below = max.map_or(f64::INFINITY, |max| max - value);
            let above = min.map_or(f64::INFINITY, |min| value - min);
            below.min(above)
        });
        if self.nearest.is_none_or(|nearest| margin < nearest.margin) {
            self.nearest = Some(Nearest {
                time_s,
                value,
                margin,
            });
        }
    }

    /// The verdict about what is one number for the whole run.
    pub(super) fn verdict_of(mut self, time_s: f64, value: f64) -> Verdict {
        self.observe(time_s, Some(value));
        self.judged()
    }

    /// The verdict about what was measured, with samples this far apart.
    pub(super) fn verdict(mut self, period_s: f64) -> Verdict {
        let last = self.last;
        match self.quantity() {
            _ if self.samples == 0 => {}
            Quantity::BusLoad => {
                let load = self.sums[0] / (self.samples as f64 * period_s);
                self.observe(last, Some(load));
            }
            Quantity::Overruns | Quantity::Faults => {
                self.observe(self.counted.unwrap_or(last), Some(self.sums[0]));
            }
            Quantity::Thermal if self.squares > 0 => {
                let shares = self.sums.map(|sum| (sum / self.squares as f64).sqrt());
                let share = self.of_axes(&shares, &[0, 1, 2, 3]);
                self.observe(last, Some(share));
            }
            _ => {}
        }
        self.judged()
    }

    /// How far beyond a limit a value still counts as at it: what the numbers of the wire, f32, do not tell from it. A motor that
    /// is commanded its limit gives the f32 nearest to it, which may be greater.
    fn rounding(&self) -> f64 {
        let Requirement { max, min, .. } = &self.requirement;
        match self.quantity() {
            Quantity::Torque | Quantity::Thermal => {
                f64::from(f32::EPSILON) * max.or(*min).unwrap_or(0.0)
            }
            _ => 0.0,
        }
    }

    fn judged(self) -> Verdict {
        let at_limit = -self.rounding()..0.0;
        let nearest = self.nearest.map(|nearest| Nearest {
            margin: if at_limit.contains(&nearest.margin) {
                0.0
            } else {
                nearest.margin
            },
            ..nearest
        });
        Verdict {
            requirement: self.requirement,
            met: nearest.is_some_and(|nearest| nearest.margin >= 0.0),
            value: nearest.and_then(|nearest| nearest.value),
            margin: nearest.and_then(|nearest| nearest.value.map(|_| nearest.margin)),
            time_s: nearest.map(|nearest| nearest.time_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{Quantity, Requirement, Watch};

    fn requirement(max: Option<f64>, min: Option<f64>, during: Option<[f64; 2]>) -> Requirement {
        Requirement {
            id: "id".into(),
            text: "text".into(),
            quantity: Quantity::Torque,
            axis: None,
            state: None,
            max,
            min,
            during,
            cycle: None,
        }
    }

    proptest! {
        /// Judged one by one, values come to the same as all of them at once.
        #[test]
        fn the_value_nearest_to_a_limit_is_found(
            values in prop::collection::vec(-10.0_f64..10.0, 0..40),
            limits in (0.0_f64..8.0, 0.0_f64..8.0),
            which in 0..3,
            during in prop::option::of((0.0_f64..20.0, 0.0_f64..20.0)),
        ) {
            let max = (which != 1).then_some(limits.0);
            let min = (which != 0).then_some(limits.1);
            let during = during.map(|(from, length)| [from, from + length]);
            let mut watch = Watch::new(&requirement(max, min, during));
            let in_window = |t: f64| during.is_none_or(|[from, until]| from <= t && t <= until);
            let seen: Vec<(f64, f64)> = values
                .iter()
                .enumerate()
                .map(|(index, value)| (index as f64, *value))
                .filter(|(t, _)| in_window(*t))
                .collect();
            for (index, value) in values.iter().enumerate() {
                let t = index as f64;
                prop_assert_eq!(watch.admits(t, None), in_window(t));
                if watch.admits(t, None) {
                    watch.observe(t, Some(*value));
                }
            }
            let verdict = watch.judged();
            let good = |value: f64| max.is_none_or(|max| value <= max) && min.is_none_or(|min| value >= min);
            prop_assert_eq!(verdict.met, !seen.is_empty() && seen.iter().all(|(_, value)| good(*value)));
            let Some(margin) = verdict.margin else {
                prop_assert!(seen.is_empty());
                return Ok(());
            };
            prop_assert_eq!(verdict.met, margin >= 0.0);
            // It is the value of its instant, and no other is nearer to a limit.
            let value = verdict.value.unwrap();
            prop_assert!(seen.contains(&(verdict.time_s.unwrap(), value)));
            for (_, other) in seen {
                prop_assert!(max.is_none_or(|max| max - other >= margin));
                prop_assert!(min.is_none_or(|min| other - min >= margin));
            }
            let apart = [max.map(|max| max - value), min.map(|min| value - min)];
            prop_assert!(apart.contains(&Some(margin)));
        }
    }

    /// The f32 nearest to a limit is not beyond it, and the next but one is.
    #[test]
    fn a_torque_that_only_rounding_tells_from_its_limit_is_at_it() {
        let limit = 0.95;
        let nearest = limit as f32;
        let of = |value: f32| {
            let mut watch = Watch::new(&requirement(Some(limit), None, None));
            watch.observe(1.0, Some(value.into()));
            watch.judged()
        };
        let (at, beyond) = (
            of(nearest.next_up()),
            of(nearest.next_up().next_up().next_up()),
        );
        assert!(f64::from(nearest.next_up()) > limit);
        assert_eq!((at.met, at.margin), (true, Some(0.0)));
        assert!(!beyond.met && beyond.margin.unwrap() < 0.0);
    }

    #[test]
    fn what_never_comes_misses_every_limit() {
        for (max, min) in [(Some(1e9), None), (None, Some(0.0))] {
            let mut watch = Watch::new(&requirement(max, min, None));
            watch.observe(1.0, Some(0.5));
            watch.observe(2.0, None);
            let verdict = watch.judged();
            assert!(!verdict.met);
            assert_eq!(
                (verdict.value, verdict.margin, verdict.time_s),
                (None, None, Some(2.0))
            );
        }
    }
}
