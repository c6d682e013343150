//! Prints the kinds of faults as a Markdown table, for docs/faults.md.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use sim::faults::{KINDS, Kind, Value};

fn main() {
    println!("| fault | value | effect |");
    println!("|---|---|---|");
    for Kind {
        place,
        has_axis,
        name,
        value,
        second,
        about,
    } in KINDS
    {
        let place = match place {
            "message" => "MESSAGE",
            "node" => "NODE",
            place => place,
        };
        let axis = if has_axis { ":AXIS" } else { "" };
        let value = value.into_iter().chain(second).map(text);
        let value = value.collect::<Vec<_>>().join(" / ");
        println!("| `{place}{axis}:{name}` | {value} | {about} |");
    }
}

fn text(value: Value) -> String {
    let Value {
        least,
        greatest,
        unit,
        default,
        whole,
    } = value;
    let kind = if whole { "a whole number from " } else { "" };
    let otherwise = default.map_or_else(String::new, |default| format!("; {default} if left out"));
    format!("{kind}{least} to {greatest} {unit}{otherwise}")
}
