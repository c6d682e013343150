//! What was run, with everything needed to run it again.

use schemars::JsonSchema;
use serde::Serialize;
use sha2::{Digest, Sha256};
use trace::LogHash;

use crate::model::RobotModel;
use crate::scenario::{Ending, Mismatch, PayloadSpec};
use crate::setup::RunConfig;

/// What was run. With the same version of the program, `scenario_text` and the two models give the same trace and the
/// same truth, to the byte; the rest repeats parts of them for readers.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Recipe {
    /// Name of the scenario.
    pub scenario: String,
    /// The scenario as it was run, including changes from the command line, as the text of a scenario file.
    pub scenario_text: String,
    /// How the run was to end.
    pub ends: Ending,
    /// Law and compensation.
    pub law: String,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Gains in force.
    pub gains: GainsInForce,
    /// Mass of the payload at the start, kg.
    pub payload_kg: f64,
    /// Payload at the flange from the start, as announced to the controller.
    pub payload: Option<PayloadSpec>,
    /// Mismatch: actual value over nominal value.
    pub mismatch: Mismatch,
    /// The robot twice: nominal and actual.
    pub models: Models,
}

/// Gains of the closed loop, the scenario's or the controller's own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Gains")]
pub struct GainsInForce {
    /// Natural frequency of the error dynamics, rad/s.
    pub bandwidth: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Corner of the disturbance observer, or 1 / integral time, rad/s.
    pub observer: f64,
}

/// The two robots of a run.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Models {
    /// The nominal one, of the controller.
    pub controller: Model,
    /// The actual one, before the mismatch.
    pub robot: Model,
}

/// A robot, and the origin of its numbers.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Model {
    /// Name in the model file.
    pub name: String,
    /// The file, or the name of a model that comes with the program.
    pub origin: String,
    /// SHA-256 of the model file.
    pub sha256: String,
    /// The model file itself; `null` for a model that comes with the program.
    pub text: Option<String>,
}

impl Recipe {
    pub(super) fn new(config: &RunConfig) -> Self {
        let scenario = &config.scenario;
        Self {
            scenario: scenario.name.clone(),
            scenario_text: scenario.to_toml(),
            ends: scenario.ends,
            law: scenario.law.to_string(),
            rate_hz: scenario.rate_hz,
            gains: gains(config),
            payload_kg: scenario.payload.map_or(0.0, |payload| payload.mass),
            payload: scenario.payload,
            mismatch: scenario.mismatch,
            models: Models {
                controller: Model::of(&config.nominal),
                robot: Model::of(&config.actual),
            },
        }
    }
}

fn gains(config: &RunConfig) -> GainsInForce {
    let asked = config.scenario.gains.unwrap_or_default();
    let each = asked.each(&config.own_gains());
    let [bandwidth, damping, observer] = each.map(|(_, _, value)| value);
    GainsInForce {
        bandwidth,
        damping,
        observer,
    }
}

impl Model {
    fn of(robot: &RobotModel) -> Self {
        let source = &robot.source;
        Self {
            name: robot.name.clone(),
            origin: source.origin.clone(),
            sha256: LogHash(Sha256::digest(&source.text).into()).to_string(),
            text: (!RobotModel::is_built_in(&source.text)).then(|| source.text.clone()),
        }
    }
}
