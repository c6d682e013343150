//! The table of docs/scenarios.md: scenarios that come with the program, and what each requires.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use sim::scenario::{Scenario, names};

fn main() {
    println!("| name | what it is for | requirements |\n|---|---|---|");
    for name in names() {
        let scenario = Scenario::built_in(name).expect("it comes with the program");
        let about = scenario.about.unwrap_or_default();
        let all = scenario.requirements.iter();
        let ids: Vec<&str> = all.map(|requirement| &*requirement.id).collect();
        println!("| `{name}` | {about} | {} |", ids.join(", "));
    }
}
