//! One run, from configuration to summary, without file, clock or print: recording it is up to the observer.

use std::io;

use firmware::control::controller::Config;
use protocol::messages::Node;

use crate::controller::InProcess;
use crate::drives::Drives;
use crate::faults::{Faulty, Injector, Planned};
use crate::observer::{Observer, Pace};
use crate::operator::Operator;
use crate::peer::{Peer, PeerError};
use crate::rig::{Rig, RunError};
use crate::scenario::Scenario;
use crate::setup::{RunConfig, SetupError};
use crate::summary::{Collector, Summary};

/// Why a run has no summary.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The run cannot begin.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The controller could not be started.
    #[error(transparent)]
    Controller(#[from] PeerError),
    /// An observer could not record the run.
    #[error("cannot write results: {0}")]
    Output(io::Error),
}

/// Runs a scenario with the controller in this process.
///
/// A scenario that could not be completed still has a summary, with `completed` false and the reason in `error`.
///
/// # Errors
/// See [`Failure`].
pub fn in_process<O: Observer>(config: &RunConfig, observer: &mut O) -> Result<Summary, Failure> {
    with_controller(
        config,
        |config| Ok(InProcess::new(config)),
        &mut (),
        observer,
    )
}

/// Runs a scenario with the controller that `connect` starts, at the pace of `pace`.
///
/// # Errors
/// See [`Failure`].
pub fn with_controller<C: Peer, P: Pace, O: Observer>(
    config: &RunConfig,
    connect: impl FnOnce(Config) -> Result<C, PeerError>,
    pace: &mut P,
    observer: &mut O,
) -> Result<Summary, Failure> {
    let mut rig = assemble(config, connect)?;
    let mut observers = (Collector::new(config), observer);
    match rig.run(pace, &mut observers) {
        Err(RunError::Output(source)) => Err(Failure::Output(source)),
        result => Ok(observers.0.finish(config, &rig, &result)),
    }
}

/// The rig of a scenario with all its peers, at the origin of time.
///
/// # Errors
/// See [`Failure`].
pub(crate) fn assemble<'p, C: Peer + 'p>(
    config: &RunConfig,
    connect: impl FnOnce(Config) -> Result<C, PeerError>,
) -> Result<Rig<'p>, Failure> {
    let setup = config.rig()?;
    let crew = Crew {
        drives: Drives::new(&setup.actual, setup.period),
        operator: Operator::new(&config.asked()),
        controller: connect(setup.controller())?,
    };
    Ok(crew.board(Rig::new(&setup), &config.scenario))
}

/// The peers of a run.
#[derive(Clone)]
pub(crate) struct Crew<D, O, C> {
    pub(crate) drives: D,
    pub(crate) operator: O,
    pub(crate) controller: C,
}

impl<D: Peer, O: Peer, C: Peer> Crew<D, O, C> {
    /// The rig with these peers on its bus, and the faults of the scenario.
    pub(crate) fn board<'p>(self, mut rig: Rig<'p>, scenario: &Scenario) -> Rig<'p>
    where
        D: 'p,
        O: 'p,
        C: 'p,
    {
        let Scenario { faults, seed, .. } = scenario;
        let faults: Vec<Planned> = faults.iter().map(|fault| rig.plan(fault)).collect();
        let faults = faults.as_slice();
        if !faults.is_empty() {
            // Before the drives, so that what breaks at a sampling instant is sampled broken.
            rig.attach_aside(Injector::new(faults, *seed));
        }
        let drives = Faulty::new(self.drives, Node::Drives, faults, *seed);
        rig.attach_as(Node::Drives, drives);
        let operator = Faulty::new(self.operator, Node::Operator, faults, *seed);
        rig.attach_as(Node::Operator, operator);
        let controller = Faulty::new(self.controller, Node::Controller, faults, *seed);
        rig.attach_as(Node::Controller, controller);
        for fault in faults {
            rig.spoil(fault, *seed);
        }
        rig
    }
}
