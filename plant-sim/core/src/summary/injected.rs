//! When the faults of a scenario were in effect.

use protocol::time::{Instant, Period};
use schemars::JsonSchema;
use serde::Serialize;

use crate::scenario::Scenario;

/// A fault of the scenario, and when it was in effect. A fault that is in effect need not have a consequence: a message is lost only
/// where it is sent.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Injected {
    /// As it was written.
    pub fault: String,
    /// How often it began: more than once with `while` alone.
    pub times: u32,
    /// From when on, the first time, s; `null` if never.
    pub from_s: Option<f64>,
    /// Until when, the last time, s: at the latest the end of the run; `null` if never.
    pub until_s: Option<f64>,
}

/// The windows of the faults while a run goes.
pub(super) struct Windows {
    faults: Vec<Open>,
}

/// The windows of one fault.
#[derive(Clone, Copy, Default)]
struct Open {
    times: u32,
    first: Option<Instant>,
    /// The last one.
    last: Option<(Instant, Instant)>,
}

impl Open {
    fn set(&mut self, from: Instant, until: Instant) {
        if from == Instant::MAX {
            return;
        }
        if self.last.is_none_or(|(last, _)| last != from) {
            self.times += 1;
        }
        self.first.get_or_insert(from);
        self.last = Some((from, until));
    }
}

impl Windows {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let period = Period::of_rate(scenario.rate_hz);
        let open = |window: Option<(Instant, Instant)>| {
            let mut open = Open::default();
            if let Some((from, until)) = window {
                open.set(from, until);
            }
            open
        };
        let faults = scenario.faults.iter();
        Self {
            faults: faults
                .map(|fault| open(fault.window.fixed(period)))
                .collect(),
        }
    }

    /// The window of a fault becomes known, or changes.
    pub(super) fn set(&mut self, number: usize, from: Instant, until: Instant) {
        if let Some(open) = self.faults.get_mut(number) {
            open.set(from, until);
        }
    }

    /// What became of each fault in a run that has ended.
    pub(super) fn finish(self, scenario: &Scenario, end: Instant) -> Vec<Injected> {
        let faults = scenario.faults.iter().zip(self.faults);
        let injected = faults.map(|(fault, Open { times, first, last })| {
            let came = first.is_some_and(|first| first < end);
            // The last window may have been planned for a time that the run did not reach.
            let until = last.map(|(_, until)| until.min(end).seconds());
            Injected {
                fault: fault.text.clone(),
                times: if came { times } else { 0 },
                from_s: first.filter(|_| came).map(Instant::seconds),
                until_s: until.filter(|_| came),
            }
        });
        injected.collect()
    }
}
