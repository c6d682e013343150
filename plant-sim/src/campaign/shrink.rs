//! The smallest fault that still fails: fewest, weakest, latest, shortest.

use std::collections::BTreeSet;

use protocol::time::Instant;
use sim::campaign::case::{Case, planned, what};
use sim::campaign::verdict::{Requirement, Verdict};
use sim::faults::{Fault, What};
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
    let verdict = judge(plan, case)?;
    if verdict.missed.is_empty() {
        return Ok(None);
    }
    let mut search = Search {
        plan,
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
        let verdict = judge(self.plan, &case)?;
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
        for _ in 0..HALVINGS {
            let middle = 0.5 * (fails + holds);
            let (begin, last) = window(&fault);
            // A value that the kind does not take holds as well.
            let weaker = planned(&format!("{name}={middle}"), begin, last);
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
        let (begin, last) = window(&fault);
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
        let (begin, last) = window(&fault);
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
        let moved = planned(what(fault), begin, last);
        moved.map_or(Ok(false), |moved| self.fails_with(index, moved))
    }
}

/// Beginning and duration, µs; 0 for a fault that stays.
fn window(fault: &Fault) -> (u64, u64) {
    let last = match fault.until {
        Instant::MAX => 0,
        until => until.since(fault.from).micros(),
    };
    (fault.from.micros(), last)
}
