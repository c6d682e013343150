//! What a campaign crosses, as a TOML file.

use std::collections::BTreeSet;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;
use sim::campaign::case::{Crossing, Situation, planned};
use sim::scenario::Change;
use sim::setup::RunConfig;

use super::CampaignError;
use crate::input;

/// The cases that come with the program.
pub const DEFAULT: &str = include_str!("../../campaigns/default.toml");

/// What a campaign crosses: every situation with every fault, every beginning and every duration.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cases {
    /// What breaks, as in a scenario but without the window. ` + ` joins what breaks together; `none` looks for false alarms.
    #[schemars(length(min = 1))]
    pub faults: Vec<String>,
    /// How long a fault lasts, ms; 0 for one that stays.
    #[schemars(length(min = 1), inner(range(min = 0, max = 1e6)))]
    pub lasts_ms: Vec<f64>,
    /// What the robot does meanwhile.
    #[schemars(length(min = 1))]
    pub situation: Vec<SituationSpec>,
}

/// What the robot does while something breaks.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Situation")]
pub struct SituationSpec {
    /// Name, for tables.
    pub name: String,
    /// A scenario that comes with the program, or a file.
    pub scenario: String,
    /// Changes to its values, as `run --set` takes them.
    #[serde(default)]
    pub set: Vec<String>,
    /// Payload, as `run --payload` takes it, kg.
    pub payload: Option<f64>,
    /// When a fault may begin.
    pub begin_ms: Begin,
}

/// When a fault may begin, ms from the beginning of the run, or of something in it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Begin {
    /// What these times count from, as the window of a fault has it: `jump2`, `quick-stop`.
    #[serde(default)]
    pub after: String,
    /// Earliest.
    #[schemars(range(min = 0, max = 1e6))]
    pub from: f64,
    /// Latest.
    #[schemars(range(min = 0, max = 1e6))]
    pub until: f64,
    /// From one beginning to the next.
    #[schemars(range(min = 0.001, max = 1e6))]
    pub step: f64,
}

/// The crossing written in `file`, or the one that comes with the program.
///
/// # Errors
/// The file cannot be read, or something in it cannot be.
pub fn load(file: Option<&Path>) -> Result<Crossing, CampaignError> {
    let Some(path) = file else {
        return Ok(crossing(DEFAULT).expect("the cases of the program are valid"));
    };
    let text = crate::input::text(path).map_err(CampaignError::read(path))?;
    crossing(&text).map_err(|what| CampaignError::wrong(path, what))
}

fn crossing(text: &str) -> Result<Crossing, String> {
    let cases: Cases = toml::from_str(text).map_err(|error| error.to_string())?;
    let lasts = cases
        .lasts_ms
        .iter()
        .map(|ms| match micros("lasts_ms", *ms) {
            // It would stay for ever.
            Ok(0) if *ms != 0.0 => Err(format!(
                "lasts_ms is {ms}; allowed: 0, for a fault that stays, and 0.001 to 1000000 ms"
            )),
            lasts => lasts,
        });
    let lasts = lasts.collect::<Result<_, _>>()?;
    let situations = cases.situation.iter().map(situation);
    let situations: Vec<Situation> = situations.collect::<Result<_, _>>()?;
    let names: BTreeSet<&str> = situations.iter().map(|one| one.name.as_str()).collect();
    if names.len() < situations.len() {
        return Err("two situations have the same name; each needs its own".into());
    }
    let crossing =
        Crossing::new(situations, &cases.faults, lasts).map_err(|error| error.to_string())?;
    if crossing.is_empty() {
        return Err(
            "there are no cases: faults, lasts_ms and situation need an element each".into(),
        );
    }
    Ok(crossing)
}

fn situation(spec: &SituationSpec) -> Result<Situation, String> {
    let wrong = |what: String| format!("situation {:?}: {what}", spec.name);
    let changes = spec.set.iter().map(|text| text.parse::<Change>());
    let changes: Vec<Change> = changes.collect::<Result<_, _>>().map_err(wrong)?;
    let scenario = input::scenario(&spec.scenario, &changes);
    let mut scenario = scenario.map_err(|error| wrong(error.to_string()))?;
    if let Some(kg) = spec.payload {
        scenario
            .carry(kg)
            .map_err(|why| wrong(format!("payload {kg}: {why}")))?;
    }
    if let Some(own) = scenario.faults.first() {
        return Err(wrong(format!(
            "scenario {} has faults of its own, such as {:?}, which would be judged as if the campaign had drawn them; leave them out with \
             set = [\"faults=[]\"], or name another scenario",
            spec.scenario, own.text
        )));
    }
    let config = RunConfig::new(scenario);
    config.rig().map_err(|error| wrong(error.to_string()))?;
    let Begin {
        ref after,
        from,
        until,
        step,
    } = spec.begin_ms;
    // Whether it is a moment shows with any fault.
    planned("payload:dropped", after, 0, 0).map_err(|error| wrong(error.to_string()))?;
    let in_range = |key: &str, ms| micros(key, ms).map_err(wrong);
    let situation = Situation {
        name: spec.name.clone(),
        scenario: config.scenario,
        after: after.clone(),
        from: in_range("begin_ms.from", from)?,
        until: in_range("begin_ms.until", until)?,
        step: in_range("begin_ms.step", step)?,
    };
    if situation.step == 0 {
        return Err(wrong(format!(
            "begin_ms.step is {step}; allowed: 0.001 to 1000000 ms"
        )));
    }
    if situation.until < situation.from {
        return Err(wrong(format!(
            "begin_ms.until {until} is before begin_ms.from {from}"
        )));
    }
    Ok(situation)
}

/// Whole microseconds.
fn micros(key: &str, ms: f64) -> Result<u64, String> {
    if (0.0..=1e6).contains(&ms) {
        Ok((ms * 1e3).round() as u64)
    } else {
        // Not as three hundred digits.
        let found = if ms.abs() < 1e15 {
            ms.to_string()
        } else {
            format!("{ms:e}")
        };
        Err(format!("{key} is {found}; allowed: 0 to 1000000 ms"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beginnings_count_from_what_is_named() {
        let text = DEFAULT.replace("{ from = 170", "{ after = \"jump2\", from = 170");
        let case = crossing(&text).unwrap().case(0, 0).unwrap();
        assert!(case.faults.is_empty());
        let texts: Vec<_> = (1..crossing(&text).unwrap().len())
            .map_while(|place| crossing(&text).ok()?.case(place, 0))
            .take(2)
            .map(|case| case.faults[0].text.clone())
            .collect();
        assert!(
            texts.iter().all(|text| text.contains("@jump2+170ms..+2ms")),
            "{texts:?}"
        );
    }

    #[test]
    fn what_cannot_be_crossed_is_refused_with_what_is_allowed() {
        for (from, to, why) in [
            ("step = 0.7", "step = 0", "begin_ms.step is 0"),
            ("from = 170", "from = 1700", "is before begin_ms.from"),
            ("lasts_ms = [2,", "lasts_ms = [-2,", "lasts_ms is -2"),
            (
                "lasts_ms = [2,",
                "lasts_ms = [0.0001,",
                "allowed: 0, for a fault that stays",
            ),
            ("motor:lift:dead", "motor:lift:ded", "did you mean dead?"),
            ("gate, 22 kg", "gate, 2 kg", "the same name"),
            ("payload = 22", "payload = -22", "payload"),
            ("cycles=1", "cycles=0", "cycles"),
            ("name = ", "nam = ", "unknown field"),
            (
                "scenario = \"gate\"",
                "scenario = \"encoder-fault\"",
                "leave them out with set = [\"faults=[]\"]",
            ),
            (
                "{ from = 250",
                "{ after = \"jmp2\", from = 250",
                "did you mean jump?",
            ),
        ] {
            let text = DEFAULT.replacen(from, to, 1);
            assert_ne!(text, DEFAULT);
            let error = crossing(&text).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
    }
}
