//! The reference tables piped through `eval`, whole, and compared column by column.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use plant_sim::eval::{By, Posture, Table, eval};
use sim::model::{Payload, RobotModel};
use tests::reference;

/// Header and rows of a CSV text.
type Cells = (Vec<String>, Vec<Vec<String>>);

fn cells(text: &[u8]) -> Cells {
    let mut reader = csv::Reader::from_reader(text);
    let owned = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
    let header = owned(reader.headers().unwrap());
    (
        header,
        reader
            .records()
            .map(|record| owned(&record.unwrap()))
            .collect(),
    )
}

/// The rows of a reference table for which `keep` holds.
fn table(file: &str, keep: impl Fn(&str) -> bool) -> Vec<u8> {
    let text = std::fs::read_to_string(reference(file)).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_owned();
    let rows = lines.filter(|line| keep(line)).map(str::to_owned);
    std::iter::once(header)
        .chain(rows)
        .map(|line| line + "\n")
        .collect::<String>()
        .into_bytes()
}

fn payload(key: &str) -> Payload {
    let text = std::fs::read_to_string(reference("model.json")).unwrap();
    let document: serde_json::Value = serde_json::from_str(&text).unwrap();
    Payload::from_json(&document[key].to_string()).unwrap()
}

/// Input columns of a table.
fn inputs(what: Table) -> Vec<String> {
    if what == Table::Ik {
        return ["x", "y", "z", "yaw"].map(str::to_owned).into();
    }
    ["q", "qd", "qdd"]
        .iter()
        .flat_map(|name| (1..=4).map(move |i| format!("{name}{i}")))
        .collect()
}

/// Pipes a table through and compares every result column with the table's own.
///
/// The plant has to agree within 1e-9. For the controller this test only requires that no column, sign or label is
/// mixed up, so a thousandth of the largest magnitude in the column will do: its precision is bounded elsewhere.
fn agrees(what: Table, by: By, input: &[u8], payload: Option<&Payload>) {
    let mut output = Vec::new();
    eval(
        what,
        Posture::default(),
        by,
        &RobotModel::irb_930_22_105(),
        payload,
        input,
        &mut output,
    )
    .unwrap();
    let ((wanted_header, wanted), (header, found)) = (cells(input), cells(&output));
    assert_eq!(found.len(), wanted.len());
    assert!(!wanted.is_empty());
    // The output is everything in the table besides its inputs.
    let mut expected: Vec<&String> = wanted_header
        .iter()
        .filter(|name| !inputs(what).contains(name))
        .collect();
    let mut got: Vec<&String> = header.iter().collect();
    expected.sort();
    got.sort();
    assert_eq!(got, expected);

    for (column, name) in header.iter().enumerate() {
        let source = wanted_header.iter().position(|c| c == name).unwrap();
        let number = |row: &[String], i: usize| row[i].parse::<f64>();
        let largest = wanted
            .iter()
            .filter_map(|row| number(row, source).ok())
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        for (line, (row, wanted_row)) in found.iter().zip(&wanted).enumerate() {
            let place = format!("{what:?} by {by:?}, row {line}, {name}");
            let (text, wanted_text) = (&row[column], &wanted_row[source]);
            if name == "reason" && wanted_row[1] == "near_singular" {
                assert_eq!(text, "ok", "{place}");
            } else if name != "id"
                && let Ok(wanted) = wanted_text.parse::<f64>()
            {
                let number: f64 = text.parse().unwrap_or_else(|_| panic!("{place}: {text:?}"));
                let conditioned = what == Table::Ik && (name.contains("_q") || name == "detJ_a");
                let slack = if conditioned {
                    row.last().unwrap().parse::<f64>().unwrap()
                } else {
                    0.0
                };
                let bound = slack.max(if by == By::Plant {
                    1e-9
                } else {
                    1e-3 * (1.0 + largest)
                });
                let same = (number - wanted).abs() <= bound || (number.is_nan() && wanted.is_nan());
                assert!(same, "{place}: {number} instead of {wanted}");
            } else {
                assert_eq!(text, wanted_text, "{place}");
            }
        }
    }
}

const ALL: [By; 3] = [By::Plant, By::Lagrange, By::NewtonEuler];

#[test]
fn kinematics() {
    for by in ALL {
        agrees(
            Table::Kinematics,
            by,
            &table("kinematics.csv", |_| true),
            None,
        );
    }
}

#[test]
fn inverse_kinematics() {
    agrees(Table::Ik, By::Plant, &table("ik.csv", |_| true), None);
    // The precision of f32 in the last micrometre before the stretched arm is not a question of columns.
    agrees(
        Table::Ik,
        By::Lagrange,
        &table("ik.csv", |line| !line.contains("near_singular")),
        None,
    );
}

#[test]
fn dynamics() {
    let of = |label: &'static str| move |line: &str| line.split(',').nth(1) == Some(label);
    for by in ALL {
        agrees(
            Table::Dynamics,
            by,
            &table("dynamics.csv", of("none")),
            None,
        );
        agrees(
            Table::Dynamics,
            by,
            &table("dynamics.csv", of("p10")),
            Some(&payload("payload_test_10kg")),
        );
        let eccentric = payload("payload_test_ecc5kg");
        agrees(
            Table::Dynamics,
            by,
            &table("dynamics_eccentric.csv", of("ecc5")),
            Some(&eccentric),
        );
    }
}

#[test]
fn actuation() {
    for by in ALL {
        agrees(
            Table::Actuation,
            by,
            &table("actuation.csv", |_| true),
            None,
        );
    }
}
