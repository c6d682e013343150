//! The columns of truth.csv, as docs/truth.md shows them.

use sim::record::TRUTH_COLUMNS;

fn main() {
    println!("| column | unit | what it is |");
    println!("|---|---|---|");
    for (name, unit, about) in TRUTH_COLUMNS {
        println!("| `{name}` | {unit} | {about} |");
    }
}
