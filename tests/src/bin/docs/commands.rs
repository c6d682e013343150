//! Commands in documents: every subcommand, option and cargo target that they name exists.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, iter};

use serde_json::Value;

use crate::Problem;
use crate::markdown::Document;

/// The project's programs and the targets of the workspace.
pub(crate) struct Programs {
    root: PathBuf,
    /// The folder of these programs, followed by the other folders of `PATH`.
    path: String,
    /// Packages, each with the names of its targets.
    targets: HashMap<String, Vec<String>>,
    /// Help by command, since documents repeat the same ones.
    help: RefCell<HashMap<String, Result<String, String>>>,
}

impl Programs {
    /// Those beside this program, built for release.
    pub(crate) fn new(root: &Path) -> Result<Self, String> {
        let this = env::current_exe()
            .map_err(|error| format!("cannot find the path of this program: {error}"))?;
        // target/release/docs, or a test of it in target/debug/deps.
        let built = this
            .ancestors()
            .find(|folder| folder.join("release").is_dir());
        let built = built.ok_or("no folder 'release' above this program; cargo build --release")?;
        let path = env::var("PATH").unwrap_or_default();
        let mut programs = Self {
            root: root.into(),
            path: format!("{}:{path}", built.join("release").display()),
            targets: HashMap::new(),
            help: RefCell::default(),
        };
        let metadata = programs.output("cargo metadata --no-deps --offline --format-version 1")?;
        let metadata: Value =
            serde_json::from_str(&metadata).map_err(|error| format!("cargo metadata: {error}"))?;
        let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
        let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
        programs.targets = list(&metadata["packages"])
            .iter()
            .map(|package| {
                (
                    name(package),
                    list(&package["targets"]).iter().map(name).collect(),
                )
            })
            .collect();
        Ok(programs)
    }

    /// Output of the command.
    pub(crate) fn output(&self, command: &str) -> Result<String, String> {
        let output = Command::new("bash")
            .args(["-o", "pipefail", "-c", command])
            .current_dir(&self.root)
            .env("PATH", &self.path)
            .output()
            .map_err(|error| format!("cannot start bash: {error}"))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            return Err(format!("`{command}` failed, {}\n{said}", output.status));
        }
        String::from_utf8(output.stdout)
            .map_err(|_| format!("the output of `{command}` is not UTF-8"))
    }

    fn help_of(&self, command: &str) -> Result<String, String> {
        let mut known = self.help.borrow_mut();
        known
            .entry(command.to_owned())
            .or_insert_with(|| self.output(&format!("{command} --help")))
            .clone()
    }

    /// The problem with a command, if it is one of those that are checked.
    fn fault(&self, command: &str) -> Option<String> {
        let words: Vec<&str> = command
            .split_whitespace()
            .take_while(|word| !matches!(*word, "|" | ">" | "<" | "&" | "&&" | "#"))
            .collect();
        match words.as_slice() {
            ["plant-sim", arguments @ ..] => self.fault_in_arguments("plant-sim", arguments),
            ["controller", arguments @ ..] => self.fault_in_arguments("controller", arguments),
            ["cargo", "run", "--release", "--", arguments @ ..] => {
                self.fault_in_arguments("plant-sim", arguments)
            }
            ["cargo" | "tests/board/cargo", arguments @ ..] => self.fault_in_targets(arguments),
            _ => None,
        }
    }

    fn fault_in_arguments(&self, program: &str, arguments: &[&str]) -> Option<String> {
        // Names of subcommands come first; alternatives are written with a bar.
        let subcommands: Vec<&str> = arguments
            .iter()
            .take_while(|word| word.chars().all(|c| c.is_ascii_lowercase() || c == '-'))
            .take_while(|word| !word.starts_with('-'))
            .copied()
            .collect();
        let help = match self.help_of(&[&[program], &subcommands[..]].concat().join(" ")) {
            // The last word may be an argument: then the help is that of the command without it.
            Err(_) if subcommands.len() > 1 => {
                self.help_of(&[&[program], &subcommands[..1]].concat().join(" "))
            }
            help => help,
        };
        let help = match help {
            Ok(help) => help,
            Err(message) => return Some(message),
        };
        let options = arguments.iter().filter(|word| word.starts_with("--"));
        options
            .map(|option| option.trim_end_matches([',', '.']))
            .find(|option| {
                !help
                    .split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'))
                    .any(|word| word == *option)
            })
            .map(|option| format!("{program} has no such option: {option}"))
    }

    fn fault_in_targets(&self, arguments: &[&str]) -> Option<String> {
        let mut package = "plant-sim";
        let ours = arguments.iter().take_while(|word| **word != "--");
        for (option, value) in ours.clone().zip(ours.skip(1)) {
            match *option {
                "-p" | "--package" => {
                    package = value;
                    if !self.targets.contains_key(package) {
                        return Some(format!("no package {package}"));
                    }
                }
                "--test" | "--example" | "--bench" | "--bin" => {
                    let targets = self.targets.get(package)?;
                    if !targets.iter().any(|target| target == value) {
                        return Some(format!("package {package} has no {option} {value}"));
                    }
                }
                _ => {}
            }
        }
        None
    }
}

/// Commands of the document, in shell fences and in backquotes, that name something missing.
pub(crate) fn check(document: &Document, programs: &Programs) -> Vec<Problem> {
    let shell = document
        .lines()
        .filter(|line| line.fence == Some("sh"))
        .flat_map(|line| iter::repeat(line.number).zip(line.text.split("&& ").map(str::to_owned)));
    shell
        .chain(document.code_spans())
        .filter_map(|(line, command)| {
            let fault = programs.fault(command.trim())?;
            Some(Problem::new(line, format!("`{}`: {fault}", command.trim())))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_that_are_not_there_are_found() {
        let targets = [("plant-sim", "laws"), ("tests", "errata")]
            .map(|(package, target)| (package.to_owned(), vec![target.to_owned()]));
        let programs = Programs {
            root: crate::root(),
            path: "/usr/bin:/bin".into(),
            targets: HashMap::from(targets),
            help: RefCell::new(HashMap::from([
                ("plant-sim".into(), Ok("--rate <HZ>\n".into())),
                ("plant-sim run".into(), Ok("--rate <HZ>\n".into())),
                ("plant-sim trace".into(), Err("no such command".into())),
            ])),
        };
        for right in [
            "cargo run --release --example laws",
            "cargo test -p tests --test errata -- --test none",
            "cargo run --release -- --rate 4",
            "plant-sim run --rate 2000 | tee --append x",
            "candump --none",
        ] {
            assert_eq!(programs.fault(right), None, "{right}");
        }
        for wrong in [
            "cargo run --release --example none",
            "cargo test -p tests --test none",
            "cargo build --package none",
            "cargo run --release -- --seed 1",
            "plant-sim run --rat 2000",
            "plant-sim trace",
        ] {
            assert!(programs.fault(wrong).is_some(), "{wrong}");
        }
    }
}
