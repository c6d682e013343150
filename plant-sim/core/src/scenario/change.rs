//! Single values of a scenario, changed from outside its text.

use std::str::FromStr;

use serde::Deserialize as _;
use toml::{Table, Value};

use super::error::for_people;
use super::{Scenario, ScenarioError};

/// One value of a scenario, changed from outside its text.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// As the person wrote it, for messages.
    pub said: String,
    key: String,
    value: Value,
}

impl Change {
    /// Sets the value under `key`, such as `cycle[1].line.speed`.
    pub fn new(said: String, key: &str, value: impl Into<Value>) -> Self {
        Self {
            said,
            key: key.into(),
            value: value.into(),
        }
    }

    /// Whether the value under `key` comes from here.
    pub(super) fn is_of(&self, key: &str) -> bool {
        key.strip_prefix(&self.key)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    }

    /// Puts the value in its place.
    fn apply(&self, scenario: &mut Table) -> Result<(), String> {
        let mut words = self.key.split(['.', '[']);
        let first = words.next().unwrap_or_default();
        let mut at = scenario.entry(first).or_insert(Value::Table(Table::new()));
        let mut path = first.to_owned();
        for word in words {
            at = match (word.strip_suffix(']'), at) {
                (Some(index), Value::Array(values)) => {
                    let number = values.len();
                    let value = index
                        .parse()
                        .ok()
                        .and_then(|index: usize| values.get_mut(index));
                    path += &format!("[{index}]");
                    value.ok_or_else(|| {
                        format!("there is no {path}; the first of {number} is [0]")
                    })?
                }
                // A step has one key, its kind.
                (None, Value::Table(step))
                    if path.starts_with("cycle[")
                        && path.ends_with(']')
                        && !step.contains_key(word) =>
                {
                    let kinds: Vec<_> = step.keys().map(String::as_str).collect();
                    return Err(format!("{path} is no {word}, but a {}", kinds.join(", ")));
                }
                (None, Value::Table(table)) => {
                    path += &format!(".{word}");
                    table.entry(word).or_insert(Value::Table(Table::new()))
                }
                (Some(_), other) => {
                    return Err(format!(
                        "{path} is no array, but of type {}",
                        other.type_str()
                    ));
                }
                (None, other) => {
                    return Err(format!(
                        "{path} is no table, but of type {}",
                        other.type_str()
                    ));
                }
            };
        }
        *at = self.value.clone();
        Ok(())
    }
}

/// `KEY=VALUE`: a value as TOML writes it; a text needs no quotes.
impl FromStr for Change {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) = text
            .split_once('=')
            .ok_or("allowed: KEY=VALUE, such as gains.bandwidth=80")?;
        let (key, value) = (key.trim(), value.trim());
        let parsed = format!("value = {value}").parse::<Table>();
        let parsed = parsed.ok().and_then(|mut table| table.remove("value"));
        Ok(Self::new(
            format!("--set {key}={value}"),
            key,
            parsed.unwrap_or_else(|| value.into()),
        ))
    }
}

/// The scenario of a text with values changed, one after the other: what cannot be read any more is the fault of the change.
pub(super) fn changed(
    text: &str,
    origin: &str,
    changes: &[Change],
) -> Result<Option<Scenario>, ScenarioError> {
    if changes.is_empty() {
        return Ok(None);
    }
    let mut table = text
        .parse::<Table>()
        .map_err(|error| ScenarioError::Parse {
            origin: origin.into(),
            message: error.to_string(),
        })?;
    let mut scenario = None;
    for change in changes {
        let wrong = |message: &str| ScenarioError::Change {
            origin: origin.into(),
            said: change.said.clone(),
            message: message.lines().collect::<Vec<_>>().join(", "),
        };
        change
            .apply(&mut table)
            .map_err(|message| wrong(&message))?;
        let changed = Scenario::deserialize(table.clone());
        scenario = Some(changed.map_err(|error| wrong(&for_people(error.to_string().trim_end())))?);
    }
    Ok(scenario)
}
