//! Inputs named on the command line: scenarios, robots, payloads.

use std::io;
use std::path::{Path, PathBuf};

use sim::model::{self, ModelError, Payload, RobotModel};
use sim::scenario::{self, Change, Scenario, ScenarioError};

/// Why an input cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// Neither a built-in scenario nor a file.
    #[error(
        "no scenario '{name}': neither a file nor one of {}",
        scenario::instead_of(name)
    )]
    NoScenario {
        /// The requested name.
        name: String,
    },
    /// Neither a built-in robot nor a file.
    #[error(
        "no robot '{name}': neither a file nor one of {}",
        model::instead_of(name)
    )]
    NoRobot {
        /// What was asked for.
        name: String,
    },
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// Reason.
        source: io::Error,
    },
    /// The scenario is wrong.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The model or payload is wrong.
    #[error("{}: {source}", path.display())]
    Model {
        /// File.
        path: PathBuf,
        /// What is wrong in it.
        source: ModelError,
    },
}

/// The scenario of this name or in this file.
///
/// # Errors
/// See [`InputError`].
pub fn scenario(name: &str, changes: &[Change]) -> Result<Scenario, InputError> {
    let text = match scenario::built_in(name) {
        Some(text) => text.to_owned(),
        None if !Path::new(name).exists() => {
            return Err(InputError::NoScenario { name: name.into() });
        }
        None => self::text(Path::new(name))?,
    };
    Ok(Scenario::parse_with(&text, name, changes)?)
}

/// The robot of this name, or in this file, with warnings about numbers in it that contradict each other.
///
/// # Errors
/// See [`InputError`].
pub fn robot(name: &str) -> Result<(RobotModel, Vec<String>), InputError> {
    if let Some(robot) = RobotModel::built_in(name) {
        return Ok((robot, Vec::new()));
    }
    let path = Path::new(name);
    if !path.exists() {
        return Err(InputError::NoRobot { name: name.into() });
    }
    let (mut model, warnings) =
        RobotModel::from_json(&text(path)?).map_err(|source| in_file(path, source))?;
    model.source.origin = name.into();
    Ok((model, warnings))
}

/// The payload in this file.
///
/// # Errors
/// See [`InputError`].
pub fn payload(path: &Path) -> Result<Payload, InputError> {
    Payload::from_json(&text(path)?).map_err(|source| in_file(path, source))
}

/// The text of a file, without the mark that some editors put before UTF-8.
fn text(path: &Path) -> Result<String, InputError> {
    std::fs::read(path)
        .and_then(|bytes| {
            let wrong = |what| io::Error::new(io::ErrorKind::InvalidData, what);
            if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
                return Err(wrong("it is UTF-16; save it as UTF-8"));
            }
            let text = String::from_utf8(bytes)
                .map_err(|_| wrong("it is no text; allowed: text in UTF-8"))?;
            Ok(text
                .strip_prefix('\u{FEFF}')
                .map(str::to_owned)
                .unwrap_or(text))
        })
        .map_err(|source| InputError::Read {
            path: path.into(),
            source,
        })
}

fn in_file(path: &Path, source: ModelError) -> InputError {
    InputError::Model {
        path: path.into(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::{payload, robot, scenario};

    #[test]
    fn text_of_other_systems_is_read_or_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("robot.json");
        let name = file.to_str().unwrap();
        let robot_text = include_str!("../models/irb930-22-1.05.json");
        std::fs::write(&file, format!("\u{FEFF}{robot_text}")).unwrap();
        assert!(robot(name).is_ok());
        let units = robot_text.encode_utf16().flat_map(u16::to_le_bytes);
        std::fs::write(
            &file,
            [0xFF, 0xFE].into_iter().chain(units).collect::<Vec<u8>>(),
        )
        .unwrap();
        assert!(robot(name).unwrap_err().to_string().contains("UTF-16"));
        std::fs::write(&file, b"\x80").unwrap();
        assert!(robot(name).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn what_is_not_there_is_named_with_what_is() {
        let message = scenario("nowhere.toml", &[]).unwrap_err().to_string();
        assert!(
            message.contains("nowhere.toml") && message.contains("gate, gate-mismatch"),
            "{message}"
        );
        let message = robot("no/such/robot.json").unwrap_err().to_string();
        assert!(
            message.contains("no/such/robot.json") && message.contains("irb930-22-1.05"),
            "{message}"
        );
        let message = payload("no/such/payload.json".as_ref())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("no/such/payload.json") && message.contains("cannot be read"),
            "{message}"
        );
    }
}
