//! Codes of the protocol that no node raises yet. The lists only ever get shorter.
//!
//! A code counts as raised when the source of the node names it. Whether it is raised when it should be is for other
//! tests; this one makes sure that the docs of a code do not promise more than exists.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::path::Path;

use protocol::messages::{Cause, ParameterError, RefusalReason};

const LIMIT_FLAGS: [&str; 9] = [
    "VELOCITY_SHOULDER",
    "VELOCITY_ELBOW",
    "VELOCITY_LIFT",
    "VELOCITY_WRIST",
    "POSITION_SHOULDER",
    "POSITION_ELBOW",
    "POSITION_LIFT",
    "POSITION_WRIST",
    "DAMPED",
];
const PARAMETER_ERRORS: [ParameterError; 0] = [];
const REFUSALS: [RefusalReason; 0] = [];

const MARK: &str = "Reserved: not raised yet.";

/// Every line of code below `folder`, or of a file, without comments.
fn code(folder: &Path, text: &mut String) {
    if folder.is_file() {
        return lines(folder, text);
    }
    for entry in fs::read_dir(folder).expect("the sources can be read") {
        let path = entry.expect("the sources can be read").path();
        if path.is_dir() {
            code(&path, text);
        } else if path.extension().is_some_and(|end| end == "rs") {
            lines(&path, text);
        }
    }
}

fn lines(file: &Path, text: &mut String) {
    let source = fs::read_to_string(file).expect("the sources can be read");
    for line in source.lines().filter(|line| !line.trim().starts_with("//")) {
        *text += line;
        *text += "\n";
    }
}

fn node() -> String {
    let mut text = String::new();
    // The answers to parameter requests are the protocol's.
    for part in [
        "src",
        "../protocol/src/parameters.rs",
        "../protocol/src/parameters",
    ] {
        code(&Path::new(env!("CARGO_MANIFEST_DIR")).join(part), &mut text);
    }
    text
}

/// Whether `code` names `path`, and not only something that begins like it.
fn names(code: &str, path: &str) -> bool {
    code.match_indices(path).any(|(at, _)| {
        let next = code[at + path.len()..].chars().next();
        !next.is_some_and(|c| c.is_alphanumeric() || c == '_')
    })
}

/// Exactly the reserved codes are not raised, and their docs say so.
fn check<T: Copy + std::fmt::Debug + PartialEq>(
    kind: &str,
    all: &[T],
    reserved: &[T],
    describe: impl Fn(T) -> &'static str,
) {
    let code = node();
    for item in all {
        let path = format!("{kind}::{item:?}");
        let is_reserved = reserved.contains(item);
        assert_ne!(
            names(&code, &path),
            is_reserved,
            "{path}: a code that is raised leaves the list here, and no code enters it"
        );
        assert_eq!(
            describe(*item).contains(MARK),
            is_reserved,
            "{path}: its doc comment says '{MARK}' for as long as that is true"
        );
    }
}

#[test]
fn causes() {
    check("Cause", Cause::ALL, &[], Cause::describe);
}

#[test]
fn reasons_of_refusals() {
    check(
        "RefusalReason",
        RefusalReason::ALL,
        &REFUSALS,
        RefusalReason::describe,
    );
}

#[test]
fn errors_of_parameters() {
    check(
        "ParameterError",
        ParameterError::ALL,
        &PARAMETER_ERRORS,
        ParameterError::describe,
    );
}

#[test]
fn limit_flags() {
    let code = node();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../protocol/src/messages/cyclic.rs");
    let source = fs::read_to_string(path).expect("the sources can be read");
    let flags = source
        .split_once("pub struct LimitFlags")
        .expect("the flags are declared there")
        .1;
    let mut doc = "";
    let mut seen = 0;
    for line in flags.lines().map(str::trim) {
        if line.starts_with("///") {
            doc = line;
        } else if let Some((flag, _)) = line.split_once(" = ") {
            let reserved = LIMIT_FLAGS.contains(&flag);
            let path = format!("LimitFlags::{flag}");
            assert_ne!(names(&code, &path), reserved, "{path}");
            assert_eq!(doc.contains(MARK), reserved, "{path}: {doc}");
            seen += 1;
        }
    }
    assert_eq!(seen, protocol::messages::LimitFlags::NAMES.len());
}

/// Messages that the table has for nodes of the bench, which do not send them yet.
#[test]
fn messages_of_drives_and_operator() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = fs::read_to_string(manifest.join("../protocol/src/table.rs"))
        .expect("the sources can be read");
    for node in ["drives", "operator"] {
        let mut text = String::new();
        let folder = manifest.join("../plant-sim/core/src").join(node);
        code(&folder.with_extension("rs"), &mut text);
        code(&folder, &mut text);
        for (kind, sent) in [
            ("Heartbeat", text.contains("Heartbeat {")),
            ("Emergency", text.contains("encode(&Message::Emergency")),
        ] {
            let reserved = format!("/// {kind} of the {node}. Reserved: not sent yet.");
            assert_ne!(table.contains(&reserved), sent, "{kind} of the {node}");
        }
    }
}
