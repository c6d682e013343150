//! How the arm is operated, as a scenario names it.

use protocol::messages::Operation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the arm is operated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Operation")]
#[expect(missing_docs, reason = "the names say it")]
pub enum OperationName {
    #[default]
    Automatic,
    Manual,
}

impl OperationName {
    /// Whether moves go on by themselves.
    pub(crate) fn is_automatic(&self) -> bool {
        *self == Self::Automatic
    }

    /// As the protocol has it.
    pub(crate) fn code(self) -> Operation {
        match self {
            Self::Automatic => Operation::Automatic,
            Self::Manual => Operation::Manual,
        }
    }
}
