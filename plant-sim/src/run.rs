//! One run with its results on disk: a trace, the truth and a summary.

use std::path::{Path, PathBuf};
use std::time::Instant;

use firmware::control::controller::Config;
use schemars::JsonSchema;
use serde::Serialize;
use sim::controller::InProcess;
use sim::observer::{Observer, Pace};
use sim::peer::{Peer, PeerError};
use sim::record::{TraceLog, TruthLog};
use sim::run::{Failure, with_controller};
use sim::setup::{RunConfig, SetupError};
use sim::summary::Summary;

use crate::interrupt::Heeding;
use crate::output::{File, Folder, OutputError};
use crate::progress::Progress;

/// Why a run has no results.
#[derive(Debug, thiserror::Error)]
pub enum ExecuteError {
    /// The run cannot begin.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The controller could not be started.
    #[error(transparent)]
    Controller(#[from] PeerError),
    /// Files cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Results of a run, as in `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Results {
    /// Version of the program.
    pub version: &'static str,
    /// Commit that it was built from, its date, and whether sources were modified.
    pub commit: &'static str,
    /// Command line.
    pub command: Vec<String>,
    /// What was run, and its metrics.
    #[serde(flatten)]
    pub summary: Summary,
    /// Time the run took on this machine, s.
    pub wall_time_s: f64,
    /// Simulated over wall time.
    pub real_time_factor: f64,
    /// SHA-256 of `trace.log`; `null` where none is kept.
    pub trace_sha256: Option<String>,
}

impl Results {
    /// The text of `summary.json`.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and texts can be written as JSON") + "\n"
    }
}

const RESULTS: [&str; 5] = [
    "trace.log",
    "truth.csv",
    "summary.json",
    "report.html",
    "controller.log",
];

/// The files that a run may write into the folder `out`.
pub fn results(out: &Path) -> [PathBuf; RESULTS.len()] {
    RESULTS.map(|name| out.join(name))
}

/// The folder `out` for the results of a run.
///
/// # Errors
/// See [`Folder::open`].
pub fn folder(out: &Path) -> Result<Folder, OutputError> {
    Folder::open(out, &RESULTS)
}

/// What is kept of a run, and where.
#[derive(Debug)]
pub struct Recording<'f> {
    /// Where.
    pub folder: &'f Folder,
    /// Whether `trace.log` and `truth.csv` are kept beside `summary.json`.
    pub traces: bool,
    /// Whether a person is to see how far the run is.
    pub progress: bool,
}

/// Runs a scenario and writes `trace.log`, `truth.csv` and `summary.json` into `out`: all of them appear when all of them
/// are complete. What an older run has left goes when this one begins.
///
/// A scenario that could not be completed still has a summary, with `completed` false and the reason in `error`; so has one
/// that a signal has ended.
///
/// # Errors
/// Nothing was run, or nothing could be written; see [`ExecuteError`].
pub fn execute(config: &RunConfig, out: &Path) -> Result<Results, ExecuteError> {
    let recording = Recording {
        folder: &folder(out)?,
        traces: true,
        progress: false,
    };
    execute_with(
        config,
        &recording,
        |config| Ok(InProcess::new(config)),
        &mut (),
        (),
    )
}

/// Runs a scenario like [`execute`], with the controller that `connect` starts, at the pace of `pace`, and with one
/// more observer.
///
/// # Errors
/// Like [`execute`], and [`ExecuteError::Controller`] if `connect` fails.
pub fn execute_with<C: Peer, P: Pace, O: Observer>(
    config: &RunConfig,
    recording: &Recording<'_>,
    connect: impl FnOnce(Config) -> Result<C, PeerError>,
    pace: &mut P,
    observer: O,
) -> Result<Results, ExecuteError> {
    let begin = || Ok(connect(config.rig()?.controller())?);
    record(
        config,
        recording,
        observer,
        begin,
        |controller, observers| {
            with_controller(config, |_| Ok(controller), &mut Heeding(pace), observers)
        },
    )
}

/// What records a run: trace, truth, progress, and one more observer.
pub type Recorders<O> = (
    Option<TraceLog<File>>,
    (Option<TruthLog<File>>, (Option<Progress>, O)),
);

/// Records the run that `run` performs with what `begin` has made ready, as [`execute`] does.
///
/// # Errors
/// Nothing was run, or nothing could be written; see [`ExecuteError`].
pub fn record<B, O: Observer>(
    config: &RunConfig,
    recording: &Recording<'_>,
    observer: O,
    begin: impl FnOnce() -> Result<B, Failure>,
    run: impl FnOnce(B, &mut Recorders<O>) -> Result<Summary, Failure>,
) -> Result<Results, ExecuteError> {
    let folder = recording.folder;
    let failed = |source| folder.failed(source);
    let failed_run = |failure| match failure {
        Failure::Setup(error) => ExecuteError::from(error),
        Failure::Controller(error) => error.into(),
        Failure::Output(source) => failed(source).into(),
    };
    // What cannot begin leaves older results alone.
    let began = Instant::now();
    let begun = begin().map_err(failed_run)?;
    folder.clear()?;
    let kept = |name| recording.traces.then(|| folder.create(name)).transpose();
    let trace = kept("trace.log")?.map(TraceLog::new);
    let truth = kept("truth.csv")?
        .map(TruthLog::new)
        .transpose()
        .map_err(failed)?;
    let progress = recording
        .progress
        .then(|| Progress::new(config.scenario.cycles));
    let mut observers: Recorders<O> = (trace, (truth, (progress, observer)));

    let summary = run(begun, &mut observers).map_err(failed_run)?;
    let wall_time_s = began.elapsed().as_secs_f64();

    let (trace, (truth, _)) = observers;
    let trace = trace.map(TraceLog::finish).transpose().map_err(failed)?;
    let truth = truth.map(TruthLog::finish).transpose().map_err(failed)?;
    let results = Results {
        version: env!("CARGO_PKG_VERSION"),
        commit: env!("COMMIT"),
        command: std::env::args_os()
            .map(|word| word.to_string_lossy().into_owned())
            .collect(),
        real_time_factor: summary.sim_time_s / wall_time_s,
        summary,
        wall_time_s,
        trace_sha256: trace.as_ref().map(|(_, hash)| hash.to_string()),
    };
    let summary = folder.prepare("summary.json", &results.to_json())?;
    // All are written. The summary comes last: where it is, the others are complete.
    for file in trace
        .map(|(file, _)| file)
        .into_iter()
        .chain(truth)
        .chain([summary])
    {
        file.persist()?;
    }
    Ok(results)
}
