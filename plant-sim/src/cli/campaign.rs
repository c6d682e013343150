//! `plant-sim campaign`: many short runs with a fault each, judged.

use std::env;
use std::fs::File;
use std::io::{self, BufWriter};
use std::num::NonZero;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use plant_sim::campaign::plan::{self, Plan};
use plant_sim::campaign::shard::Shard;
use plant_sim::campaign::{CampaignError, cases, merge, picture, shrink, work};
use plant_sim::run::{self, Recording};
use plant_sim::say;
use plant_sim::{output, report};
use sim::campaign::case::Case;
use sim::campaign::trial;
use sim::campaign::verdict::Verdict;
use sim::controller::InProcess;
use sim::curves::Curves;
use sim::summary::Collector;

use super::values::{count, jobs, svg};
use super::{Failure, show};

/// Subcommands of `campaign`.
#[derive(Subcommand)]
pub(super) enum CampaignCommand {
    /// Write the cases of a campaign, one a line: situations x faults x windows.
    Plan(PlanArgs),
    /// Run the cases of a plan, or a part of them, on every core.
    Run(RunArgs),
    /// Put the results of all parts together, on standard output: the same bytes however they were divided.
    Merge(FoldersArgs),
    /// Show the worst cases by fault and situation, and how many held what is promised.
    Report(ReportArgs),
    /// List the parts without complete and valid results, as a job array takes them: 1,3-5.
    Missing(FoldersArgs),
    /// Run one case with trace, truth, summary and page.
    Replay(ReplayArgs),
    /// Find the smallest fault, latest and shortest, with which a case still fails; write a plan of it.
    Shrink(CaseArgs),
}

/// Arguments of `plan`.
#[derive(Args)]
pub(super) struct PlanArgs {
    /// What to cross, instead of what comes with the program (docs/campaign.md).
    #[arg(long, value_name = "FILE")]
    cases: Option<PathBuf>,
    /// Draw this many cases at random instead of all.
    #[arg(long, value_name = "N", value_parser = count)]
    count: Option<NonZero<u32>>,
    /// Seed of the draw.
    #[arg(
        long, value_name = "N", default_value_t = 0, requires = "count",
        value_parser = clap::value_parser!(u64).range(..=i64::MAX.unsigned_abs())
    )]
    seed: u64,
}

/// Arguments of `run`.
#[derive(Args)]
pub(super) struct RunArgs {
    /// The plan.
    plan: PathBuf,
    /// Run part K of N only, counted from 0. In a job array of Slurm, Kubernetes or AWS Batch, N alone: K is that of the job,
    /// and of Slurm N as well.
    #[arg(long, value_name = "K/N|N")]
    shard: Option<String>,
    /// Threads; as many as the machine has cores if left out.
    #[arg(long, value_name = "N", value_parser = count)]
    jobs: Option<NonZero<u32>>,
    /// Keep the results that are there, as far as they are good, and go on after them.
    #[arg(long)]
    resume: bool,
    /// Where the results go: results-K-of-N.jsonl.
    #[arg(long, value_name = "DIR", default_value = "campaign")]
    out: PathBuf,
}

/// Folders of results.
#[derive(Args)]
pub(super) struct FoldersArgs {
    /// Folders of results.
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
}

/// Arguments of `report`.
#[derive(Args)]
pub(super) struct ReportArgs {
    /// Merged results; - for standard input.
    results: PathBuf,
    /// Write the worst cases as a picture, too.
    #[arg(long, value_name = "FILE.svg", value_parser = svg)]
    picture: Option<PathBuf>,
}

/// A case of a plan.
#[derive(Args)]
pub(super) struct CaseArgs {
    /// The plan.
    plan: PathBuf,
    /// Number of the case.
    #[arg(value_parser = number_of_case)]
    case: u64,
}

fn number_of_case(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| "allowed: a whole number from 0, as in the plan and the results".into())
}

/// Arguments of `replay`.
#[derive(Args)]
pub(super) struct ReplayArgs {
    #[command(flatten)]
    case: CaseArgs,
    /// Where trace.log, truth.csv, summary.json and report.html go.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
}

impl From<CampaignError> for Failure {
    fn from(error: CampaignError) -> Self {
        match error {
            CampaignError::Output(error) => error.into(),
            error => Self::usage(error),
        }
    }
}

/// Executes a subcommand.
pub(super) fn run(command: &CampaignCommand) -> Result<(), Failure> {
    match command {
        CampaignCommand::Plan(args) => plan(args),
        CampaignCommand::Run(args) => work(args),
        CampaignCommand::Merge(args) => {
            // Twice, so that nothing is written of results that do not belong together.
            merge::merge(&args.folders, &mut io::sink())?;
            Ok(merge::merge(&args.folders, &mut output())?)
        }
        CampaignCommand::Report(args) => report(args),
        CampaignCommand::Missing(args) => show(&(merge::missing(&args.folders)? + "\n")),
        CampaignCommand::Replay(args) => replay(args),
        CampaignCommand::Shrink(args) => shrink(args),
    }
}

fn output() -> BufWriter<io::StdoutLock<'static>> {
    BufWriter::new(io::stdout().lock())
}

/// A reader that has closed the pipe (`| head`) is not an error.
fn written(result: io::Result<()>) -> Result<(), Failure> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("cannot write to standard output: {error}").into())
        }
        _ => Ok(()),
    }
}

fn plan(args: &PlanArgs) -> Result<(), Failure> {
    let crossing = cases::load(args.cases.as_deref())?;
    let scenes = plan::scenes(&crossing);
    written(match args.count {
        Some(count) => {
            let draw = || crossing.sample(count.get().into(), args.seed);
            plan::write(scenes, draw, &mut output())
        }
        None => plan::write(scenes, || crossing.all(), &mut output()),
    })
}

fn work(args: &RunArgs) -> Result<(), Failure> {
    let shard = shard(args.shard.as_deref(), |name| env::var(name).ok()).map_err(Failure::usage)?;
    let jobs = jobs(args.jobs);
    let plan = Plan::open(&args.plan)?;
    let done = work::work(&plan, shard, jobs, args.resume, &args.out)?;
    let out = args.out.display();
    show(&format!(
        "{} cases run, {} kept, {} missed a requirement; the results are in {}: plant-sim campaign merge {out} | plant-sim campaign report -\n",
        done.run,
        done.kept,
        done.missed,
        args.out.join(shard.file()).display()
    ))?;
    if done.missed > 0 {
        return Err(Failure::failed(format!(
            "{} of {} cases missed a requirement",
            done.missed,
            done.run + done.kept
        )));
    }
    Ok(())
}

/// Variables in which a job array keeps the number of a job, from 0.
const PARTS: [&str; 3] = [
    "SLURM_ARRAY_TASK_ID",
    "JOB_COMPLETION_INDEX",
    "AWS_BATCH_JOB_ARRAY_INDEX",
];
/// The one in which Slurm keeps how many there are.
const NUMBER: &str = "SLURM_ARRAY_TASK_COUNT";

/// Which part of the plan is meant, by `--shard` and by the job array around this process.
fn shard(given: Option<&str>, variable: impl Fn(&str) -> Option<String>) -> Result<Shard, String> {
    let wrong = |why: &str| format!("--shard: {why}");
    if let Some(given) = given.filter(|given| given.contains('/')) {
        return given.parse().map_err(|why: String| wrong(&why));
    }
    let part = PARTS.iter().find_map(|name| variable(name));
    let number = given.map(str::to_owned);
    match (part, number.or_else(|| variable(NUMBER))) {
        (None, None) => Ok(Shard::WHOLE),
        (Some(part), Some(number)) => format!("{part}/{number}").parse().map_err(|why: String| {
            wrong(&format!(
                "the job array says part {part} of {number}; {why}"
            ))
        }),
        (Some(part), None) => Err(wrong(&format!(
            "this is job {part} of an array, of how many is not known; add --shard N"
        ))),
        (None, Some(_)) => Err(wrong(
            "a number alone needs a job array around it; elsewhere: --shard K/N with K from 0 to N-1",
        )),
    }
}

fn report(args: &ReportArgs) -> Result<(), Failure> {
    let path = args.results.as_path();
    if path.is_dir() {
        return Err(Failure::usage(format!(
            "{0} is a folder of results; merge them first: plant-sim campaign merge {0} | plant-sim campaign report -",
            path.display()
        )));
    }
    let tally = if path == Path::new("-") {
        merge::tally(Path::new("standard input"), io::stdin().lock())?
    } else {
        let file = File::open(path).map_err(|source| CampaignError::Read {
            path: path.into(),
            source,
        })?;
        merge::tally(path, file)?
    };
    if let Some(file) = &args.picture {
        output::write(file, &picture::page(&tally))?;
    }
    show(&tally.to_string())?;
    match tally.missed() {
        0 => Ok(()),
        missed => Err(Failure::failed(format!(
            "{missed} of {} cases missed a requirement",
            tally.cases()
        ))),
    }
}

fn replay(args: &ReplayArgs) -> Result<(), Failure> {
    let plan = Plan::open(&args.case.plan)?;
    let case = plan.case(args.case.case)?;
    let config = plan.config(&case)?;
    let folder = run::folder(&args.out)?;
    let recording = Recording {
        folder: &folder,
        traces: true,
        progress: false,
    };
    let mut curves = Curves::new(&config);
    let mut verdict = None;
    let begin = || Ok(config.rig().map(drop)?);
    let results = run::record(&config, &recording, &mut curves, begin, |(), observers| {
        let mut all = (Collector::new(&config), observers);
        let connect = |config| Ok(InProcess::new(config));
        let (judged, rig, end) = trial::run(&config, connect, &mut all)?;
        verdict = Some(judged);
        Ok(all.0.finish(&config, &rig, &end))
    })?;
    let page = report::page(&results, &curves.finish(&config));
    folder.write(report::FILE, &page)?;
    match verdict {
        Some(verdict) => conclude(&case, &verdict),
        None => Ok(()),
    }
}

/// Shows a verdict; one that missed something is a failure.
fn conclude(case: &Case, verdict: &Verdict) -> Result<(), Failure> {
    let verdict_text = serde_json::to_string_pretty(verdict).map_err(|error| error.to_string())?;
    show(&(verdict_text + "\n"))?;
    if verdict.missed.is_empty() {
        return Ok(());
    }
    Err(Failure::failed(format!(
        "case {} missed {}",
        case.case,
        missed(verdict)
    )))
}

fn missed(verdict: &Verdict) -> String {
    let names: Vec<_> = verdict.missed.iter().map(|one| one.name()).collect();
    names.join(", ")
}

fn shrink(args: &CaseArgs) -> Result<(), Failure> {
    let plan = Plan::open(&args.plan)?;
    let case = plan.case(args.case)?;
    let shrunk = shrink::shrink(&plan, &case)?.ok_or_else(|| {
        Failure::nothing_judged(format!(
            "case {} misses nothing: there is nothing to shrink",
            case.case
        ))
    })?;
    let faults: Vec<_> = shrunk
        .case
        .faults
        .iter()
        .map(|one| one.text.as_str())
        .collect();
    say!(
        "{}: {} misses {}",
        case.situation,
        faults.join(" + "),
        missed(&shrunk.verdict)
    );
    written(plan.write_one(&shrunk.case, &mut output()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(given: Option<&str>, variables: &[(&str, &str)]) -> Result<(u64, u64), String> {
        let variable = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        shard(given, variable).map(|shard| (shard.part, shard.of))
    }

    #[test]
    fn the_part_is_that_of_the_option_or_of_the_job_array() {
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", "3"),
            ("SLURM_ARRAY_TASK_COUNT", "4"),
        ];
        assert_eq!(of(None, &[]), Ok((0, 1)));
        assert_eq!(of(Some("2/5"), &[]), Ok((2, 5)));
        assert_eq!(of(None, &slurm), Ok((3, 4)));
        // Tasks that are run again have numbers of the first array, and a count of their own.
        assert_eq!(of(Some("8"), &slurm), Ok((3, 8)));
        assert_eq!(of(Some("2/5"), &slurm), Ok((2, 5)));
        assert_eq!(of(Some("4"), &[("JOB_COMPLETION_INDEX", "1")]), Ok((1, 4)));
        assert_eq!(
            of(Some("4"), &[("AWS_BATCH_JOB_ARRAY_INDEX", "0")]),
            Ok((0, 4))
        );
    }

    #[test]
    fn a_part_that_cannot_be_is_refused() {
        for (given, variables) in [
            (Some("4/4"), &[][..]),
            (Some("4"), &[]),
            (None, &[("JOB_COMPLETION_INDEX", "1")]),
            (Some("1"), &[("JOB_COMPLETION_INDEX", "1")]),
            (Some("x"), &[("JOB_COMPLETION_INDEX", "1")]),
        ] {
            assert!(of(given, variables).is_err(), "{given:?} {variables:?}");
        }
    }
}
