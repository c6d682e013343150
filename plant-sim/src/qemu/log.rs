//! The board's log. It is read by a program of its own, `board-log`, which is compiled when the first board is emulated.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use super::image::{compile, sources};
use crate::say;

const READER: &str = "board-log";

/// The log of this image as text, a message a line.
///
/// # Errors
/// The reader cannot be compiled, or cannot read this.
pub(super) fn read(image: &Path, log: Vec<u8>) -> Result<String, String> {
    let reader = reader()?;
    let failed = |error: std::io::Error| format!("{}: {error}", reader.display());
    let mut child = Command::new(&reader)
        .arg(image)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let input = child.stdin.take();
    // From a thread: whoever writes all before it reads waits for ever once both pipes are full.
    let feed = thread::spawn(move || input.map_or(Ok(()), |mut input| input.write_all(&log)));
    let output = child.wait_with_output().map_err(failed)?;
    // A reader that ends early says why.
    let _ = feed.join();
    if output.status.success() {
        String::from_utf8(output.stdout).map_err(|error| error.to_string())
    } else {
        Err(String::from_utf8_lossy(&output.stderr).trim().to_owned())
    }
}

/// The reader: the one beside this program, or else from the sources.
fn reader() -> Result<PathBuf, String> {
    let here = std::env::current_exe().map_err(|error| error.to_string())?;
    let beside = here.with_file_name(READER);
    if beside.is_file() {
        return Ok(beside);
    }
    let root = sources()?;
    say!("plant-sim: compiling {READER}, which reads the board's log, once");
    compile(Path::new("cargo"), READER, READER).map_err(|why| {
        format!(
            "{why}; `cargo build --release --package {READER}` in {} compiles its reader",
            root.display()
        )
    })
}
