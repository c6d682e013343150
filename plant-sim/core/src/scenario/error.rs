//! Why there is no scenario.

use std::fmt;

use crate::text::nearest;

/// Why there is no scenario.
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
    /// A value that was changed from outside cannot be read.
    #[error("scenario {origin}: {said}: {message}")]
    Change {
        /// File or name.
        origin: String,
        /// What asked for it, such as `--set gains.bandwidth=80`.
        said: String,
        /// What is wrong with it.
        message: String,
    },
    /// A value makes no sense.
    #[error("scenario {origin}: {place}{key} is {value}; allowed: {allowed}")]
    Value {
        /// File or name.
        origin: String,
        /// Where the value is said.
        place: Place,
        /// Key, as in `cycle[2].jump.top`.
        key: String,
        /// What it is.
        value: String,
        /// What it may be.
        allowed: String,
    },
}

/// Where a value of a scenario is said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line and column of the text, counted from 1.
    Text(usize, usize),
    /// A change from outside, as it was written.
    Change(String),
    /// Nowhere: it is a default.
    Default,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(line, column) => write!(f, "line {line}, column {column}: "),
            Self::Change(said) => write!(f, "{said}: "),
            Self::Default => Ok(()),
        }
    }
}

/// Adds the nearest known key to the message about an unknown one: most likely the one that was meant.
pub(super) fn with_nearest(message: &str) -> String {
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
