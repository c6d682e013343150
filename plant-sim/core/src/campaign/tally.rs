//! Worst cases by fault and situation, and how often a requirement was missed.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};

use super::case::{Case, kinds};
use super::verdict::{Requirement, Verdict};
use crate::maths::{exp, ln};

/// A case and what became of it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Outcome {
    /// Which.
    pub case: Case,
    /// What became of it.
    pub verdict: Verdict,
}

/// Counts and worst cases of many outcomes. Its size is that of the tables, however many there are.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    all: Row,
    /// By kind of fault and situation.
    rows: BTreeMap<(String, String), Row>,
    /// Missed cases by kind of fault and requirement, and the first of them.
    misses: BTreeMap<(String, Requirement), (u64, u64)>,
    /// Cases of which no fault began, or none acted, and such of which one of several does not show.
    never_began: Group,
    never_acted: Group,
    unseen: Group,
}

/// How many cases, and the first of them.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    cases: u64,
    first: u64,
}

impl Group {
    fn add(&mut self, case: u64, counts: bool) {
        if counts {
            self.first = if self.cases == 0 {
                case
            } else {
                self.first.min(case)
            };
            self.cases += 1;
        }
    }
}

/// Counts and worst cases of a kind of fault in a situation.
#[derive(Clone, Debug, Default)]
struct Row {
    cases: u64,
    missed: u64,
    survived: u64,
    detection_ms: Greatest,
    standstill_ms: Greatest,
    distance_mm: Greatest,
    energy_j: Greatest,
    drop_mm: Greatest,
}

/// The worst case of a kind of fault in a situation; `None` where nothing had to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Way of the tool until standstill, mm.
    pub distance_mm: Option<f64>,
    /// Greatest kinetic energy, J.
    pub energy_j: Option<f64>,
    /// Time until standstill, ms.
    pub standstill_ms: Option<f64>,
}

/// The greatest of the values present.
#[derive(Clone, Copy, Debug, Default)]
struct Greatest(Option<f64>);

impl Greatest {
    fn add(&mut self, value: Option<f64>) {
        self.0 = [self.0, value].into_iter().flatten().reduce(f64::max);
    }
}

impl fmt::Display for Greatest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(value) => write!(f, "{value:.1}"),
            None => Ok(()),
        }
    }
}

impl Row {
    fn add(&mut self, verdict: &Verdict) {
        self.cases += 1;
        self.missed += u64::from(!verdict.missed.is_empty());
        self.survived += u64::from(verdict.survived);
        self.detection_ms.add(verdict.detection_ms);
        self.standstill_ms.add(verdict.standstill_ms);
        self.distance_mm.add(verdict.distance_mm);
        self.energy_j.add(verdict.energy_j);
        self.drop_mm.add(verdict.drop_mm);
    }
}

impl Tally {
    /// Counts one more.
    pub fn add(&mut self, outcome: &Outcome) {
        let Outcome { case, verdict } = outcome;
        let kinds = kinds(&case.faults);
        for requirement in &verdict.missed {
            let miss = self.misses.entry((kinds.clone(), *requirement));
            let (count, first) = miss.or_insert((0, case.case));
            *count += 1;
            *first = case.case.min(*first);
        }
        let held = verdict.missed.is_empty();
        self.never_began.add(case.case, held && verdict.never_began);
        self.never_acted.add(case.case, held && verdict.never_acted);
        self.unseen.add(case.case, !verdict.unseen.is_empty());
        self.all.add(verdict);
        let row = self.rows.entry((kinds, case.situation.clone()));
        row.or_default().add(verdict);
    }

    /// Number of cases.
    pub fn cases(&self) -> u64 {
        self.all.cases
    }

    /// Number of cases that missed a requirement.
    pub fn missed(&self) -> u64 {
        self.all.missed
    }

    /// The worst cases, with kind of fault and situation.
    pub fn worst(&self) -> impl Iterator<Item = (&str, &str, Worst)> {
        self.rows.iter().map(|((kind, situation), row)| {
            let worst = Worst {
                distance_mm: row.distance_mm.0,
                energy_j: row.energy_j.0,
                standstill_ms: row.standstill_ms.0,
            };
            (kind.as_str(), situation.as_str(), worst)
        })
    }

    /// What was missed by which kind of fault.
    pub fn misses(&self) -> BTreeSet<(String, Requirement)> {
        self.misses.keys().cloned().collect()
    }
}

/// The report, as Markdown.
impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| fault | situation | cases | missed | survived | detected, ms | standstill, ms | way, mm | energy, J | lift down, mm |"
        )?;
        writeln!(f, "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|")?;
        for ((kinds, situation), row) in &self.rows {
            writeln!(
                f,
                "| {kinds} | {situation} | {} | {} | {} | {} | {} | {} | {} | {} |",
                row.cases,
                row.missed,
                row.survived,
                row.detection_ms,
                row.standstill_ms,
                row.distance_mm,
                row.energy_j,
                row.drop_mm
            )?;
        }
        let Row { cases, missed, .. } = self.all;
        let judged = cases - self.never_began.cases - self.never_acted.cases;
        // A bound is not rounded down.
        let bound = (miss_rate_bound(judged, missed) * 1e5).ceil() / 1e3;
        writeln!(
            f,
            "\n{cases} cases: {} held, {missed} missed a requirement; with a confidence of 95 % fewer than {bound:.3} % do \
             (Clopper-Pearson)",
            judged - missed
        )?;
        for (some, what) in [
            (
                self.never_began,
                "are not counted: their runs ended before any of their faults began",
            ),
            (
                self.never_acted,
                "are not counted: none of their faults had anything to act on, as nobody sent the message",
            ),
            (
                self.unseen,
                "do not show each of their faults: one had nothing to act on, or another had stopped the arm, or was told",
            ),
        ] {
            if some.cases > 0 {
                writeln!(
                    f,
                    "\n{} of them {what}, the first of them case {}",
                    some.cases, some.first
                )?;
            }
        }
        if self.misses.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "\n| fault | missed | cases | the first |\n|---|---|--:|--:|"
        )?;
        for ((kinds, requirement), (count, first)) in &self.misses {
            writeln!(
                f,
                "| {kinds} | {} | {count} | {first} |",
                requirement.name()
            )?;
        }
        Ok(())
    }
}

/// Upper bound of a rate of which `missed` in `cases` were seen, with a confidence of 95 % (Clopper and Pearson 1934): the rate
/// at which so few would be seen only once in twenty times.
pub fn miss_rate_bound(cases: u64, missed: u64) -> f64 {
    if missed >= cases {
        return 1.0;
    }
    let (mut low, mut high) = (missed as f64 / cases as f64, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(cases as f64, missed, middle) > 0.05 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Probability of at most `most` hits in `n` trials of probability `p`.
fn at_most(n: f64, most: u64, p: f64) -> f64 {
    // The first terms are far below the least number there is: their logarithms are not. From the greatest term that counts
    // the terms fall in both directions, so the sum is taken relative to it.
    let odds = ln(p) - ln(1.0 - p);
    let mut term = n * ln(1.0 - p);
    let (mut scale, mut sum) = (term, 1.0);
    for hits in 0..most {
        term += ln((n - hits as f64) / (hits as f64 + 1.0)) + odds;
        if term > scale {
            sum = sum * exp(scale - term) + 1.0;
            scale = term;
        } else {
            sum += exp(term - scale);
        }
    }
    exp(scale + ln(sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two cases with a closed form: no hit, and one short of all.
    #[test]
    fn bounds_without_a_hit_and_with_all_but_one_are_powers() {
        for n in [1_u64, 2, 10, 59, 1000, 100_000, 1_000_000] {
            let none = 1.0 - exp(ln(0.05) / n as f64);
            assert!((miss_rate_bound(n, 0) / none - 1.0).abs() < 1e-9, "{n}");
        }
        for n in [2_u64, 10, 1000, 100_000] {
            let all_but_one = exp(ln(0.95) / n as f64);
            let bound = miss_rate_bound(n, n - 1);
            assert!((bound - all_but_one).abs() < 1e-9, "{n}: {bound}");
        }
        assert_eq!(miss_rate_bound(5, 5), 1.0);
        assert_eq!(miss_rate_bound(0, 0), 1.0);
    }

    fn outcome(case: u64, never_began: bool) -> Outcome {
        let case = format!(
            r#"{{"case": {case}, "situation": "a", "faults": ["drives:silent@9s"], "seed": 0}}"#
        );
        let verdict = format!(
            r#"{{"missed": [], "survived": true, "never_began": {never_began}, "detected": null, "detection_ms": null,
            "standstill_ms": null, "distance_mm": null, "energy_j": null, "drop_mm": null}}"#
        );
        Outcome {
            case: serde_json::from_str(&case).unwrap(),
            verdict: serde_json::from_str(&verdict).unwrap(),
        }
    }

    /// Of 59 cases without a miss the bound is 1 - 0.05^(1/59), 4.9508 %: those in which nothing broke are none of them.
    #[test]
    fn a_case_in_which_nothing_broke_is_not_held() {
        let mut tally = Tally::default();
        for case in 0..70 {
            tally.add(&outcome(case, case >= 59));
        }
        let text = tally.to_string();
        for part in [
            "70 cases: 59 held, 0 missed",
            "fewer than 4.951 % do",
            "11 of them are not counted",
            "the first of them case 59",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    /// Five of a hundred, from the sum of binomials with exact coefficients.
    #[test]
    fn a_bound_in_between_is_that_of_the_definition() {
        assert!((miss_rate_bound(100, 5) - 0.102_253_377_6).abs() < 1e-9);
    }
}
