//! The emulator and the image that it runs. The image is found by building it: an up-to-date build takes a moment, and a
//! stale image is never run.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::failure;
use sim::peer::PeerError;

const PACKAGE: &str = "mps2-an386";

/// The emulator.
pub(super) const EMULATOR: &str = "qemu-system-arm";

/// The image to run: the one that was named, or else `program` of the board's package, built from the sources.
///
/// # Errors
/// The emulator is missing, which is found out before anything is built, or the image cannot be built; each with what to do
/// about it.
pub fn image(named: Option<&Path>, program: &str) -> Result<PathBuf, PeerError> {
    find()?;
    named.map_or_else(|| build(program), |named| Ok(named.into()))
}

/// Looks for it instead of starting it, which would take as long as a cycle. One that does not work shows later.
fn find() -> Result<(), PeerError> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    if std::env::split_paths(&path).any(|folder| folder.join(EMULATOR).is_file()) {
        Ok(())
    } else {
        Err(no_emulator(&io::ErrorKind::NotFound.into()))
    }
}

/// That the emulator cannot be started.
pub(super) fn no_emulator(error: &io::Error) -> PeerError {
    failure(if error.kind() == io::ErrorKind::NotFound {
        format!("needs {EMULATOR}; install it: apt-get install qemu-system-arm")
    } else {
        format!("cannot be started: {EMULATOR}: {error}")
    })
}

fn build(program: &str) -> Result<PathBuf, PeerError> {
    let cargo = sources().map(|root| root.join("tests/board/cargo"));
    cargo
        .and_then(|cargo| compile(&cargo, PACKAGE, program))
        .map_err(|why| {
            failure(format!(
                "cannot be built: {why}; or give an image by --image FILE"
            ))
        })
}

/// Where this program was compiled.
///
/// # Errors
/// There is nothing any more.
pub(super) fn sources() -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if root.join("Cargo.toml").exists() {
        Ok(root)
    } else {
        Err(format!("the sources are no longer at {}", root.display()))
    }
}

/// Compiles a program of a package by `cargo`, or by a script that is like it. Returns its path.
///
/// # Errors
/// It does not compile; what the compiler says has been shown.
pub(super) fn compile(cargo: &Path, package: &str, program: &str) -> Result<PathBuf, String> {
    let output = Command::new(cargo)
        .args(["build", "--release", "--quiet", "--package", package])
        .args(["--bin", program])
        .arg("--message-format=json-render-diagnostics")
        .current_dir(sources()?)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{}: {error}", cargo.display()))?;
    if !output.status.success() {
        return Err(format!("see the output of {} above", cargo.display()));
    }
    executable(&output.stdout).ok_or_else(|| format!("cargo names no program {program}"))
}

/// The program among cargo's messages, one JSON object per line.
fn executable(messages: &[u8]) -> Option<PathBuf> {
    messages.split(|byte| *byte == b'\n').find_map(|line| {
        let message: serde_json::Value = serde_json::from_slice(line).ok()?;
        Some(PathBuf::from(message["executable"].as_str()?))
    })
}
