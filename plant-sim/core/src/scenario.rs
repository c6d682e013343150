//! What to run: start, payload, law, and the steps of a cycle. A TOML file or one by name.

use serde::Deserialize;

use crate::model::Payload;
use crate::selection::LawChoice;

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
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name, for the summary.
    pub name: String,
    /// How often the cycle is repeated.
    pub cycles: u32,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Control law and compensation, such as `computed-torque:observer`.
    pub law: LawChoice,
    /// Gains, where not the controller's own.
    #[serde(default)]
    pub gains: Option<GainsSpec>,
    /// Tool pose at the start: x, y, z, yaw. The elbow is at the positive side.
    pub start: [f64; 4],
    /// What the flange carries from the start.
    #[serde(default)]
    pub payload: Option<PayloadSpec>,
    /// How the true robot differs from what the controller believes.
    #[serde(default)]
    pub mismatch: Mismatch,
    /// Steps of one cycle.
    pub cycle: Vec<Step>,
}

/// Gains of the closed loop, the same for every law.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PayloadSpec {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the flange frame, m.
    pub com_flange_frame: [f64; 3],
    /// Principal moments of inertia about the centre of mass, kg m².
    pub inertia_com_diag: [f64; 3],
}

impl PayloadSpec {
    /// A compact body of `mass` kg: centre of mass 50 mm below the flange, radius of gyration as
    /// that of the 2 kg benchmark payload.
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

/// True value over the value that the controller believes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
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
    /// Let go of the payload and announce it.
    Place {},
}

/// A gate move.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Jump {
    /// x, y, z, yaw.
    pub to: [f64; 4],
    /// Height of the tool at the top.
    pub top: f64,
    /// Vertical part at both ends.
    pub clearance: f64,
    /// Share of full speed.
    #[serde(default = "full")]
    pub speed: f64,
}

/// A move to a pose or to joint positions.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// x, y, z, yaw or the four joint positions.
    pub to: [f64; 4],
    /// Share of full speed.
    #[serde(default = "full")]
    pub speed: f64,
}

fn full() -> f64 {
    1.0
}

/// Why there is no scenario.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The text is no scenario; the message names line and key.
    #[error("scenario {origin}: {message}")]
    Parse {
        /// File or name.
        origin: String,
        /// What is wrong and where.
        message: String,
    },
    /// A value makes no sense.
    #[error("scenario {origin}: {key} is {value}; allowed: {allowed}")]
    Value {
        /// File or name.
        origin: String,
        /// Key.
        key: &'static str,
        /// What it is.
        value: String,
        /// What it may be.
        allowed: &'static str,
    },
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
        let scenario: Self = toml::from_str(text).map_err(|error| ScenarioError::Parse {
            origin: origin.into(),
            message: error.to_string().trim_end().to_string(),
        })?;
        scenario.check(origin)?;
        Ok(scenario)
    }

    /// The payload of `kg` that a person asks for by weight alone: the scenario's own body, as much denser or lighter, or a
    /// compact one; none for 0 kg.
    pub fn payload_of(&self, kg: f64) -> Option<PayloadSpec> {
        if kg == 0.0 {
            return None;
        }
        Some(match self.payload {
            Some(payload) if payload.mass > 0.0 => payload.scaled(kg / payload.mass),
            _ => PayloadSpec::compact(kg),
        })
    }

    fn check(&self, origin: &str) -> Result<(), ScenarioError> {
        let wrong = |key, value: String, allowed| {
            Err(ScenarioError::Value {
                origin: origin.into(),
                key,
                value,
                allowed,
            })
        };
        if self.cycles == 0 || self.cycles > MAX_CYCLES {
            return wrong("cycles", self.cycles.to_string(), "1 to 1000000");
        }
        check_rate(self.rate_hz)
            .or_else(|allowed| wrong("rate_hz", self.rate_hz.to_string(), allowed))?;
        if self.cycle.is_empty() {
            return wrong("cycle", "empty".into(), "at least one step");
        }
        for factor in [self.mismatch.friction, self.mismatch.payload] {
            if !(0.0..=10.0).contains(&factor) {
                return wrong("mismatch", factor.to_string(), "factors from 0 to 10");
            }
        }
        for step in &self.cycle {
            let (values, speed) = match step {
                Step::Jump(Jump {
                    to,
                    top,
                    clearance,
                    speed,
                }) => (to.iter().chain([top, clearance]).copied().collect(), *speed),
                Step::Line(Line { to, speed }) | Step::Joints(Line { to, speed }) => {
                    (to.to_vec(), *speed)
                }
                Step::Dwell(seconds) | Step::Stop(seconds) => {
                    if !(0.0..=3600.0).contains(seconds) {
                        return wrong("dwell or stop", seconds.to_string(), "0 to 3600 s");
                    }
                    (vec![], 1.0)
                }
                Step::Pick(payload) => {
                    if !(payload.mass > 0.0 && payload.mass.is_finite()) {
                        return wrong("pick.mass", payload.mass.to_string(), "more than 0 kg");
                    }
                    (payload.inertia_com_diag.to_vec(), 1.0)
                }
                Step::Place {} => (vec![], 1.0),
            };
            if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                return wrong("cycle", value.to_string(), "finite numbers");
            }
            if !(speed > 0.0 && speed <= 1.0) {
                return wrong("speed", speed.to_string(), "more than 0, at most 1");
            }
        }
        Ok(())
    }
}

/// Most cycles of a run.
pub const MAX_CYCLES: u32 = 1_000_000;

/// Whether a control rate can be simulated.
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
    fn errors_say_where_and_what_is_allowed() {
        let gate = BUILT_IN[0].1;
        for (from, to, expected) in [
            (
                "cycles = 10",
                "cycles = 0",
                "cycles is 0; allowed: 1 to 1000000",
            ),
            ("rate_hz = 1000", "rate_hz = 1", "allowed: 100 to 10000 Hz"),
            (
                "cycles = 10",
                "cycles = 10\nspeeed = 1",
                "unknown field `speeed`",
            ),
            ("dwell = 0.25", "dwell = nan", "dwell or stop is NaN"),
            (
                "computed-torque:observer",
                "magic",
                "no control law 'magic'",
            ),
            (
                "clearance = 0.005 }",
                "clearance = 0.005, speed = 2.0 }",
                "speed is 2",
            ),
        ] {
            assert!(gate.contains(from));
            let text = gate.replacen(from, to, 1);
            let message = Scenario::parse(&text, "x.toml").unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
            assert!(message.contains("x.toml"), "{message}");
        }
        assert!(Scenario::built_in("nowhere").is_none());
    }
}
