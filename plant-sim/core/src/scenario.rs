//! Scenarios: start, payload, law, and the steps of a cycle, as TOML text or by name.

mod change;
mod check;
mod error;
mod library;
mod operation;
mod requirement;
mod step;

use firmware::control::laws::Gains;
use protocol::messages::WristTurn;
use protocol::parameters::ControllerParameter as Parameter;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::allowed::schema::{Gain, by};
use crate::allowed::{PAYLOAD_COM, PAYLOAD_INERTIA, PAYLOAD_MASS};
use crate::faults::Fault;
use crate::maths::hypot;
use crate::model::Payload;
use crate::selection::LawChoice;

pub use change::Change;
pub use check::millimetres;
use error::for_people;
pub use error::{Place, ScenarioError};
pub use library::{built_in, instead_of, names};
pub use operation::OperationName;
pub(crate) use requirement::Measured;
pub use requirement::{Axis, Ending, Quantity, Requirement, StateName};

pub use crate::text::Source;
pub use step::{Arc, Elbow, Joints, Jump, Line, Override, Release, Step};

/// What to run. Lengths in m in frame 0, angles in rad. An unknown key is refused.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name, for the summary.
    pub name: String,
    /// What it is for, in a sentence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Number of cycles.
    #[schemars(range(min = 1, max = MAX_CYCLES))]
    pub cycles: u32,
    /// Control rate, Hz.
    #[schemars(transform = by(check::RATE))]
    pub rate_hz: f64,
    /// Control law and compensation, such as `computed-torque:observer`.
    pub law: LawChoice,
    /// How the arm is operated: in `manual` it moves only while the operator holds a button, as here he does unless a step says
    /// otherwise, and no faster at the tool than 250 mm/s, with the laws that have a model of the arm.
    #[serde(default, skip_serializing_if = "OperationName::is_automatic")]
    pub operation: OperationName,
    /// Gains; otherwise the controller's defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gains: Option<GainsSpec>,
    /// Tool pose at the start: x, y, z, yaw.
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(check::POSE))]
    pub start: [f64; 4],
    /// Side to which the elbow bends at the start; positive if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_elbow: Option<Elbow>,
    /// Turn of the wrist at the start: whole revolutions of theta4, 0 from -pi to pi; the one nearest to 0 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -WristTurn::MOST, max = WristTurn::MOST))]
    pub start_turn: Option<i8>,
    /// Payload at the flange from the start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload: Option<PayloadSpec>,
    /// How the actual robot differs from the nominal one.
    #[serde(default)]
    pub mismatch: Mismatch,
    /// What breaks during the run, as `encoder:elbow:stuck@0.3s`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<String>")]
    pub faults: Vec<Fault>,
    /// Seed of whatever is random in the faults.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub seed: u64,
    /// How the run is to end: one that ends otherwise has failed.
    #[serde(default, skip_serializing_if = "Ending::is_usual")]
    pub ends: Ending,
    /// Steps of one cycle.
    #[schemars(length(min = 1))]
    pub cycle: Vec<Step>,
    /// What is required of the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub requirements: Vec<Requirement>,
    /// The text that this was read from, for places in messages.
    #[serde(skip)]
    pub source: Source,
    /// Changes to the values of that text.
    #[serde(skip)]
    pub changes: Vec<Change>,
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

/// Gains of the loop, for every law; those left out are the controller's own. The loop needs a margin for its delay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Gains")]
pub struct GainsSpec {
    /// Natural frequency of the error dynamics, rad/s.
    #[schemars(transform = Gain(Parameter::Bandwidth))]
    pub bandwidth: Option<f64>,
    /// Damping ratio.
    #[schemars(transform = Gain(Parameter::Damping))]
    pub damping: Option<f64>,
    /// Corner of the disturbance observer, or 1 / integral time, rad/s.
    #[schemars(transform = Gain(Parameter::Observer))]
    pub observer: Option<f64>,
}

impl GainsSpec {
    /// Key, parameter and value of each gain; those left out are the controller's `own`.
    pub(crate) fn each(&self, own: &Gains) -> [(&'static str, Parameter, f64); 3] {
        [
            (
                "gains.bandwidth",
                Parameter::Bandwidth,
                self.bandwidth,
                own.bandwidth,
            ),
            (
                "gains.damping",
                Parameter::Damping,
                self.damping,
                own.damping,
            ),
            (
                "gains.observer",
                Parameter::Observer,
                self.observer,
                own.observer,
            ),
        ]
        .map(|(key, parameter, value, own)| (key, parameter, value.unwrap_or(f64::from(own))))
    }

    /// All of them.
    pub(crate) fn complete(&self, own: &Gains) -> Self {
        let [bandwidth, damping, observer] = self.each(own).map(|(_, _, value)| Some(value));
        Self {
            bandwidth,
            damping,
            observer,
        }
    }
}

/// What the flange carries. No moment of inertia is greater than the sum of the other two.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Payload")]
pub struct PayloadSpec {
    /// Mass, kg.
    #[schemars(transform = by(PAYLOAD_MASS))]
    pub mass: f64,
    /// Centre of mass in the flange frame, m.
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(PAYLOAD_COM))]
    pub com_flange_frame: [f64; 3],
    /// Principal moments of inertia about the centre of mass, kg m².
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(PAYLOAD_INERTIA))]
    pub inertia_com_diag: [f64; 3],
}

impl PayloadSpec {
    /// An empty hand.
    pub(crate) const NOTHING: Self = Self {
        mass: 0.0,
        com_flange_frame: [0.0; 3],
        inertia_com_diag: [0.0; 3],
    };

    /// A compact body of `mass` kg: centre of mass 50 mm below the flange, radius of gyration as
    /// that of the 2 kg benchmark payload.
    pub fn compact(mass: f64) -> Self {
        Self {
            mass,
            com_flange_frame: [0.0, 0.0, 0.05],
            inertia_com_diag: [0.004 * mass, 0.004 * mass, 0.005 * mass],
        }
    }

    /// Distance of its centre of mass from the axis of the flange, m.
    pub(crate) fn off_axis(&self) -> f64 {
        let [x, y, _] = self.com_flange_frame;
        hypot(x, y)
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
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mismatch {
    /// Of viscous and Coulomb friction of every axis.
    #[schemars(transform = by(check::FACTOR))]
    pub friction: f64,
    /// Of mass and inertia of every payload.
    #[schemars(transform = by(check::FACTOR))]
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

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde hands over a reference"
)]
fn is_zero(seed: &u64) -> bool {
    *seed == 0
}

impl Scenario {
    /// The scenario of this name that comes with the program.
    pub fn built_in(name: &str) -> Option<Self> {
        let text = built_in(name)?;
        Some(Self::parse(text, name).expect("the built-in scenarios are valid"))
    }

    /// The scenario written in `text`; `origin` is named in errors.
    ///
    /// # Errors
    /// See [`ScenarioError`].
    pub fn parse(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        Self::parse_with(text, origin, &[])
    }

    /// The scenario written in `text` with some values changed, and checked like any other.
    ///
    /// # Errors
    /// See [`ScenarioError`].
    pub fn parse_with(text: &str, origin: &str, changes: &[Change]) -> Result<Self, ScenarioError> {
        let mut scenario: Self = toml::from_str(text).map_err(|error| ScenarioError::Parse {
            origin: origin.into(),
            message: for_people(error.to_string().trim_end()),
        })?;
        if let Some(changed) = change::changed(text, origin, changes)? {
            scenario = changed;
        }
        scenario.source = Source {
            origin: origin.into(),
            text: text.into(),
        };
        scenario.changes = changes.to_vec();
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

    /// Takes the weight of the payload that a person asks for: of what the scenario picks, if it picks, and else of what the
    /// flange carries from the start. It is the scenario's own body, as much denser or lighter, or a compact one.
    ///
    /// # Errors
    /// Why the scenario has no use for it.
    pub fn carry(&mut self, kg: f64) -> Result<(), &'static str> {
        let mut picks = self.cycle.iter_mut().filter_map(|step| match step {
            Step::Pick(payload) => Some(payload),
            _ => None,
        });
        if let Some(first) = picks.next() {
            if kg == 0.0 {
                return Err("picks something, which has a weight");
            }
            for payload in picks.chain([first]) {
                *payload = payload.scaled(kg / payload.mass);
            }
            return Ok(());
        }
        self.payload = match self.payload {
            _ if kg == 0.0 => None,
            Some(payload) if payload.mass > 0.0 => Some(payload.scaled(kg / payload.mass)),
            _ => Some(PayloadSpec::compact(kg)),
        };
        Ok(())
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
