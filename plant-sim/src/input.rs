//! Inputs named on the command line: scenarios, robots, payloads.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use sim::model::{self, ModelError, Payload, RobotModel};
use sim::scenario::{self, Change, Scenario, ScenarioError};

/// No file that a person writes has as many bytes. A device may never end.
const MOST: u64 = 64 << 20;

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
    /// The file is of the other kind.
    #[error("{}: it is {found}; {hint}", path.display())]
    Kind {
        /// File.
        path: PathBuf,
        /// What it looks like.
        found: &'static str,
        /// What belongs there, and where this belongs.
        hint: &'static str,
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
        None => self::text(Path::new(name)).map_err(unread(name.as_ref()))?,
    };
    if is_json(&text) {
        return Err(InputError::Kind {
            path: name.into(),
            found: "JSON, like the model of a robot",
            hint: "a scenario is TOML; --model and --plant-model take models",
        });
    }
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
        RobotModel::from_json(&json(path)?).map_err(|source| in_file(path, source))?;
    model.source.origin = name.into();
    Ok((model, warnings))
}

/// The payload in this file.
///
/// # Errors
/// See [`InputError`].
pub fn payload(path: &Path) -> Result<Payload, InputError> {
    Payload::from_json(&json(path)?).map_err(|source| in_file(path, source))
}

fn is_json(text: &str) -> bool {
    serde_json::from_str::<serde_json::Map<String, serde_json::Value>>(text).is_ok()
}

/// The text of a file that has to be JSON.
fn json(path: &Path) -> Result<String, InputError> {
    let text = text(path).map_err(unread(path))?;
    let is_json = serde_json::from_str::<serde_json::Value>(&text).is_ok();
    if !is_json && !text.trim().is_empty() && toml::from_str::<toml::Table>(&text).is_ok() {
        return Err(InputError::Kind {
            path: path.into(),
            found: "TOML, like a scenario",
            hint: "models and payloads are JSON; run, check and view take scenarios",
        });
    }
    Ok(text)
}

/// The text of a file that a person writes, without the mark that some editors put before UTF-8.
///
/// # Errors
/// It cannot be read, or is no such text.
pub(crate) fn text(path: &Path) -> io::Result<String> {
    let wrong = |what| Err(io::Error::new(io::ErrorKind::InvalidData, what));
    if path.is_dir() {
        return wrong("it is a folder; name a file in it");
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MOST).read_to_end(&mut bytes)?;
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return wrong("it is UTF-16; save it as UTF-8");
    }
    if bytes.len() as u64 == MOST {
        return wrong("it has more than 64 MiB, and no such file has");
    }
    if bytes.contains(&0) {
        return wrong("it holds zero bytes, as UTF-16 and programs do; allowed: text in UTF-8");
    }
    let Ok(text) = String::from_utf8(bytes) else {
        return wrong("it is no text; allowed: text in UTF-8");
    };
    Ok(text
        .strip_prefix('\u{FEFF}')
        .map(str::to_owned)
        .unwrap_or(text))
}

fn unread(path: &Path) -> impl FnOnce(io::Error) -> InputError {
    |source| InputError::Read {
        path: path.into(),
        source,
    }
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
        std::fs::write(&file, b"{\0\"\0").unwrap();
        assert!(robot(name).unwrap_err().to_string().contains("zero bytes"));
        std::fs::write(&file, b"\x80").unwrap();
        assert!(robot(name).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn files_of_the_other_kind_are_named_as_such() {
        let folder = tempfile::tempdir().unwrap();
        let name = |name: &str, text: &str| {
            let file = folder.path().join(name);
            std::fs::write(&file, text).unwrap();
            file.to_str().unwrap().to_owned()
        };
        let model = name("a", include_str!("../models/irb930-22-1.05.json"));
        let toml = name("b", include_str!("../scenarios/gate.toml"));
        let refused = [
            (scenario(&model, &[]).map(drop), "JSON, like the model"),
            (robot(&toml).map(drop), "TOML, like a scenario"),
            (payload(toml.as_ref()).map(drop), "TOML, like a scenario"),
            (robot("/").map(drop), "it is a folder"),
            (scenario("/dev/zero", &[]).map(drop), "64 MiB"),
            // What is neither is not taken for one of them.
            (robot(&name("c", "{ \"a\": ")).map(drop), "not JSON"),
            (robot(&name("d", "")).map(drop), "not JSON"),
            // A document of either kind.
            (
                robot(&name("f", "[1]")).map(drop),
                "the document is an array",
            ),
            (scenario(&name("e", ""), &[]).map(drop), "missing field"),
        ];
        for (result, words) in refused {
            let message = result.unwrap_err().to_string();
            assert!(message.contains(words), "{words}: {message}");
        }
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
