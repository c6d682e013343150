//! Worst-case load of the bus by control rate, for docs/protocol.md.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use protocol::wire::BitTiming;
use sim::bus::{MAX_LOAD, Overload};
use sim::rig;

fn main() {
    println!("| rate Hz | worst-case load % | |");
    println!("|---|---|---|");
    for rate in [1000, 2000, 3000, 4000] {
        let (load, verdict) = match rig::admit(&BitTiming::default(), f64::from(rate)) {
            Ok(load) => (load, "accepted"),
            Err(Overload { load }) => (load, "refused"),
        };
        assert_eq!(load > MAX_LOAD, verdict == "refused");
        println!("| {rate} | {:.1} | {verdict} |", load * 100.0);
    }
}
