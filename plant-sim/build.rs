//! Version and commit for `--version` of `plant-sim` and of the controller on a host:
//! `0.1.0 (abc1234, 2026-11-28)`, with `modified` where the sources differ from the commit.

#![allow(clippy::expect_used, reason = "a build fails by panicking")]

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sources of the programs, from the root of the repository.
const SOURCES: [&str; 5] = [
    "protocol",
    "firmware",
    "plant-sim",
    "Cargo.toml",
    "Cargo.lock",
];

fn main() {
    let root = root();
    let version = env!("CARGO_PKG_VERSION");
    let commit = commit(&root).unwrap_or("unknown commit".into());
    // Twelve thousand addresses would be written at every start if the program could be loaded anywhere: 0.4 MiB.
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo:rustc-link-arg-bins=-no-pie");
    }
    println!("cargo:rustc-env=COMMIT={commit}");
    println!("cargo:rustc-env=VERSION_AND_COMMIT={version} ({commit})");
    let sources = SOURCES.map(|source| root.join(source));
    // HEAD changes with a checkout, its log with every commit.
    let heads = ["HEAD", "logs/HEAD"]
        .into_iter()
        .filter_map(|file| git(&root, &["rev-parse", "--git-path", file]))
        .map(|file| root.join(file));
    // Cargo treats a missing file as changed.
    for file in sources
        .into_iter()
        .chain(heads)
        .filter(|file| file.exists())
    {
        println!("cargo:rerun-if-changed={}", file.display());
    }
}

/// The folder of the workspace. As it is now: the script may have been compiled where the sources were before.
fn root() -> PathBuf {
    let package = env::var("CARGO_MANIFEST_DIR").expect("cargo runs this");
    let mut folders = Path::new(&package).ancestors();
    let root = folders.find(|folder| folder.join("Cargo.lock").exists());
    root.expect("a package of the workspace").into()
}

/// Commit and its date; none without git, or if the sources are not a repository or are inside another one.
fn commit(root: &Path) -> Option<String> {
    let top = git(root, &["rev-parse", "--show-toplevel"])?;
    if Path::new(&top).canonicalize().ok()? != root.canonicalize().ok()? {
        return None;
    }
    let commit = git(root, &["log", "-1", "--abbrev=7", "--format=%h, %cs"])?;
    let status = [
        "--no-optional-locks",
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
    ];
    let changes = git(root, &[&status[..], &SOURCES[..]].concat())?;
    let modified = if changes.is_empty() { "" } else { ", modified" };
    Some(commit + modified)
}

fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .arg("-C")
        .arg(root)
        .args(arguments)
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
