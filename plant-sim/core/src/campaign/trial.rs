//! One case of a campaign: the run, what follows it, and the verdict.

use firmware::control::controller::Config;
use protocol::time::Duration;

use super::judge::Judge;
use super::verdict::Verdict;
use crate::observer::Observer;
use crate::peer::{Peer, PeerError};
use crate::rig::{Rig, RunError};
use crate::run::{Failure, assemble};
use crate::setup::RunConfig;

/// How long an arm is watched that is to stand: after it has come to rest, and again after a request to switch on.
const WATCHED: Duration = Duration::from_millis(50);
/// How long an arm without torque may coast after the end of its run, as long as the operator waits for one that has stopped.
const COASTING: Duration = Duration::from_millis(5000);

/// Runs a case with the controller that `connect` starts, and judges it. Then the rig and the end of the run are there for
/// whoever wants a summary.
///
/// # Errors
/// See [`Failure`].
pub fn run<'p, C: Peer + 'p, O: Observer>(
    config: &RunConfig,
    connect: impl FnOnce(Config) -> Result<C, PeerError>,
    observer: &mut O,
) -> Result<(Verdict, Rig<'p>, Result<(), RunError>), Failure> {
    run_before(Judge::new(config), config, connect, observer)
}

/// Like [`run`], before a judge who may be that of another run.
///
/// # Errors
/// See [`Failure`].
pub fn run_before<'p, C: Peer + 'p, O: Observer>(
    judge: Judge,
    config: &RunConfig,
    connect: impl FnOnce(Config) -> Result<C, PeerError>,
    observer: &mut O,
) -> Result<(Verdict, Rig<'p>, Result<(), RunError>), Failure> {
    let mut rig = assemble(config, connect)?;
    let (verdict, result) = judged(&mut rig, judge, observer)?;
    Ok((verdict, rig, result))
}

/// What becomes of a run from where it is: the verdict, and its end.
pub(super) fn judged<O: Observer>(
    rig: &mut Rig<'_>,
    judge: Judge,
    observer: &mut O,
) -> Result<(Verdict, Result<(), RunError>), Failure> {
    let mut observers = (judge, observer);
    let result = rig.run(&mut (), &mut observers);
    // A scenario ends as soon as torque is off: time to come to rest.
    let latest = rig.now() + COASTING;
    watch(rig, &mut observers)?;
    while !observers.0.has_stood(WATCHED) && rig.now() < latest {
        watch(rig, &mut observers)?;
    }
    observers.0.ended(result.is_ok(), rig.acted());
    watch(rig, &mut observers)?;
    if let Some(frame) = observers.0.temptation() {
        rig.inject(&frame);
        watch(rig, &mut observers)?;
    }
    match result {
        Err(RunError::Output(source)) => Err(Failure::Output(source)),
        result => Ok((observers.0.finish(), result)),
    }
}

fn watch<O: Observer>(rig: &mut Rig<'_>, observer: &mut O) -> Result<(), Failure> {
    let until = rig.now() + WATCHED;
    while rig.now() < until {
        match rig.step(&mut (), observer) {
            Ok(()) => {}
            Err(RunError::Output(source)) => return Err(Failure::Output(source)),
            // The controller in another process has ended: there is nothing left to watch.
            Err(_) => return Ok(()),
        }
    }
    Ok(())
}
