//! The exit codes of docs/exit-codes.md, as a shell sees them. What the guard makes of a panic is tested with `plant-sim`.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs::{self, File};
use std::process::{Command, Output, Stdio};

fn controller(arguments: &[&str], stderr: Stdio) -> Output {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("empty.json"), "").unwrap();
    fs::write(
        folder.path().join("model.json"),
        include_str!("../../../../plant-sim/models/irb930-22-1.05.json"),
    )
    .unwrap();
    Command::new(env!("CARGO_BIN_EXE_controller"))
        .args(arguments)
        .current_dir(folder.path())
        .stderr(stderr)
        .output()
        .unwrap()
}

/// The exit code, with one message for every code but 0 and no sign of a panic.
fn code(arguments: &[&str]) -> i32 {
    let output = controller(arguments, Stdio::piped());
    let said = String::from_utf8(output.stderr).unwrap();
    let code = output.status.code().unwrap();
    assert_eq!(said.is_empty(), code == 0, "{arguments:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    code
}

const WRONG: [&[&str]; 9] = [
    &[],
    &["--bus", "vcan0"],
    &["--bus", "can:vcan0"],
    &["--buss", "socketcan:vcan0"],
    &["--bus", "slcan:/nowhere", "--rate", "99"],
    &["--bus", "slcan:/nowhere", "--rate", "fast"],
    &["--bus", "slcan:/nowhere", "--model", "nowhere.json"],
    &["--bus", "slcan:/nowhere", "--model", "empty.json"],
    // A robot of the simulator: `plant-sim model` makes one for the controller of it.
    &["--bus", "slcan:/nowhere", "--model", "model.json"],
];

#[test]
fn done_is_0_failed_is_1_and_wrong_usage_is_2() {
    assert_eq!(code(&["--help"]), 0);
    assert_eq!(code(&["--version"]), 0);
    assert_eq!(code(&["--bus", "slcan:/nowhere"]), 1);
    assert_eq!(code(&["--bus", "socketcan:nowhere0"]), 1);
    for wrong in WRONG {
        assert_eq!(code(wrong), 2, "{wrong:?}");
    }
}

#[test]
fn a_standard_error_that_is_full_changes_no_code() {
    let full = || Stdio::from(File::create("/dev/full").unwrap());
    let code = |arguments| controller(arguments, full()).status.code();
    assert_eq!(code(&["--bus", "slcan:/nowhere"]), Some(1));
    assert_eq!(
        code(&["--bus", "slcan:/nowhere", "--model", "nowhere.json"]),
        Some(2)
    );
}
