//! Names of axes and of states of the controller, as a scenario writes them.

use std::borrow::Cow;

use protocol::messages::Mode;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use crate::model::AXES;
use crate::text::allowed;

/// An axis, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(try_from = "String", into = "&'static str")]
pub struct Axis(pub usize);

/// A state of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(try_from = "String", into = "&'static str")]
pub struct StateName(pub Mode);

impl From<Axis> for &'static str {
    fn from(Axis(number): Axis) -> Self {
        AXES[number]
    }
}

impl From<StateName> for &'static str {
    fn from(StateName(mode): StateName) -> Self {
        mode.name()
    }
}

impl TryFrom<String> for Axis {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let number = AXES.iter().position(|axis| *axis == name);
        number
            .map(Self)
            .ok_or_else(|| unknown("axis", &name, &AXES))
    }
}

impl TryFrom<String> for StateName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Mode::from_name(&name)
            .map(Self)
            .ok_or_else(|| unknown("state", &name, &states()))
    }
}

fn states() -> Vec<&'static str> {
    Mode::CODES.iter().map(|(_, name)| *name).collect()
}

fn unknown(what: &str, name: &str, known: &[&str]) -> String {
    format!(
        "there is no {what} {name:?}; allowed: {}",
        allowed(name, known)
    )
}

impl JsonSchema for Axis {
    fn schema_name() -> Cow<'static, str> {
        "Axis".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "enum": AXES })
    }
}

impl JsonSchema for StateName {
    fn schema_name() -> Cow<'static, str> {
        "State".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "enum": states() })
    }
}
