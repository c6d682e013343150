//! The listing in the docs matches the table; the bus is tested in `tests/ci/14-parameters.sh`.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use plant_sim::parameters::{Assignment, Reading, json, markdown, table};
use protocol::parameters;

#[test]
fn the_document_is_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/parameters.md");
    let kept = std::fs::read_to_string(path).unwrap();
    assert!(
        kept == markdown(),
        "docs/parameters.md differs from the table; regenerate it with: \
         cargo run -- parameters --markdown >docs/parameters.md"
    );
}

#[test]
fn an_assignment_says_what_is_allowed() {
    let refusal = |text: &str| text.parse::<Assignment>().unwrap_err();
    assert_eq!(
        refusal("bandwidth"),
        "allowed: NAME=VALUE, such as bandwidth=120"
    );
    let names = refusal("bandwith=1");
    assert!(names.starts_with("\"bandwith\" is not a parameter; allowed: bandwidth, damping, "));
    assert!(!names.contains("sampling-period"), "a reading: {names}");
    assert_eq!(
        refusal("brake-delay=60ms"),
        "\"60ms\" is not a value of brake-delay; allowed: a number in s"
    );
    assert_eq!(
        refusal("damping=inf"),
        "\"inf\" is not a value of damping; allowed: a number"
    );
    let assignment: Assignment = "hold-samples=7".parse().unwrap();
    assert_eq!(
        (assignment.parameter.name, assignment.value),
        ("hold-samples", 7.0)
    );
}

#[test]
fn a_reading_is_shown_with_all_that_is_known_of_it() {
    let known = |number| Reading {
        number,
        parameter: parameters::numbered(number),
        value: 120.0,
        lower: 1.0,
        upper: 250.0,
    };
    let readings = [known(0x0010), known(0x0FFE)];
    assert!(readings[0].parameter.is_some() && readings[1].parameter.is_none());
    let text = table(&readings, 1e-3);
    let lines: Vec<Vec<&str>> = text
        .lines()
        .map(|line| line.split_whitespace().collect())
        .collect();
    assert_eq!(
        lines[1],
        [
            "bandwidth",
            "120",
            "rad/s",
            "1",
            "to",
            "250",
            "170",
            "at",
            "rest"
        ]
    );
    assert_eq!(lines[2][..2], ["0x0ffe", "120"]);
    let rows: serde_json::Value = serde_json::from_str(&json(&readings, 1e-3)).unwrap();
    assert_eq!(rows[0]["name"], "bandwidth");
    assert_eq!(rows[0]["default"], 170.0);
    assert_eq!(rows[0]["settable"], "at rest");
    assert_eq!(rows[1]["settable"], serde_json::Value::Null);
}
