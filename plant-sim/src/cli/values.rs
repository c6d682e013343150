//! Values that several subcommands take.

use std::fs::File;
use std::io::{ErrorKind, Read as _};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::thread;

use sim::scenario::MAX_CYCLES;

/// Any number; what it may be is checked where it is used.
pub(super) fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "allowed: a number".into())
}

/// A number of cycles; how many there may be is checked with the scenario.
pub(super) fn cycles(text: &str) -> Result<i64, String> {
    text.parse()
        .map_err(|_| format!("allowed: a whole number from 1 to {MAX_CYCLES}"))
}

/// A seed; what it may be is checked with the scenario.
pub(super) fn seed(text: &str) -> Result<i64, String> {
    let most = i64::MAX;
    text.parse()
        .map_err(|_| format!("allowed: a whole number from 0 to {most}"))
}

/// How many of something there are to be.
pub(super) fn count(text: &str) -> Result<NonZero<u32>, String> {
    let most = u32::MAX;
    text.parse()
        .map_err(|_| format!("allowed: a whole number from 1 to {most}"))
}

/// Threads: as many as asked for, or as the machine has cores.
pub(super) fn jobs(asked: Option<NonZero<u32>>) -> NonZero<usize> {
    match asked {
        Some(jobs) => NonZero::try_from(jobs).unwrap_or(NonZero::<usize>::MAX),
        None => thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN),
    }
}

/// A file for an SVG: under another picture's name no program would show it.
pub(super) fn svg(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(other) if !other.eq_ignore_ascii_case("svg") => {
            Err("the plot is an SVG; allowed: a name that ends in .svg".into())
        }
        _ => Ok(path),
    }
}

/// The image of a controller.
pub(super) fn image(text: &str) -> Result<PathBuf, String> {
    /// Of an ELF file of 32 bits, little-endian, and where its machine is named.
    const BEGIN: &[u8] = b"\x7fELF\x01\x01";
    const MACHINE: std::ops::Range<usize> = 18..20;
    const ARM: [u8; 2] = [40, 0];
    const ALLOWED: &str = "allowed: the ELF file of the board's program";
    let path = Path::new(text);
    if !path.is_file() {
        return Err(format!("there is no such file; {ALLOWED}"));
    }
    let mut head = [0; 20];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut head));
    match read {
        Err(error) if error.kind() != ErrorKind::UnexpectedEof => Err(error.to_string()),
        Ok(()) if head.starts_with(BEGIN) && head[MACHINE] == ARM => Ok(path.into()),
        _ => Err(format!(
            "that is no program for an Arm processor; {ALLOWED}"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::image;

    #[test]
    fn an_image_is_a_program_for_an_arm_processor() {
        // A program of this machine, a text, nothing.
        let own = std::env::current_exe().unwrap();
        let text = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
        for other in [own.to_str().unwrap(), text, "/dev/null", "/nowhere"] {
            assert!(image(other).unwrap_err().contains("allowed"), "{other}");
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image");
        // The first bytes of an image, by `readelf -h`.
        let head = "7f454c4601010100000000000000000002002800";
        let bytes: Vec<u8> = (0..20)
            .map(|at| u8::from_str_radix(&head[2 * at..][..2], 16).unwrap())
            .collect();
        std::fs::write(&path, bytes).unwrap();
        assert!(image(path.to_str().unwrap()).is_ok());
    }
}
