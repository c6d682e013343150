//! One run with its results on disk: a trace, the truth and a summary.

use std::path::Path;
use std::time::Instant;

use firmware::control::controller::Config;
use serde::Serialize;
use sim::controller::InProcess;
use sim::observer::{Observer, Pace};
use sim::peer::{Peer, PeerError};
use sim::record::{TraceLog, TruthLog};
use sim::run::{Failure, with_controller};
use sim::setup::{RunConfig, SetupError};
use sim::summary::Summary;

use crate::output::{Folder, OutputError};
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
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// SHA-256 of `trace.log`.
    pub trace_sha256: String,
}

impl Results {
    /// The text of `summary.json`.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and texts can be written as JSON") + "\n"
    }
}

/// Runs a scenario and writes `trace.log`, `truth.csv` and `summary.json` into `out`; each appears under its name
/// once it is complete.
///
/// A scenario that could not be completed still has a summary, with `completed` false and the reason in `error`.
///
/// # Errors
/// Nothing was run, or nothing could be written; see [`ExecuteError`].
pub fn execute(config: &RunConfig, out: &Path) -> Result<Results, ExecuteError> {
    execute_with(
        config,
        out,
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
    out: &Path,
    connect: impl FnOnce(Config) -> Result<C, PeerError>,
    pace: &mut P,
    observer: O,
) -> Result<Results, ExecuteError> {
    let folder = Folder::open(out)?;
    let failed = |source| folder.failed(source);
    let truth = TruthLog::new(folder.create("truth.csv")?).map_err(failed)?;
    let mut observers = (
        TraceLog::new(folder.create("trace.log")?),
        (truth, (Progress::new(config.scenario.cycles), observer)),
    );

    let began = Instant::now();
    let summary =
        with_controller(config, connect, pace, &mut observers).map_err(
            |failure| match failure {
                Failure::Setup(error) => ExecuteError::from(error),
                Failure::Controller(error) => error.into(),
                Failure::Output(source) => failed(source).into(),
            },
        )?;
    let wall_time_s = began.elapsed().as_secs_f64();

    let (trace, (truth, _)) = observers;
    let (trace, hash) = trace.finish().map_err(failed)?;
    let truth = truth.finish().map_err(failed)?;
    let results = Results {
        version: env!("CARGO_PKG_VERSION"),
        commit: env!("COMMIT"),
        command: std::env::args_os()
            .map(|word| word.to_string_lossy().into_owned())
            .collect(),
        real_time_factor: summary.sim_time_s / wall_time_s,
        summary,
        wall_time_s,
        trace_sha256: hash.to_string(),
    };
    trace.persist()?;
    truth.persist()?;
    folder.write("summary.json", &results.to_json())?;
    Ok(results)
}
