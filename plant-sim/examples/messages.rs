//! The messages of the link, for docs/protocol.md.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use protocol::messages::Node;
use protocol::schema::Rate;
use protocol::table::TABLE;

fn main() {
    println!("| id | message | from | to | when | bytes | format |");
    println!("|---|---|---|---|---|---|---|");
    let name = |node: Option<Node>, otherwise: &str| {
        node.map_or(otherwise.into(), |node| node.to_string())
    };
    for info in TABLE {
        let when = match info.rate {
            Rate::EverySample => "every sample".into(),
            Rate::Hertz(hertz) => format!("{hertz} Hz"),
            Rate::Event => "event".into(),
        };
        println!(
            "| 0x{:03X} | {} | {} | {} | {when} | {} | {} |",
            info.id,
            info.name,
            name(info.sender, "any"),
            name(info.receiver, "all"),
            info.len,
            if info.is_fd() { "FD" } else { "classical" }
        );
    }
}
