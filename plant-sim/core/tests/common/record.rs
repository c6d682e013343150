//! A run with faults, and everything that is seen of it.

use std::io;

use protocol::frame::CanFrame;
use protocol::time::Instant;
use sim::observer::{Observer, Truth};
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;

/// The frames and the samples of a run.
#[derive(Default)]
pub(crate) struct Record {
    pub(crate) frames: Vec<(Instant, CanFrame)>,
    pub(crate) truths: Vec<Truth>,
}

impl Observer for Record {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.frames.push((time, *frame));
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.truths.push(*truth);
        Ok(())
    }
}

/// The run of a scenario with these faults in place of its own.
pub(crate) fn run_of(mut scenario: Scenario, faults: &[&str], seed: u64) -> (Summary, Record) {
    scenario.faults = faults
        .iter()
        .map(|text| text.parse().expect("a fault"))
        .collect();
    scenario.seed = seed;
    let mut record = Record::default();
    let config = RunConfig::new(scenario);
    let summary = in_process(&config, &mut record).expect("the scenario can begin");
    (summary, record)
}
