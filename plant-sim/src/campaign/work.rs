//! The work of a shard: its cases on every core, their results in order.

use std::num::NonZero;
use std::path::Path;

use sim::campaign::case::Case;
use sim::campaign::prelude::Prelude;
use sim::campaign::tally::Outcome;
use sim::campaign::verdict::Verdict;
use sim::run::Failure;

use super::CampaignError;
use super::plan::Plan;
use super::results;
use super::shard::{Results, Shard, ShardHeader};
use crate::parallel;
use crate::progress::Progress;

/// Cases of a batch for each thread: so many that the preludes of its situations are a small part of the work. The threads wait for
/// each other at its end, for as long as one case takes.
const BATCH: usize = 200;

/// What a shard has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Done {
    /// Cases run now.
    pub run: u64,
    /// Cases of which the results were there.
    pub kept: u64,
    /// How many of both missed a requirement.
    pub missed: u64,
}

/// Runs those cases of a shard that `folder` has no results of, on `jobs` threads.
///
/// # Errors
/// See [`CampaignError`].
pub fn work(
    plan: &Plan,
    shard: Shard,
    jobs: NonZero<usize>,
    resume: bool,
    folder: &Path,
) -> Result<Done, CampaignError> {
    let header = ShardHeader::new(plan, shard);
    let (kept, results) = Results::open(folder, plan, &header, resume)?;
    let mut done = Done {
        run: 0,
        kept: kept.cases,
        missed: kept.missed,
    };
    let Some(mut results) = results else {
        return Ok(done);
    };
    let mut progress = Progress::of_cases(shard.share(header.cases) - kept.cases);
    let mut cases = plan.cases_of(shard)?.skip(kept.cases as usize);
    loop {
        let batch = cases.by_ref().take(BATCH * jobs.get());
        let batch: Vec<Case> = batch.collect::<Result<_, _>>()?;
        if batch.is_empty() {
            break;
        }
        let mut lines = String::new();
        for (case, verdict) in verdicts(plan, batch, jobs) {
            let verdict = verdict?;
            let outcome = Outcome { case, verdict };
            done.run += 1;
            done.missed += u64::from(!outcome.verdict.missed.is_empty());
            lines += &results::line(&outcome);
            lines.push('\n');
        }
        results.append(&lines)?;
        progress.add(lines.lines().count() as u64);
    }
    results.complete()?;
    Ok(done)
}

/// What becomes of these cases, in the order of their numbers.
fn verdicts(
    plan: &Plan,
    mut cases: Vec<Case>,
    jobs: NonZero<usize>,
) -> Vec<(Case, Result<Verdict, CampaignError>)> {
    // So that a prelude leads up to one case after the other.
    cases.sort_by_cached_key(|case| (case.situation.clone(), plan.onset(case)));
    let verdicts = parallel::map_with(
        &cases,
        jobs,
        || None,
        |prelude, case| judge(plan, case, prelude),
    );
    let mut verdicts: Vec<_> = cases.into_iter().zip(verdicts).collect();
    verdicts.sort_by_key(|(case, _)| case.case);
    verdicts
}

/// What becomes of a case. It begins with `prelude` if that leads to it, and leaves there what may lead to the next one.
///
/// # Errors
/// It cannot begin.
pub fn judge(
    plan: &Plan,
    case: &Case,
    prelude: &mut Option<Prelude>,
) -> Result<Verdict, CampaignError> {
    let config = plan.config(case)?;
    let failed = |error: Failure| CampaignError::Case {
        case: case.case,
        what: error.to_string(),
    };
    let prelude = match prelude {
        Some(begun) if begun.leads_to(&config.scenario) => begun,
        other => other.insert(Prelude::new(&config).map_err(failed)?),
    };
    prelude.judge(&config).map_err(failed)
}
