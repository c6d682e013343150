//! Fuzz targets: one function for each parser, which takes any bytes and panics where a promise is broken.
//!
//! A promise is more than the absence of panics: what is read is written and read again as the same, what is decoded encodes
//! to the same bytes, what is accepted runs. `tests/ci/23-fuzz.sh` has libFuzzer search for bytes that break one;
//! `cargo test -p fuzz` runs what is in `corpus`, seeds and found crashes alike, where Rust is all there is.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]
#![forbid(unsafe_code)]

mod arguments;
mod board;
mod dbc;
mod frame;
mod judges;
mod log;
mod node;
mod run;
mod slcan;

/// Takes any bytes; panics where a promise is broken.
pub type Target = fn(&[u8]);

/// Name and function of every target. The name is that of its folder in `corpus`.
pub const TARGETS: [(&str, Target); 14] = [
    ("arguments", arguments::arguments),
    ("asc", log::log),
    ("board", board::board),
    ("candump", log::log),
    ("dbc", dbc::dbc),
    ("frame", frame::frame),
    ("gains", run::gains),
    ("judges", judges::judges),
    ("model", run::model),
    ("node", node::node),
    ("payload", run::payload),
    ("pcapng", log::log),
    ("scenario", run::scenario),
    ("slcan", slcan::slcan),
];

/// Names of the targets, for a message.
#[must_use]
pub fn names() -> String {
    TARGETS.map(|(name, _)| name).join(", ")
}

/// Takes bytes from the front of an input as numbers; zeros where it has ended.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn fill(&mut self, bytes: &mut [u8]) {
        let count = bytes.len().min(self.0.len());
        let (taken, left) = self.0.split_at(count);
        bytes[..count].copy_from_slice(taken);
        self.0 = left;
    }

    fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.fill(&mut bytes);
        bytes
    }

    fn byte(&mut self) -> u8 {
        self.array::<1>()[0]
    }
}
