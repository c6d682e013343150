//! The benchmark as tables: Markdown, which a terminal shows as well, and CSV.

mod others;
mod rows;

use std::fmt::Write as _;

use super::{Figures, Group, Repeatability, Report, Row};
pub use rows::{csv, other_csv, repeatability_csv};

/// Everything, for people: what is over all places first.
pub fn text(report: &Report) -> String {
    let Report { robot, law, .. } = report;
    let groups = || report.groups.iter();
    let head = ["payload kg", "rate Hz"];
    let of_group = |group: &Group| vec![group.payload_kg.to_string(), group.rate_hz.to_string()];
    let mut text = format!(
        "{robot}, {law}.\n\nRound trips over the optimum, means over the places; errors, the worst of them.\n\n"
    );
    text += &table(
        &[&head[..], &TIMES].concat(),
        groups().map(|group| [of_group(group), times(&group.mean, &group.worst)].concat()),
    );
    text += "\nPeaks over their limits, the worst of the places; cycles without end, means.\n\n";
    text += &table(
        &[&head[..], &EFFORTS].concat(),
        groups().map(|group| [of_group(group), efforts(&group.mean, &group.worst)].concat()),
    );
    text += "\nAnother robot than the controller believes, the worst of the places.\n\n";
    text += &table(&MISMATCHED, report.mismatched_groups.iter().map(mismatched));
    if let Some(row) = report.mismatched.iter().find(|row| row.fault.is_some()) {
        let _ = writeln!(text, "\nThe first fault of these: {}.", row.ending());
    }
    text += &others::text(&report.others);
    text += &repeatability(&report.repeatability);
    let rows = || report.rows.iter();
    let head = ["place", "payload kg", "rate Hz"];
    let of_row = |row: &Row| {
        vec![
            row.place.clone(),
            row.payload_kg.to_string(),
            row.rate_hz.to_string(),
        ]
    };
    let optimum = |row: &Row| vec![format!("{:.3}", row.optimum_s)];
    text += "\nEvery gate: round trips over the optimum, and errors.\n\n";
    text += &table(
        &[&head[..], &["optimum s"], &TIMES].concat(),
        rows().map(|row| {
            let figures = times(&row.figures, &row.figures);
            [of_row(row), optimum(row), figures].concat()
        }),
    );
    text += "\nEvery gate: peaks over their limits, and cycles without end.\n\n";
    text += &table(
        &[&head[..], &EFFORTS].concat(),
        rows().map(|row| [of_row(row), efforts(&row.figures, &row.figures)].concat()),
    );
    text
}

/// Columns of [`times`].
const TIMES: [&str; 9] = [
    "planned",
    "to 1 mm",
    "to 0.1 mm",
    "to 0.01 mm",
    "tracking max mm",
    "rms mm",
    "settling ms",
    "overshoot mm",
    "margin mm",
];

/// Times are from `mean`, errors from `worst`.
fn times(mean: &Figures, worst: &Figures) -> Vec<String> {
    vec![
        number(mean.planned_ratio, 3),
        number(mean.to_1_mm_ratio, 3),
        number(mean.to_0_1_mm_ratio, 3),
        number(mean.to_0_01_mm_ratio, 3),
        number(worst.tracking_max_mm, 3),
        number(worst.tracking_rms_mm, 3),
        number(worst.settling_ms, 1),
        number(worst.overshoot_mm, 3),
        number(worst.gate_margin_mm, 3),
    ]
}

/// Columns of [`efforts`].
const EFFORTS: [&str; 7] = [
    "torque %",
    "torque rate %",
    "speed %",
    "RMS %",
    "for ever at %",
    "takes s",
    "or pause s",
];

/// Peaks are from `worst`, what is of whole cycles from `mean`.
fn efforts(mean: &Figures, worst: &Figures) -> Vec<String> {
    vec![
        percent(worst.torque_share),
        percent(worst.torque_rate_share),
        percent(worst.speed_share),
        percent(mean.rms_share),
        percent(mean.continuous_speed),
        number(mean.continuous_cycle_s, 3),
        number(mean.pause_s, 3),
    ]
}

/// Columns of [`mismatched`].
const MISMATCHED: [&str; 11] = [
    "payload kg",
    "rate Hz",
    "friction x",
    "payload x",
    "to 0.01 mm",
    "tracking max mm",
    "settling ms",
    "overshoot mm",
    "torque %",
    "at the limit ms",
    "faults",
];

fn mismatched(group: &Group) -> Vec<String> {
    let worst = &group.worst;
    vec![
        group.payload_kg.to_string(),
        group.rate_hz.to_string(),
        group.friction_factor.to_string(),
        group.payload_factor.to_string(),
        number(worst.to_0_01_mm_ratio, 3),
        number(worst.tracking_max_mm, 3),
        number(worst.settling_ms, 1),
        number(worst.overshoot_mm, 3),
        percent(worst.torque_share),
        number(worst.saturation_ms, 1),
        format!("{} of {}", group.faults, group.gates),
    ]
}

/// The pose that is attained again and again.
fn repeatability(rows: &[Repeatability]) -> String {
    let head = [
        "payload kg",
        "rate Hz",
        "cycles",
        "mean mm",
        "deviation mm",
        "RP mm",
        "AP mm",
    ];
    let cells = |row: &Repeatability| {
        vec![
            row.payload_kg.to_string(),
            row.rate_hz.to_string(),
            row.cycles.to_string(),
            number(row.mean_mm, 5),
            number(row.deviation_mm, 5),
            number(row.repeatability_mm, 5),
            number(row.accuracy_mm, 5),
        ]
    };
    let about = "\nRepeatability of a pose after ISO 9283, each encoder off by up to a step in every reading: distances from the \
                 barycentre, RP their mean and three deviations; AP is that of the barycentre from the pose.\n\n";
    about.to_owned() + &table(&head, rows.iter().map(cells))
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or("-".into(), |value| format!("{value:.decimals$}"))
}

fn percent(share: Option<f64>) -> String {
    number(share.map(|share| share * 100.0), 0)
}

/// A Markdown table whose columns are as wide as their widest cell.
fn table(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let rows: Vec<Vec<String>> = rows.collect();
    let widths: Vec<usize> = head
        .iter()
        .enumerate()
        .map(|(column, name)| {
            let cells = rows.iter().map(|row| row[column].len());
            cells.fold(name.len(), usize::max)
        })
        .collect();
    let line = |cells: &[&str]| {
        let cells = cells.iter().zip(&widths);
        let cells: Vec<String> = cells
            .map(|(cell, width)| format!("{cell:>width$}"))
            .collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rules: Vec<String> = widths
        .iter()
        .map(|width| "-".repeat(width - 1) + ":")
        .collect();
    let mut text = line(head) + &line(&rules.iter().map(String::as_str).collect::<Vec<_>>());
    for row in &rows {
        text += &line(&row.iter().map(String::as_str).collect::<Vec<_>>());
    }
    text
}
