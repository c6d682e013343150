//! Cases of a campaign: a situation, and what breaks in it.

use oorandom::Rand64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::faults::{Fault, FaultError};
use crate::scenario::Scenario;

/// One case.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct Case {
    /// Number in the plan, counted from 0.
    pub case: u64,
    /// Name of the situation.
    pub situation: String,
    /// What breaks, and when; nothing in a case that looks for false alarms.
    #[schemars(with = "Vec<String>")]
    pub faults: Vec<Fault>,
    /// Seed of whatever is random in the faults.
    pub seed: u64,
}

impl Case {
    /// The scenario of its situation with its faults.
    pub fn scenario(&self, situation: &Scenario) -> Scenario {
        Scenario {
            faults: self.faults.clone(),
            seed: self.seed,
            ..situation.clone()
        }
    }
}

/// Kinds of the faults, without axis, value and window: rows of a table.
pub fn kinds(faults: &[Fault]) -> String {
    let kind = |fault: &Fault| {
        let what = what(fault).split('=').next().unwrap_or_default();
        match what.split(':').collect::<Vec<_>>()[..] {
            [place, _, kind] => format!("{place}:{kind}"),
            _ => what.into(),
        }
    };
    if faults.is_empty() {
        return "none".into();
    }
    faults.iter().map(kind).collect::<Vec<_>>().join(" + ")
}

/// The text of a fault up to its window.
pub fn what(fault: &Fault) -> &str {
    fault.text.split('@').next().unwrap_or_default()
}

/// What the robot does while something breaks, and when that may begin.
#[derive(Clone, Debug)]
pub struct Situation {
    /// Name.
    pub name: String,
    /// What it does.
    pub scenario: Scenario,
    /// What the beginnings of faults count from, as a window has it: `jump2`; empty for the run.
    pub after: String,
    /// Earliest beginning of a fault, µs.
    pub from: u64,
    /// Latest, µs.
    pub until: u64,
    /// Time from one beginning to the next, µs; at least 1.
    pub step: u64,
}

impl Situation {
    fn begins(&self) -> u64 {
        self.until.saturating_sub(self.from) / self.step + 1
    }
}

/// Every situation with every fault, beginning and duration.
#[derive(Clone, Debug)]
pub struct Crossing {
    situations: Vec<Situation>,
    /// By fault: texts without windows of what breaks at the same time.
    faults: Vec<Vec<String>>,
    /// How long a fault lasts, µs; 0 for one that stays.
    lasts: Vec<u64>,
}

impl Crossing {
    /// A crossing; in a text of `faults`, ` + ` joins what breaks together, and `none` breaks nothing.
    ///
    /// # Errors
    /// The first text that is not a fault.
    pub fn new(
        situations: Vec<Situation>,
        faults: &[String],
        lasts: Vec<u64>,
    ) -> Result<Self, FaultError> {
        let split = |text: &String| match text.as_str() {
            "none" => Vec::new(),
            text => text.split(" + ").map(str::to_owned).collect(),
        };
        let faults: Vec<Vec<String>> = faults.iter().map(split).collect();
        for what in faults.iter().flatten() {
            planned(what, "", 0, 0)?;
        }
        Ok(Self {
            situations,
            faults,
            lasts,
        })
    }

    /// Its situations.
    pub fn situations(&self) -> &[Situation] {
        &self.situations
    }

    /// Number of cases.
    pub fn len(&self) -> u64 {
        let each = (self.faults.len() * self.lasts.len()) as u64;
        self.situations
            .iter()
            .map(|situation| situation.begins() * each)
            .sum()
    }

    /// Whether there is nothing to cross.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The case at this place of the crossing, as number `number` of a plan; `None` past the end.
    pub fn case(&self, mut place: u64, number: u64) -> Option<Case> {
        let (faults, lasts) = (self.faults.len() as u64, self.lasts.len() as u64);
        let situation = self.situations.iter().find(|situation| {
            let here = situation.begins() * faults * lasts;
            let found = place < here;
            if !found {
                place -= here;
            }
            found
        })?;
        let faults_of = &self.faults[(place % faults) as usize];
        let last = self.lasts[(place / faults % lasts) as usize];
        let begin = situation.from + place / faults / lasts * situation.step;
        let after = &situation.after;
        let faults = faults_of
            .iter()
            .map(|what| planned(what, after, begin, last));
        Some(Case {
            case: number,
            situation: situation.name.clone(),
            faults: faults.collect::<Result<_, _>>().ok()?,
            seed: number,
        })
    }

    /// All cases in order.
    pub fn all(&self) -> impl Iterator<Item = Case> {
        (0..self.len()).map_while(|place| self.case(place, place))
    }

    /// `count` cases drawn at random, each from all of them: what holds for the sample holds for the whole with the confidence of
    /// a binomial.
    pub fn sample(&self, count: u64, seed: u64) -> impl Iterator<Item = Case> {
        let mut random = Rand64::new(seed.into());
        let all = self.len();
        (0..count).map_while(move |number| self.case(random.rand_range(0..all), number))
    }
}

/// The fault `what` from `begin` for `last` µs, or for ever; `begin` counts from the run, or from what `after` says.
///
/// # Errors
/// It is not a fault.
pub fn planned(what: &str, after: &str, begin: u64, last: u64) -> Result<Fault, FaultError> {
    let ms = |us: u64| us as f64 / 1e3;
    let from = match after {
        "" => format!("{}ms", ms(begin)),
        _ => format!("{after}+{}ms", ms(begin)),
    };
    let until = match (after, last) {
        (_, 0) => String::new(),
        ("", _) => format!("..{}ms", ms(begin + last)),
        _ => format!("..+{}ms", ms(last)),
    };
    format!("{what}@{from}{until}").parse()
}
