//! The work of a shard: its cases on every core, their results in order.

use std::num::NonZero;
use std::path::Path;

use sim::campaign::case::Case;
use sim::campaign::tally::Outcome;
use sim::campaign::trial;
use sim::campaign::verdict::Verdict;
use sim::controller::InProcess;

use super::CampaignError;
use super::plan::{self, Plan};
use super::shard::{Beginning, Results, Shard, ShardHeader};
use crate::parallel;
use crate::progress::Progress;

/// Cases of a batch for each thread. The threads wait for each other at its end, for as long as one case takes.
const BATCH: usize = 50;

/// What a shard has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Done {
    /// Cases run now; those that were there are not among them.
    pub cases: u64,
    /// How many of them missed a requirement.
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
    let mut done = Done::default();
    let header = ShardHeader::new(plan, shard);
    let Beginning::After(last, mut results) = Results::open(folder, &header, resume)? else {
        return Ok(done);
    };
    let left = |case: &u64| shard.has(*case) && last.is_none_or(|last| *case > last);
    let before = last.map_or(0, |last| shard.share(last + 1));
    let mut progress = Progress::of_cases(shard.share(header.cases) - before);
    let mut cases = plan
        .cases()?
        .filter(|case| case.as_ref().map_or(true, |case| left(&case.case)));
    loop {
        let batch = cases.by_ref().take(BATCH * jobs.get());
        let batch: Vec<Case> = batch.collect::<Result<_, _>>()?;
        if batch.is_empty() {
            break;
        }
        let mut lines = String::new();
        let verdicts = parallel::map(&batch, jobs, |case| judge(plan, case));
        for (case, verdict) in batch.into_iter().zip(verdicts) {
            let verdict = verdict?;
            let outcome = Outcome { case, verdict };
            done.cases += 1;
            done.missed += u64::from(!outcome.verdict.missed.is_empty());
            lines += &plan::line(&outcome);
            lines.push('\n');
        }
        results.append(&lines)?;
        progress.add(lines.lines().count() as u64);
    }
    results.complete()?;
    Ok(done)
}

/// What becomes of a case.
///
/// # Errors
/// It cannot begin.
pub fn judge(plan: &Plan, case: &Case) -> Result<Verdict, CampaignError> {
    let config = plan.config(case)?;
    let connect = |config| Ok(InProcess::new(config));
    let trial = trial::run(&config, connect, &mut ());
    let (verdict, ..) = trial.map_err(|error| CampaignError::Case {
        case: case.case,
        what: error.to_string(),
    })?;
    Ok(verdict)
}
