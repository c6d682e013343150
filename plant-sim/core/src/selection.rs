//! Names of control laws: `LAW` or `LAW:COMPENSATION`.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use protocol::messages::{Compensation, Law};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use crate::text::allowed;

/// A control law and its compensation of friction and payload error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct LawChoice {
    /// Law.
    pub law: Law,
    /// Compensation; `None` for laws that have none.
    pub compensation: Compensation,
}

/// A name that is not a control law.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LawError {
    /// No such law.
    #[error("no control law '{0}'; allowed: {list}", list = allowed(.0, &names()))]
    Law(String),
    /// No such compensation.
    #[error("no compensation '{0}'; allowed: {list}", list = allowed(.0, &["none", "integral", "observer"]))]
    Compensation(String),
    /// A compensation for a law that takes none.
    #[error("{0} takes no compensation; only computed-torque and computed-torque-task do")]
    NotTaken(Law),
}

fn names() -> Vec<&'static str> {
    Law::CODES.iter().map(|(_, name)| *name).collect()
}

impl FromStr for LawChoice {
    type Err = LawError;

    fn from_str(text: &str) -> Result<Self, LawError> {
        let (name, suffix) = match text.split_once(':') {
            Some((name, suffix)) => (name, Some(suffix)),
            None => (text, None),
        };
        let law = Law::from_name(name).ok_or_else(|| LawError::Law(name.into()))?;
        let compensation = match suffix {
            None if law.takes_compensation() => Compensation::Observer,
            None => Compensation::None,
            Some(_) if !law.takes_compensation() => return Err(LawError::NotTaken(law)),
            Some(suffix) => Compensation::from_name(suffix)
                .ok_or_else(|| LawError::Compensation(suffix.into()))?,
        };
        Ok(Self { law, compensation })
    }
}

impl TryFrom<String> for LawChoice {
    type Error = LawError;

    fn try_from(text: String) -> Result<Self, LawError> {
        text.parse()
    }
}

impl JsonSchema for LawChoice {
    fn schema_name() -> Cow<'static, str> {
        "Law".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let names = Law::ALL.iter().flat_map(|law| {
            let compensations: &[Compensation] = if law.takes_compensation() {
                Compensation::ALL
            } else {
                &[]
            };
            let full = compensations
                .iter()
                .map(move |help| format!("{law}:{help}"));
            std::iter::once(law.to_string()).chain(full)
        });
        json_schema!({ "type": "string", "enum": names.collect::<Vec<_>>() })
    }
}

impl Serialize for LawChoice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl fmt::Display for LawChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.law.takes_compensation() {
            write!(f, "{}:{}", self.law, self.compensation)
        } else {
            write!(f, "{}", self.law)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_reads_back_as_written() {
        for law in Law::ALL {
            for compensation in Compensation::ALL {
                let taken = law.takes_compensation();
                let choice = LawChoice {
                    law: *law,
                    compensation: if taken {
                        *compensation
                    } else {
                        Compensation::None
                    },
                };
                assert_eq!(choice.to_string().parse(), Ok(choice));
            }
        }
        assert!("pid:observer".parse::<LawChoice>().is_err());
        assert!("computed-torque:x".parse::<LawChoice>().is_err());
    }
}
