//! What a run is made of: scenario, model, payload, gains.

use firmware::mechanics::arm;
use firmware::mechanics::arm::ArmModel;
use sim::controller::InProcess;
use sim::drives::Drives;
use sim::model::{Payload, RobotModel};
use sim::operator::Operator;
use sim::rig::Rig;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Collector;

use crate::Bytes;

/// Samples run of what was accepted: enough to switch on and to plan the first move.
const SAMPLES: usize = 40;

fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}

/// What is accepted runs; `false` if it is refused. Whether the run gets to its end is another question.
fn begin(config: &RunConfig) -> bool {
    let rig = match config.rig() {
        Ok(rig) => rig,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return false;
        }
    };
    let controller = InProcess::new(rig.controller());
    let drives = Drives::new(&rig.actual, rig.period);
    let mut rig = Rig::new(&rig);
    rig.attach(drives);
    rig.attach(Operator::new(&config.scenario));
    rig.attach(controller);
    let mut collector = Collector::new(config);
    for _ in 0..SAMPLES {
        if rig.step(&mut (), &mut collector).is_err() {
            break;
        }
        assert!(rig.plant().q().iter().all(|q| q.is_finite()));
    }
    let summary = collector.finish(config, &rig, &Ok(()));
    assert_eq!(
        summary.requirements.len(),
        config.scenario.requirements.len()
    );
    true
}

fn scenario_runs(text: &str) -> bool {
    match Scenario::parse(text, "a.toml") {
        Ok(scenario) => {
            let written = scenario.to_toml();
            let again = Scenario::parse(&written, "again").expect("what is written is read");
            assert_eq!(again.to_toml(), written);
            begin(&RunConfig::new(scenario))
        }
        Err(error) => {
            assert!(error.to_string().contains("a.toml"));
            false
        }
    }
}

/// Scenario files.
pub(crate) fn scenario(bytes: &[u8]) {
    if let Some(text) = text(bytes) {
        scenario_runs(text);
    }
}

/// Gains and rate of a scenario.
pub(crate) fn gains(bytes: &[u8]) {
    gains_run(bytes);
}

fn gains_run(bytes: &[u8]) -> bool {
    let mut bytes = Bytes(bytes);
    let [rate, bandwidth, damping, observer] =
        [(); 4].map(|()| f64::from(f32::from_le_bytes(bytes.array())));
    let text = format!(
        "name = \"gains\"\ncycles = 1\nrate_hz = {rate:?}\nlaw = \"computed-torque:observer\"\nstart = [0.5, 0.1, -0.27, 0.0]\n\
         cycle = [{{ dwell = 0.1 }}]\ngains = {{ bandwidth = {bandwidth:?}, damping = {damping:?}, observer = {observer:?} }}\n"
    );
    // TOML knows nan by this name.
    scenario_runs(&text.replace("NaN", "nan"))
}

/// Robot model files.
pub(crate) fn model(bytes: &[u8]) {
    let Some(text) = text(bytes) else {
        return;
    };
    match RobotModel::from_json(text) {
        Ok((model, warnings)) => {
            assert!(warnings.iter().all(|warning| !warning.is_empty()));
            let scenario = Scenario::built_in("gate").expect("it comes with the program");
            begin(&RunConfig {
                scenario,
                nominal: model.clone(),
                actual: model,
            });
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Payload files.
pub(crate) fn payload(bytes: &[u8]) {
    let Some(text) = text(bytes) else {
        return;
    };
    match Payload::from_json(text) {
        Ok(payload) => {
            let arm = ArmModel::from(&RobotModel::irb_930_22_105());
            let payload = arm::Payload::from(&payload);
            if let Err(error) = arm.validate_payload(&payload) {
                assert!(!error.to_string().is_empty());
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A search that begins with what is refused finds little.
    #[test]
    fn seeds_are_run() {
        assert!(scenario_runs(include_str!(
            "../corpus/scenario/values.toml"
        )));
        assert!(scenario_runs(include_str!(
            "../corpus/scenario/requirements.toml"
        )));
        assert!(gains_run(include_bytes!("../corpus/gains/usual")));
        let payload = include_str!("../corpus/payload/two-kg.json");
        assert!(Payload::from_json(payload).is_ok());
    }
}
