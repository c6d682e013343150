//! The table of bits has a row for everything that can be run; tests/ci/35-bits.sh compares its hashes between
//! machines.

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
use sim::scenario;
use sim::selection::LawChoice;

#[test]
fn every_scenario_has_a_row_for_every_law() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("bits.csv");
    let rows: BTreeSet<(String, String)> = csv::Reader::from_path(path)
        .unwrap()
        .records()
        .map(Result::unwrap)
        .map(|row| (row[0].into(), row[1].into()))
        .collect();
    let mut expected = BTreeSet::new();
    for scenario in scenario::names().split(", ") {
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
