//! Prints the kinds of faults as a Markdown table, for docs/faults.md.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use sim::faults::{KINDS, Kind};

fn main() {
    println!("| fault | value | effect |");
    println!("|---|---|---|");
    for Kind {
        place,
        has_axis,
        name,
        value,
        about,
    } in KINDS
    {
        let place = match place {
            "message" => "MESSAGE",
            "node" => "NODE",
            place => place,
        };
        let axis = if has_axis { ":AXIS" } else { "" };
        let value = value.map_or_else(String::new, |value| {
            let otherwise = value
                .default
                .map_or_else(String::new, |default| format!("; {default} if left out"));
            format!(
                "{} to {} {}{otherwise}",
                value.least, value.greatest, value.unit
            )
        });
        println!("| `{place}{axis}:{name}` | {value} | {about} |");
    }
}
