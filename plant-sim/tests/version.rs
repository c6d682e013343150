//! `--version` names the commit that the program was built from.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::process::Command;

fn text(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

#[test]
fn the_version_names_the_commit() {
    let mut program = Command::new(env!("CARGO_BIN_EXE_plant-sim"));
    let version = text(program.arg("--version")).unwrap();
    let version = version.trim_end_matches(')').trim_end_matches(", modified");
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let mut git = Command::new("git");
    git.args(["-C", root, "log", "-1", "--abbrev=7", "--format=%h, %cs"]);
    // Sources without a repository of their own have no commit, even inside another one.
    let commit = std::path::Path::new(root)
        .join(".git")
        .exists()
        .then(|| text(&mut git))
        .flatten()
        .unwrap_or("unknown commit".into());
    assert_eq!(
        version,
        format!("plant-sim {} ({commit}", env!("CARGO_PKG_VERSION"))
    );
}
