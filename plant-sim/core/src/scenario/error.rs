//! Why there is no scenario.

use std::fmt;

use protocol::messages::WristTurn;

use crate::text::{lines, nearest};

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
    /// Several values make no sense.
    #[error("{}", lines(.0))]
    Several(Vec<ScenarioError>),
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

/// A message of the TOML reader for people: without words of Rust, and with the nearest known key for an unknown one, which
/// most likely was meant.
pub(super) fn for_people(message: &str) -> String {
    let message = in_words(message);
    let message: Vec<_> = message.lines().map(shortened).collect();
    let message = message.join("\n");
    let unknown = ["unknown field ", "unknown word "]
        .iter()
        .find_map(|words| message.rsplit_once(words));
    let between_ticks: Vec<&str> = unknown
        .map_or("", |(_, words)| words)
        .split('`')
        .skip(1)
        .step_by(2)
        .collect();
    let near = between_ticks
        .split_first()
        .and_then(|(unknown, known)| nearest(unknown, known.iter().copied()));
    match near {
        Some(near) => format!("{message}\ndid you mean {near}?"),
        None => message,
    }
}

/// A line that fits a few lines of a terminal.
fn shortened(line: &str) -> String {
    const MOST: usize = 500;
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("{} ...", &line[..end]),
        None => line.to_owned(),
    }
}

/// Types as a person who writes TOML names them.
const WORDS: [(&str, &str); 13] = [
    (
        "expected u32",
        "expected a whole number from 0 to 4294967295",
    ),
    (
        "expected u64",
        "expected a whole number from 0 to 9223372036854775807",
    ),
    (
        "wanted exactly 1 element, more than 1 element",
        "expected one step, found several: each needs a [[cycle]] of its own",
    ),
    (
        "wanted exactly 1 element, found 0 elements",
        "expected a step, such as dwell = 0.1",
    ),
    (
        "expected struct variant Step::Place",
        "expected {}: a place has no values",
    ),
    ("expected f64", "expected a number"),
    ("expected a sequence", "expected an array"),
    ("floating point `", "number `"),
    ("` as i128", "`"),
    (
        "unit variant, expected string only",
        "no step, expected a table such as { dwell = 0.1 }",
    ),
    ("unknown variant", "unknown word"),
    // Only a table without keys is allowed where none are available.
    (
        "unexpected keys in table: ",
        "expected {}: a place has no values, and this table has ",
    ),
    (", available keys:", ""),
];

fn in_words(message: &str) -> String {
    let most = WristTurn::MOST;
    let turn = format!("expected a whole number from -{most} to {most}");
    let mut message = message.replace("expected i8", &turn);
    for (type_name, words) in WORDS {
        message = message.replace(type_name, words);
    }
    // The names of our own structures are of no use to anybody.
    while let Some((before, after)) = message.split_once("expected struct ") {
        let rest = after.trim_start_matches(|c: char| c.is_ascii_alphanumeric());
        message = format!("{before}expected a table{rest}");
    }
    message
}
