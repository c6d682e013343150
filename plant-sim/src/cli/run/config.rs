//! What to run with what: the options that change a scenario and choose robots.

use std::path::Path;

use clap::Args;
use plant_sim::input;
use plant_sim::say;
use sim::faults::Fault;
use sim::model::RobotModel;
use sim::scenario::{self, Change};
use sim::selection::LawChoice;
use sim::setup::RunConfig;
use sim::text;

use crate::cli::Failure;
use crate::cli::values::{cycles, number, seed};

/// Scenario where none is named.
pub(crate) const USUAL: &str = "gate";

/// Help for a scenario.
pub(crate) fn what() -> String {
    format!(
        "A scenario file, or the name of one that comes with the program: {}",
        scenario::names().join(", ")
    )
}

/// A scenario, which may stand alone.
#[derive(Args)]
pub(crate) struct ScenarioArgs {
    #[arg(value_name = "NAME|FILE", default_value = USUAL, help = what())]
    name: String,
    /// The same, written as without a command.
    #[arg(long, value_name = "NAME|FILE", conflicts_with = "name")]
    scenario: Option<String>,
}

impl ScenarioArgs {
    /// Name or file.
    pub(crate) fn name(&self) -> &str {
        self.scenario.as_ref().unwrap_or(&self.name)
    }
}

/// Options that change a scenario and choose robots.
#[derive(Args)]
pub(crate) struct ConfigArgs {
    /// Change one value of the scenario: gains.bandwidth=80, cycle[1].line.speed=0.5, mismatch.friction=1.2. May be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Change>,
    /// Control law: kinematic-joint, kinematic-task, pid, pd-gravity, computed-torque or
    /// computed-torque-task; the last two with :none, :integral or :observer (default). Short for --set law=NAME.
    #[arg(long, value_name = "NAME")]
    law: Option<LawChoice>,
    /// Payload, announced and carried from the start; in a scenario that picks, what it picks.
    #[arg(long, value_name = "KG", allow_negative_numbers = true, value_parser = number)]
    payload: Option<f64>,
    /// Number of cycles. Short for --set cycles=N.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = cycles)]
    cycles: Option<i64>,
    /// Control rate. Short for --set rate_hz=HZ.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = number)]
    rate: Option<f64>,
    /// Break something: PLACE[:AXIS]:KIND[=VALUE]@WINDOW, such as encoder:elbow:stuck@0.4s, command:loss=0.2@0.3s..0.5s,
    /// motor:lift:dead@jump2+200ms..+50ms or brake:slow=0.2@while=moving. May be repeated; docs/faults.md lists the kinds.
    #[arg(long, value_name = "FAULT")]
    fault: Vec<Fault>,
    /// Seed of whatever is random in the faults. Short for --set seed=N.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<i64>,
    /// The robot as the controller knows it: irb930-22-1.05 (the default), irb930-12-0.85 or a model file; also the actual
    /// one, unless --plant-model is given. Configure an external controller the same way: plant-sim model NAME|FILE.
    #[arg(long, value_name = "NAME|FILE")]
    model: Option<String>,
    /// The actual robot: a name or a model file.
    #[arg(long, value_name = "NAME|FILE")]
    plant_model: Option<String>,
}

impl ConfigArgs {
    /// The robot as the controller knows it.
    pub(crate) fn nominal(&self) -> Result<RobotModel, Failure> {
        load(self.model.as_deref())
    }

    /// Files that are read, besides those that come with the program.
    pub(crate) fn inputs<'a>(&'a self, scenario: &'a str) -> impl Iterator<Item = &'a Path> {
        let models = self.model.iter().chain(&self.plant_model);
        models.map(String::as_str).chain([scenario]).map(Path::new)
    }

    /// What to run with what, each value checked as if the scenario's file had it.
    pub(crate) fn config(&self, scenario: &str) -> Result<RunConfig, Failure> {
        let mut changes = self.set.clone();
        if let Some(law) = self.law.map(|law| law.to_string()) {
            changes.push(Change::new(format!("--law {law}"), "law", law));
        }
        if let Some(cycles) = self.cycles {
            changes.push(Change::new(format!("--cycles {cycles}"), "cycles", cycles));
        }
        if let Some(rate) = self.rate {
            changes.push(Change::new(
                format!("--rate {}", text::number(rate)),
                "rate_hz",
                rate,
            ));
        }
        if let Some(seed) = self.seed {
            changes.push(Change::new(format!("--seed {seed}"), "seed", seed));
        }
        let mut scenario = input::scenario(scenario, &changes)?;
        scenario.faults.extend(self.fault.iter().cloned());
        let nominal = self.nominal()?;
        if let Some(kg) = self.payload {
            let most = nominal.payload_max;
            if !(0.0..=most).contains(&kg) {
                return Err(Failure::usage(format!(
                    "--payload is {} kg; allowed: 0 to {most} kg for {}",
                    text::number(kg),
                    nominal.name
                )));
            }
            scenario.carry(kg).map_err(|why| {
                Failure::usage(format!("--payload {kg}: scenario {} {why}", scenario.name))
            })?;
        }
        let actual = match &self.plant_model {
            Some(name) => load(Some(name))?,
            None => nominal.clone(),
        };
        let config = RunConfig {
            scenario,
            nominal,
            actual,
        };
        for warning in config.warnings() {
            say!("plant-sim: warning: {warning}");
        }
        Ok(config)
    }
}

/// The robot of this name or model file, or the default one; warnings go to standard error.
pub(crate) fn load(name: Option<&str>) -> Result<RobotModel, Failure> {
    let Some(name) = name else {
        return Ok(RobotModel::irb_930_22_105());
    };
    let (model, warnings) = input::robot(name)?;
    for warning in warnings {
        say!("plant-sim: warning: {name}: {warning}");
    }
    Ok(model)
}
