//! The architecture of docs/architecture.md holds: dependencies between crates and between the modules of a crate, and
//! the length of a file.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use serde_json::Value;

/// Dependencies by name.
type Arrows = BTreeMap<String, BTreeSet<String>>;

/// Most lines of a source file.
const LONGEST: usize = 400;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The drawing that follows the marker `<!-- arrows: NAME -->`: lines `a -> b, c`, in their order.
fn drawn(name: &str) -> Vec<(String, BTreeSet<String>)> {
    let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let (_, after) = text
        .split_once(&format!("<!-- arrows: {name} -->\n```text\n"))
        .unwrap_or_else(|| panic!("docs/architecture.md has no arrows of {name}"));
    let (drawing, _) = after.split_once("```").unwrap();
    let lines = drawing.lines().map(|line| {
        let (from, to) = line.split_once("->").unwrap_or((line, ""));
        let to = to.split(',').map(str::trim).filter(|to| !to.is_empty());
        (from.trim().to_owned(), to.map(str::to_owned).collect())
    });
    lines.collect()
}

/// Checks that every arrow exists, no other does, and each points to a line further down.
fn compare(name: &str, actual: &Arrows) {
    let drawn = drawn(name);
    for (line, (from, to)) in drawn.iter().enumerate() {
        let below: BTreeSet<_> = drawn[line + 1..]
            .iter()
            .map(|(from, _)| from.clone())
            .collect();
        assert!(
            to.is_subset(&below),
            "{name}: {from} -> {to:?} points up; below it are {below:?}"
        );
    }
    let drawn: Arrows = drawn.into_iter().collect();
    assert_eq!(
        &drawn, actual,
        "docs/architecture.md (left) and the sources (right) differ in {name}"
    );
}

fn cargo_metadata() -> Value {
    let output = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()))
        .args([
            "metadata",
            "--no-deps",
            "--offline",
            "--format-version",
            "1",
        ])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn crates_lean_on_each_other_as_drawn() {
    let metadata = cargo_metadata();
    let packages = metadata["packages"].as_array().unwrap();
    let name = |value: &Value| value["name"].as_str().unwrap().to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    let arrows = packages.iter().map(|package| {
        let dependencies = package["dependencies"].as_array().unwrap().iter();
        let to = dependencies
            .filter(|dependency| dependency["kind"].is_null())
            .map(name)
            .filter(|to| ours.contains(to));
        (name(package), to.collect())
    });
    compare("crates", &arrows.collect());
}

#[test]
fn rooms_of_the_firmware_lean_on_each_other_as_drawn() {
    compare("firmware", &rooms(&root().join("firmware/src")));
}

#[test]
fn no_crate_has_a_circle_of_rooms() {
    for source in [
        "firmware/src",
        "firmware/boards/mps2_an386/channel/src",
        "plant-sim/core/src",
        "plant-sim/src",
        "plant-sim/trace/src",
        "protocol/link/src",
        "protocol/src",
    ] {
        let mut arrows = rooms(&root().join(source));
        assert!(arrows.len() > 3, "{source}: no modules");
        // Modules without dependencies are removed, until none is left.
        while !arrows.is_empty() {
            let free: Vec<_> = arrows.iter().filter(|(_, to)| to.is_empty()).collect();
            let free: BTreeSet<_> = free.into_iter().map(|(room, _)| room.clone()).collect();
            assert!(!free.is_empty(), "{source}: a cycle among {arrows:?}");
            arrows.retain(|room, _| !free.contains(room));
            for to in arrows.values_mut() {
                to.retain(|room| !free.contains(room));
            }
        }
    }
}

/// Top-level modules of a crate, and which of the others their files name, without tests.
fn rooms(source: &Path) -> Arrows {
    let mut arrows = Arrows::new();
    for file in rust_files(source) {
        let inside = file.strip_prefix(source).unwrap().with_extension("");
        let room = inside.iter().next().unwrap().to_str().unwrap().to_owned();
        let text = fs::read_to_string(&file).unwrap();
        let text = text.split("#[cfg(test)]").next().unwrap();
        let code: Vec<&str> = text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .collect();
        let named = names_after_crate(&code.join("\n"));
        let named = named.into_iter().filter(|to| *to != room);
        arrows.entry(room.clone()).or_default().extend(named);
    }
    arrows.remove("lib");
    let ours: BTreeSet<String> = arrows.keys().cloned().collect();
    for to in arrows.values_mut() {
        to.retain(|to| ours.contains(to));
    }
    arrows
}

/// The module in each `crate::module` of a text.
fn names_after_crate(code: &str) -> Vec<String> {
    let names = code.split("crate::").skip(1).map(|rest| {
        // Groups at the crate root are its own items, not modules.
        let group = rest.strip_prefix('{').map(str::trim_start);
        assert!(
            group.is_none_or(|items| items.starts_with(|c: char| c.is_ascii_uppercase())),
            "one import per module: {}",
            rest.lines().next().unwrap_or_default()
        );
        let of_name = |c: &char| c.is_ascii_alphanumeric() || *c == '_';
        rest.chars().take_while(of_name).collect()
    });
    names.collect()
}

#[test]
fn no_source_file_is_too_long_to_be_read_at_one_go() {
    let root = root().canonicalize().unwrap();
    let mut long = BTreeSet::new();
    for folder in ["firmware", "plant-sim", "protocol", "tests"] {
        for file in rust_files(&root.join(folder)) {
            if fs::read_to_string(&file).unwrap().lines().count() > LONGEST {
                long.insert(
                    file.strip_prefix(&root)
                        .unwrap()
                        .to_str()
                        .unwrap()
                        .to_owned(),
                );
            }
        }
    }
    assert!(long.is_empty(), "longer than {LONGEST} lines: {long:?}");
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}
