//! The columns of truth.csv, as docs/truth.md shows them.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use sim::record::TRUTH_COLUMNS;

fn main() {
    println!("| column | unit | what it is |");
    println!("|---|---|---|");
    for (name, unit, about) in TRUTH_COLUMNS {
        println!("| `{name}` | {unit} | {about} |");
    }
}
