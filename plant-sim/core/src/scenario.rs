//! Scenarios: start, payload, law, and the steps of a cycle, as TOML text or by name.

mod check;

use serde::{Deserialize, Deserializer, Serialize};

use crate::model::Payload;
use crate::selection::LawChoice;
use crate::text::nearest;

pub use crate::text::Source;

/// Scenarios that come with the program: name and text.
const BUILT_IN: [(&str, &str); 4] = [
    ("gate", include_str!("../../scenarios/gate.toml")),
    (
        "gate-mismatch",
        include_str!("../../scenarios/gate-mismatch.toml"),
    ),
    ("square", include_str!("../../scenarios/square.toml")),
    (
        "pick-place",
        include_str!("../../scenarios/pick-place.toml"),
    ),
];

/// A run, ready to be executed. Lengths in m in frame 0, angles in rad.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name, for the summary.
    pub name: String,
    /// Number of cycles.
    pub cycles: u32,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Control law and compensation, such as `computed-torque:observer`.
    pub law: LawChoice,
    /// Gains; otherwise the controller's defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gains: Option<GainsSpec>,
    /// Tool pose at the start: x, y, z, yaw. The elbow bends to the positive side.
    #[serde(deserialize_with = "exactly")]
    pub start: [f64; 4],
    /// Payload at the flange from the start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload: Option<PayloadSpec>,
    /// How the actual robot differs from the nominal one.
    #[serde(default)]
    pub mismatch: Mismatch,
    /// Steps of one cycle.
    pub cycle: Vec<Step>,
    /// The text that this was read from, for places in messages.
    #[serde(skip)]
    pub source: Source,
}

/// An array of exactly `N` numbers: serde alone ignores surplus elements.
fn exactly<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[f64; N], D::Error> {
    let numbers = Vec::<f64>::deserialize(deserializer)?;
    numbers.try_into().map_err(|numbers: Vec<f64>| {
        serde::de::Error::custom(format!(
            "an array of {}; it must be an array of {N} numbers",
            numbers.len()
        ))
    })
}

/// Gains of the closed loop, the same for every law.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GainsSpec {
    /// Natural frequency of the error dynamics, rad/s.
    pub bandwidth: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Corner of the disturbance observer, or 1 / integral time, rad/s.
    pub observer: f64,
}

/// A payload as model files write it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PayloadSpec {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the flange frame, m.
    #[serde(deserialize_with = "exactly")]
    pub com_flange_frame: [f64; 3],
    /// Principal moments of inertia about the centre of mass, kg m².
    #[serde(deserialize_with = "exactly")]
    pub inertia_com_diag: [f64; 3],
}

impl PayloadSpec {
    /// A compact body of `mass` kg: centre of mass 50 mm below the flange, radius of gyration
    /// as for the 2 kg benchmark payload.
    pub fn compact(mass: f64) -> Self {
        Self {
            mass,
            com_flange_frame: [0.0, 0.0, 0.05],
            inertia_com_diag: [0.004 * mass, 0.004 * mass, 0.005 * mass],
        }
    }

    /// The same body, `factor` times as dense.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            mass: self.mass * factor,
            com_flange_frame: self.com_flange_frame,
            inertia_com_diag: self.inertia_com_diag.map(|i| i * factor),
        }
    }
}

impl From<PayloadSpec> for Payload {
    fn from(spec: PayloadSpec) -> Self {
        Self {
            mass: spec.mass,
            com: spec.com_flange_frame,
            inertia: spec.inertia_com_diag,
        }
    }
}

/// Mismatch: actual value over nominal value.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mismatch {
    /// Of viscous and Coulomb friction of every axis.
    pub friction: f64,
    /// Of mass and inertia of every payload.
    pub payload: f64,
}

impl Default for Mismatch {
    fn default() -> Self {
        Self {
            friction: 1.0,
            payload: 1.0,
        }
    }
}

/// One step of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Step {
    /// Gate move: up, across, down.
    Jump(Jump),
    /// Straight line of the tool.
    Line(Line),
    /// Straight in joint space.
    Joints(Line),
    /// Wait until the arm has arrived, then this many seconds.
    Dwell(f64),
    /// This many seconds after the last move was accepted, stop on the path.
    Stop(f64),
    /// Take a payload and announce it.
    Pick(PayloadSpec),
    /// Release the payload and announce it.
    Place {},
}

/// A gate move.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Jump {
    /// Flange at the end: x, y, z (m) and yaw (rad) in frame 0.
    #[serde(deserialize_with = "exactly")]
    pub to: [f64; 4],
    /// z of the flange on its way across, m in frame 0: absolute, not relative to start or end.
    pub top: f64,
    /// Length of the strictly vertical part at each end, m upwards from the flange at that end.
    pub clearance: f64,
    /// Share of full speed.
    #[serde(default = "full")]
    pub speed: f64,
}

/// A move to a pose or to joint positions.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Flange x, y, z (m) and yaw (rad) in frame 0, or the four joint positions (rad, rad, m, rad).
    #[serde(deserialize_with = "exactly")]
    pub to: [f64; 4],
    /// Share of full speed.
    #[serde(default = "full")]
    pub speed: f64,
}

fn full() -> f64 {
    1.0
}

/// Why a scenario was refused.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The text is not a scenario; the message names line and key.
    #[error("scenario {origin}: {message}")]
    Parse {
        /// File or name.
        origin: String,
        /// What is wrong and where.
        message: String,
    },
    /// A value is not allowed.
    #[error("scenario {origin}: {}{key} is {value}; allowed: {allowed}", at(*place))]
    Value {
        /// File or name.
        origin: String,
        /// Line and column, counted from 1, where the value is in the text.
        place: Option<(usize, usize)>,
        /// Key, as in `cycle[2].jump.top`.
        key: String,
        /// The value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
}

fn at(place: Option<(usize, usize)>) -> String {
    place.map_or_else(String::new, |(line, column)| {
        format!("line {line}, column {column}: ")
    })
}

/// Names of the scenarios that come with the program.
pub fn names() -> String {
    BUILT_IN.map(|(name, _)| name).join(", ")
}

impl Scenario {
    /// The scenario of this name that comes with the program.
    pub fn built_in(name: &str) -> Option<Self> {
        let (name, text) = BUILT_IN.iter().find(|(known, _)| *known == name)?;
        Some(Self::parse(text, name).expect("the built-in scenarios are valid"))
    }

    /// The scenario written in `text`; `origin` is named in errors.
    ///
    /// # Errors
    /// See [`ScenarioError`].
    pub fn parse(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        let mut scenario: Self = toml::from_str(text).map_err(|error| ScenarioError::Parse {
            origin: origin.into(),
            message: with_nearest(error.to_string().trim_end()),
        })?;
        scenario.source = Source {
            origin: origin.into(),
            text: text.into(),
        };
        scenario.check()?;
        Ok(scenario)
    }

    /// The text of a scenario file that says all this, and nothing by default.
    ///
    /// # Panics
    /// Never: numbers and texts can be written.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("numbers and texts can be written")
    }

    /// The payload for a mass of `kg` alone: the scenario's own body, scaled in density, or a compact one; none for 0
    /// kg.
    pub fn payload_of(&self, kg: f64) -> Option<PayloadSpec> {
        if kg == 0.0 {
            return None;
        }
        Some(match self.payload {
            Some(payload) if payload.mass > 0.0 => payload.scaled(kg / payload.mass),
            _ => PayloadSpec::compact(kg),
        })
    }
}

/// Adds the nearest known key to the message about an unknown one: most likely the one that was meant.
fn with_nearest(message: &str) -> String {
    let between_ticks: Vec<&str> = message
        .rsplit_once("unknown field ")
        .map_or("", |(_, words)| words)
        .split('`')
        .skip(1)
        .step_by(2)
        .collect();
    match between_ticks.split_first() {
        Some((unknown, known)) => nearest(unknown, known.iter().copied()).map_or_else(
            || message.into(),
            |near| format!("{message}\ndid you mean {near}?"),
        ),
        None => message.into(),
    }
}

/// Most cycles of a run.
pub const MAX_CYCLES: u32 = 1_000_000;

/// Checks that a control rate can be simulated.
///
/// # Errors
/// What is allowed.
pub fn check_rate(rate_hz: f64) -> Result<(), &'static str> {
    if (100.0..=10_000.0).contains(&rate_hz) {
        Ok(())
    } else {
        Err("100 to 10000 Hz")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_scenarios_are_valid_and_named_as_listed() {
        for (name, text) in BUILT_IN {
            let scenario = Scenario::parse(text, name).unwrap();
            assert_eq!(scenario.name, name);
        }
    }

    #[test]
    fn there_is_no_scenario_of_another_name() {
        assert!(Scenario::built_in("nowhere").is_none());
    }
}
