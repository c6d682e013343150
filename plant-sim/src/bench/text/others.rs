//! Gates at random, as tables.

use std::fmt::Write as _;

use super::super::others::{Other, Others, Saving};
use super::{number, percent, table};

/// What they come to, and each that is not as it should be.
pub(super) fn text(others: &Others) -> String {
    let Others { seed, gates, .. } = others;
    let mut text = format!(
        "\n{gates} gates anywhere (seed {seed}): strokes of 50 to 600 mm, turns of the tool up to 350 degrees, unequal heights, either \
         elbow, 0 to 22 kg, 1 and 2 kHz. Round trips to 0.01 mm, beside those of a controller that limits acceleration and jerk.\n\n"
    );
    let tenths = |share: Option<f64>| number(share.map(|share| share * 100.0), 1);
    let saving = |beside: &str, saving: &Saving| {
        vec![
            beside.into(),
            tenths(saving.median),
            tenths(saving.least),
            saving.slower.to_string(),
        ]
    };
    text += &table(
        &["beside", "median saved %", "least %", "slower"],
        [
            saving("caps, 5 mm vertical ends", &others.before),
            saving("caps alone", &others.capped),
        ]
        .into_iter(),
    );
    let _ = writeln!(
        text,
        "\nNot completed: {}. A limit passed: {}. Below the chamfer: {}.",
        others.faults, others.outside, others.missed
    );
    let is_bad = |row: &&Other| {
        row.fault.is_some()
            || row.is_outside()
            || row.has_missed()
            || row.is_slower(row.before)
            || row.is_slower(row.capped)
    };
    let bad: Vec<&Other> = others.rows.iter().filter(is_bad).collect();
    if !bad.is_empty() {
        text += "\nThose that are slower, outside or not completed.\n\n";
        text += &table(&HEAD, bad.into_iter().map(cells));
    }
    text
}

/// Columns of [`cells`].
const HEAD: [&str; 12] = [
    "number",
    "payload kg",
    "rate Hz",
    "stroke mm",
    "turn deg",
    "before s",
    "caps s",
    "now s",
    "torque %",
    "torque rate %",
    "speed %",
    "margin mm",
];

fn cells(row: &Other) -> Vec<String> {
    vec![
        row.number.to_string(),
        row.payload_kg.to_string(),
        row.rate_hz.to_string(),
        format!("{:.0}", row.stroke_m * 1e3),
        format!("{:.0}", row.turn_deg),
        number(row.before.to_0_01_mm_s, 4),
        number(row.capped.to_0_01_mm_s, 4),
        number(row.now.to_0_01_mm_s, 4),
        percent(Some(row.peaks.torque)),
        percent(Some(row.peaks.torque_rate)),
        percent(Some(row.peaks.speed)),
        number(row.gate_margin_mm, 3),
    ]
}
