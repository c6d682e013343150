//! The table of bits has a row for every scenario and one for every law on the scenarios that compare laws;
//! tests/ci/35-bits.sh compares its hashes between machines.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::BTreeSet;
use std::path::Path;

use protocol::messages::{Compensation, Law};
use sim::scenario::{self, Scenario};
use sim::selection::LawChoice;

/// Scenarios that are run under every law.
const COMPARED: [&str; 5] = [
    "gate",
    "gate-mismatch",
    "gate-vertical",
    "square",
    "pick-place",
];

#[test]
fn every_scenario_and_every_law_has_a_row() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("bits.csv");
    let rows: BTreeSet<(String, String)> = csv::Reader::from_path(path)
        .unwrap()
        .records()
        .map(Result::unwrap)
        .map(|row| (row[0].into(), row[1].into()))
        .collect();
    let names = scenario::names();
    let mut expected: BTreeSet<(String, String)> = names
        .into_iter()
        .map(|name| {
            let law = Scenario::built_in(name).unwrap().law;
            (name.into(), law.to_string())
        })
        .collect();
    for scenario in COMPARED {
        for &law in Law::ALL {
            for &compensation in Compensation::ALL {
                // A law that takes no compensation is named without one.
                let choice = LawChoice { law, compensation };
                expected.insert((scenario.into(), choice.to_string()));
            }
        }
    }
    assert_eq!(
        rows, expected,
        "complete tests/bits.csv, then: tests/ci/35-bits.sh update"
    );
}
