//! The smallest fault that still fails: fewest, weakest, latest, shortest.

use std::collections::BTreeSet;

use protocol::time::Period;
use sim::campaign::case::{Case, planned, what};
use sim::campaign::prelude::Prelude;
use sim::campaign::verdict::{Requirement, Verdict};
use sim::faults::{End, Fault, Moment, What, Window};
use sim::plant::defect::{EncoderDefect, MotorDefect};

use super::CampaignError;
use super::plan::Plan;
use super::work::judge;

/// Halvings of a value: it is then known to a thousandth.
const HALVINGS: u32 = 10;
/// Longest window that is tried instead of a fault that stays, and farthest beginning, µs.
const HORIZON: u64 = 4_000_000;
/// Times are found to this, µs.
const RESOLUTION: u64 = 1_000;

/// A case that still misses what the first one does, and what becomes of it.
#[derive(Clone, Debug)]
pub struct Shrunk {
    /// The case.
    pub case: Case,
    /// Its verdict.
    pub verdict: Verdict,
}

/// Makes the faults of a case smaller as long as it misses one of the requirements that it misses now; `None` for one that misses
/// none.
///
/// # Errors
/// The case cannot begin.
pub fn shrink(plan: &Plan, case: &Case) -> Result<Option<Shrunk>, CampaignError> {
    let mut prelude = None;
    let verdict = judge(plan, case, &mut prelude)?;
    if verdict.missed.is_empty() {
        return Ok(None);
    }
    let mut search = Search {
        plan,
        prelude,
        rate_hz: plan.config(case)?.scenario.rate_hz,
        missed: verdict.missed.clone(),
        found: Shrunk {
            case: case.clone(),
            verdict,
        },
    };
    search.drop_faults()?;
    for index in 0..search.found.case.faults.len() {
        search.weaken(index)?;
        search.delay(index)?;
        search.shorten(index)?;
    }
    Ok(Some(search.found))
}

struct Search<'p> {
    plan: &'p Plan,
    prelude: Option<Prelude>,
    rate_hz: f64,
    missed: BTreeSet<Requirement>,
    found: Shrunk,
}

impl Search<'_> {
    /// Whether these faults fail, too; then they are what has been found.
    fn fails(&mut self, faults: Vec<Fault>) -> Result<bool, CampaignError> {
        let case = Case {
            faults,
            ..self.found.case.clone()
        };
        let verdict = judge(self.plan, &case, &mut self.prelude)?;
        let fails = !verdict.missed.is_disjoint(&self.missed);
        if fails {
            self.found = Shrunk { case, verdict };
        }
        Ok(fails)
    }

    fn fails_with(&mut self, index: usize, fault: Fault) -> Result<bool, CampaignError> {
        let mut faults = self.found.case.faults.clone();
        faults[index] = fault;
        self.fails(faults)
    }

    fn drop_faults(&mut self) -> Result<(), CampaignError> {
        let mut index = 0;
        while index < self.found.case.faults.len() {
            let mut fewer = self.found.case.faults.clone();
            fewer.remove(index);
            if !self.fails(fewer)? {
                index += 1;
            }
        }
        Ok(())
    }

    /// Brings the value towards harmless.
    fn weaken(&mut self, index: usize) -> Result<(), CampaignError> {
        let fault = self.found.case.faults[index].clone();
        let Some((name, value)) = what(&fault).split_once('=') else {
            return Ok(());
        };
        let Ok(value) = value.parse::<f64>() else {
            return Ok(());
        };
        let harmless = match fault.what {
            What::Motor(_, MotorDefect::Weak(_)) => 1.0,
            // The number of a bit is no measure.
            What::Encoder(_, EncoderDefect::BitLost(_)) => return Ok(()),
            _ => 0.0,
        };
        let (mut fails, mut holds) = (value, harmless);
        let window = fault.text.split_once('@').map_or("", |(_, window)| window);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (fails + holds);
            // A value that the kind does not take holds as well.
            let weaker = format!("{name}={middle}@{window}").parse::<Fault>();
            if weaker.map_or(Ok(false), |weaker| self.fails_with(index, weaker))? {
                fails = middle;
            } else {
                holds = middle;
            }
        }
        Ok(())
    }

    fn delay(&mut self, index: usize) -> Result<(), CampaignError> {
        let fault = self.found.case.faults[index].clone();
        let Some((begin, last)) = self.window(&fault) else {
            return Ok(());
        };
        let (mut fails, mut holds) = (begin, begin + HORIZON);
        while holds - fails > RESOLUTION {
            let middle = u64::midpoint(fails, holds);
            if self.fails_at(index, &fault, middle, last)? {
                fails = middle;
            } else {
                holds = middle;
            }
        }
        Ok(())
    }

    fn shorten(&mut self, index: usize) -> Result<(), CampaignError> {
        let fault = self.found.case.faults[index].clone();
        let Some((begin, last)) = self.window(&fault) else {
            return Ok(());
        };
        let (mut fails, mut holds) = (if last == 0 { HORIZON } else { last }, 0);
        while fails - holds > RESOLUTION {
            let middle = u64::midpoint(fails, holds);
            if self.fails_at(index, &fault, begin, middle)? {
                fails = middle;
            } else {
                holds = middle;
            }
        }
        Ok(())
    }

    fn fails_at(
        &mut self,
        index: usize,
        fault: &Fault,
        begin: u64,
        last: u64,
    ) -> Result<bool, CampaignError> {
        let moved = planned(what(fault), after(fault), begin, last);
        moved.map_or(Ok(false), |moved| self.fails_with(index, moved))
    }

    /// Beginning and duration, µs; 0 for a fault that stays. `None` for one that lasts as long as something else.
    fn window(&self, fault: &Fault) -> Option<(u64, u64)> {
        let Window::From(Moment { after, .. }, end) = fault.window else {
            return None;
        };
        let period = Period::of_rate(self.rate_hz);
        let micros = |span: sim::faults::Span| span.time(period).micros();
        let begin = micros(after);
        let last = match end {
            End::Never => 0,
            End::At(until) => micros(until).saturating_sub(begin),
            End::After(lasts) => micros(lasts),
        };
        Some((begin, last))
    }
}

/// What the beginning counts from; empty for the run.
fn after(fault: &Fault) -> &str {
    match fault.window {
        Window::From(Moment { of: Some(_), .. }, _) => {
            let window = fault.text.split_once('@').map_or("", |(_, window)| window);
            window.split(['+', '.']).next().unwrap_or_default()
        }
        _ => "",
    }
}
