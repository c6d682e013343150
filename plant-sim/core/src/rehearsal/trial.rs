//! A cycle on the robot that the controller believes in, with nothing broken.

use super::Refused;
use crate::run::in_process;
use crate::scenario::{Ending, Mismatch, Scenario};
use crate::setup::RunConfig;

/// Why the first cycle of a scenario that is planned without a refusal would not be completed, if so.
pub(super) fn failure(config: &RunConfig) -> Option<Refused> {
    let Scenario { rate_hz, law, .. } = config.scenario;
    // One that is to stop ends early as it should.
    if config.scenario.ends == Ending::Stopped {
        return None;
    }
    let trial = RunConfig {
        scenario: Scenario {
            cycles: 1,
            mismatch: Mismatch::default(),
            faults: Vec::new(),
            requirements: Vec::new(),
            ..config.scenario.clone()
        },
        nominal: config.nominal.clone(),
        actual: config.nominal.clone(),
    };
    // Another robot may not reach the start of this one.
    let error = in_process(&trial, &mut ()).ok()?.error?;
    let advice = config.encoder_advice().unwrap_or_else(|| {
        "a lower speed, a higher rate_hz or another law or gains may help".into()
    });
    Some(Refused {
        cycle: None,
        step: None,
        reason: format!(
            "{error}, in a trial of its first cycle under {law} at {rate_hz} Hz; {advice}"
        ),
    })
}
