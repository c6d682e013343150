//! `plant-sim bench motion`: its figures against those that are worked out here from `truth.csv` of ordinary runs, and its
//! properties.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Of the robot: lengths, m; limits, N m and N; continuous ratings; dry friction and its speeds (plant-sim/models).
const A: [f64; 2] = [0.56, 0.49];
const FLANGE: f64 = 0.1213;
const PEAK: [f64; 4] = [640.0, 400.0, 860.0, 30.0];
const RATED: [f64; 4] = [216.0, 127.0, 287.0, 10.2];
const SPEED: [f64; 4] = [
    7.679_448_708_775_05,
    12.217_304_763_960_307,
    2.2,
    29.670_597_283_903_604,
];
const COULOMB: [f64; 4] = [12.0, 6.0, 20.0, 0.6];
const EPS: [f64; 4] = [0.01, 0.01, 0.001, 0.01];
const RISE_TIME: f64 = 0.010;

/// Height of the ends, and of the gate above them.
const Z: f64 = -0.25;
const RISE: f64 = 0.025;

fn plant_sim(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn bench(folder: &Path, arguments: &[&str]) -> String {
    let output = plant_sim(folder, &[&["bench", "motion"], arguments].concat());
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The gate in the place `mid-tan`, as anyone would write it.
fn scenario(kg: f64, speed: f64, dwell: f64) -> String {
    let start = "[0.7, -0.15, -0.25, 0.0]";
    let jump = |to: &str| {
        format!(
            "[[cycle]]\njump = {{ to = {to}, top = -0.225, speed = {speed} }}\n[[cycle]]\ndwell = {dwell}\n"
        )
    };
    format!(
        "name = \"mid-tan\"\ncycles = 2\nrate_hz = 1000\nlaw = \"computed-torque:observer\"\nstart = {start}\n\
         [payload]\nmass = {kg}\ncom_flange_frame = [0.0, 0.0, 0.05]\n\
         inertia_com_diag = [{0}, {0}, {1}]\n{2}{3}",
        0.004 * kg,
        0.005 * kg,
        jump("[0.7, 0.15, -0.25, 0.0]"),
        jump(start)
    )
}

/// A row of `truth.csv`.
struct Truth {
    t: f64,
    q: [f64; 4],
    qd: [f64; 4],
    reference: [f64; 4],
    moves: bool,
    tau: [f64; 4],
    tool: [f64; 4],
}

/// What an ordinary run of `scenario` leaves.
fn truth(folder: &Path, scenario: &str) -> Vec<Truth> {
    fs::write(folder.join("gate.toml"), scenario).unwrap();
    let run = ["run", "--scenario", "gate.toml", "--no-report", "-q"];
    let output = plant_sim(folder, &run);
    assert!(output.status.success(), "{output:?}");
    let mut reader = csv::Reader::from_path(folder.join("out/truth.csv")).unwrap();
    let rows = reader.records().map(|row| {
        let row = row.unwrap();
        let four = |from: usize| std::array::from_fn(|axis| row[from + axis].parse().unwrap());
        let rqd: [f64; 4] = four(13);
        Truth {
            t: row[0].parse().unwrap(),
            q: four(1),
            qd: four(5),
            reference: four(9),
            moves: rqd != [0.0; 4],
            tau: four(17),
            tool: four(21),
        }
    });
    rows.collect()
}

/// The tool by the cosines of a drawing.
fn tool([q1, q2, q3, q4]: &[f64; 4]) -> [f64; 4] {
    let (upper, fore) = (*q1, q1 + q2);
    [
        A[0] * upper.cos() + A[1] * fore.cos(),
        A[0] * upper.sin() + A[1] * fore.sin(),
        -q3 - FLANGE,
        fore - q4,
    ]
}

fn distance(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

fn across(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Indices of the motions: the first sample at which the reference moves, and the first at which it rests again.
fn motions(rows: &[Truth]) -> Vec<(usize, usize)> {
    let mut motions = Vec::new();
    let mut from = None;
    for (index, row) in rows.iter().enumerate() {
        match (row.moves, from) {
            (true, None) => from = Some(index),
            (false, Some(begun)) => {
                motions.push((begun, index));
                from = None;
            }
            _ => {}
        }
    }
    motions
}

#[track_caller]
fn same(name: &str, row: &Value, expected: f64) {
    let found = row[name].as_f64().unwrap();
    // Both add up the same numbers, in another order.
    let rounding = 1e-9 * expected.abs().max(1e-3);
    assert!(
        (found - expected).abs() <= rounding,
        "{name}: {found} instead of {expected}"
    );
}

/// Everything of a row, from the columns of `truth.csv` and the numbers of the robot.
#[test]
fn a_row_is_what_the_truth_of_an_ordinary_run_says() {
    let folder = tempfile::tempdir().unwrap();
    let report: Value =
        serde_json::from_str(&bench(folder.path(), &["--quick", "--json"])).unwrap();
    let row = &report["rows"][0];
    assert_eq!(
        (&row["place"], &row["payload_kg"]),
        (&"mid-tan".into(), &2.0.into())
    );
    let rows = truth(folder.path(), &scenario(2.0, 1.0, 0.25));
    for row in &rows {
        assert!(distance(&tool(&row.q), &row.tool) < 1e-12);
    }
    let motions = motions(&rows);
    assert_eq!(motions.len(), 4);

    let ends = [[0.7, -0.15, Z, 0.0], [0.7, 0.15, Z, 0.0]];
    let (mut planned, mut arrived, mut settling) = (0.0, [0.0; 3], 0.0_f64);
    let (mut overshoot, mut margin) = (0.0_f64, f64::INFINITY);
    let (mut worst, mut squares, mut samples) = (0.0_f64, 0.0, 0.0);
    for (way, &(begun, ended)) in motions.iter().enumerate() {
        let (from, to) = (&ends[way % 2], &ends[1 - way % 2]);
        let start = rows[begun - 1].t;
        planned += rows[ended].t - start;
        // The rest lasts 250 ms at least; after the last one, torque goes off.
        let rest = &rows[begun..=ended + 250];
        for (sum, radius) in arrived.iter_mut().zip([1e-3, 1e-4, 1e-5]) {
            let out = |row: &&Truth| {
                distance(&row.tool, to) > radius || (row.tool[3] - to[3]).abs() > 10.0 * radius
            };
            let last = rest.iter().rposition(|row| out(&row)).unwrap();
            let since = rest[last + 1].t;
            *sum += since - start;
            if radius == 1e-5 {
                settling = settling.max(since - rows[ended].t);
            }
        }
        for row in &rows[begun..ended] {
            let error = distance(&tool(&row.reference), &row.tool);
            worst = worst.max(error);
            squares += error * error;
            samples += 1.0;
            let away = across(&row.tool, from).min(across(&row.tool, to));
            margin = margin.min(row.tool[2] - Z - away.min(RISE));
        }
        for row in rest {
            if across(&row.tool, to) < across(&row.tool, from) {
                let past = across(&row.tool, from) - 0.3;
                overshoot = overshoot.max(past).max(Z - row.tool[2]);
            }
        }
    }
    let (planned, arrived) = (planned / 2.0, arrived.map(|sum| sum / 2.0));
    same("planned_s", row, planned);
    same("to_1_mm_s", row, arrived[0]);
    same("to_0_1_mm_s", row, arrived[1]);
    same("to_0_01_mm_s", row, arrived[2]);
    same("planned_ratio", row, planned / 0.328);
    same("to_0_1_mm_ratio", row, arrived[1] / 0.328);
    same("settling_ms", row, settling * 1e3);
    same("tracking_max_mm", row, worst * 1e3);
    same("tracking_rms_mm", row, (squares / samples).sqrt() * 1e3);
    same("overshoot_mm", row, overshoot * 1e3);
    same("gate_margin_mm", row, margin * 1e3);

    // Efforts. In the cycles the arm is under torque, from a sample before the first motion to the end of the last rest.
    let cycles = &rows[motions[0].0 - 1..=motions[3].1 + 250];
    let share = |values: fn(&Truth) -> &[f64; 4], limits: &[f64; 4]| {
        let shares = cycles.iter().flat_map(|row| {
            let shares = values(row).iter().zip(limits);
            shares
                .map(|(value, limit)| value.abs() / limit)
                .collect::<Vec<_>>()
        });
        shares.fold(0.0, f64::max)
    };
    same("torque_share", row, share(|row| &row.tau, &PEAK));
    same("speed_share", row, share(|row| &row.qd, &SPEED));
    let smooth = |row: &Truth, axis: usize| {
        row.tau[axis] - COULOMB[axis] * (row.qd[axis] / EPS[axis]).tanh()
    };
    let rates = (0..4).flat_map(|axis| {
        cycles.windows(2).map(move |pair| {
            let change = smooth(&pair[1], axis) - smooth(&pair[0], axis);
            change.abs() / (PEAK[axis] * 0.001 / RISE_TIME)
        })
    });
    same("torque_rate_share", row, rates.fold(0.0, f64::max));
    let rms = rms(&rows, &motions);
    same("rms_share", row, rms);
    assert_eq!(row["saturation_ms"], 0.0);
    assert_eq!(row["fault"], Value::Null);
}

/// Root mean square over the continuous rating while the reference moves, of the worst axis.
fn rms(rows: &[Truth], motions: &[(usize, usize)]) -> f64 {
    let moving = || {
        motions
            .iter()
            .flat_map(|&(begun, ended)| &rows[begun..=ended])
    };
    let shares = (0..4).map(|axis| {
        let sum: f64 = moving().map(|row| row.tau[axis].powi(2)).sum();
        (sum / moving().count() as f64).sqrt() / RATED[axis]
    });
    shares.fold(0.0, f64::max)
}

/// At the speed that is said to do for ever, a run that is asked for that speed is at its rating, and takes as long as is said.
#[test]
fn a_run_at_the_speed_for_ever_is_at_its_rating() {
    let folder = tempfile::tempdir().unwrap();
    let report: Value =
        serde_json::from_str(&bench(folder.path(), &["--quick", "--json"])).unwrap();
    for (index, kg) in [2.0, 22.0].into_iter().enumerate() {
        let row = &report["rows"][index];
        let speed = row["continuous_speed"].as_f64().unwrap();
        let rows = truth(folder.path(), &scenario(kg, speed, 0.25));
        let motions = motions(&rows);
        let rms = rms(&rows, &motions);
        let cycle: f64 = motions
            .iter()
            .map(|&(begun, ended)| rows[ended].t - rows[begun - 1].t)
            .sum();
        println!(
            "{kg} kg: {speed} {rms} {} {}",
            cycle / 2.0,
            row["continuous_cycle_s"]
        );
    }
    panic!();
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let of = |jobs: &str| {
        let files = ["--csv", "rows.csv", "--svg", "rows.svg"];
        let json = bench(
            folder.path(),
            &[&["--quick", "--json", "--jobs", jobs], &files[..]].concat(),
        );
        let file = |name| fs::read_to_string(folder.path().join(name)).unwrap();
        [json, file("rows.csv"), file("rows.svg")]
    };
    let one = of("1");
    assert_eq!(of("3"), one);
    // The header, two gates, and each with two frictions and two payloads.
    assert_eq!(one[1].lines().count(), 1 + 2 + 2 * 4);
    let text = bench(folder.path(), &["--quick"]);
    assert!(
        text.contains("mid-tan with 22 kg at 1000 Hz, friction x 0.7, payload x 1.2: "),
        "{text}"
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, why) in [
        (&["--jobs", "0"][..], "allowed: a whole number from 1"),
        (&["--svg", "rows.png"], "allowed: a name that ends in .svg"),
        (
            &["--csv", "rows.svg", "--svg", "rows.svg"],
            "another output of this command",
        ),
        (&["--csv", "."], "it is a folder; name another file"),
        (
            &["--controller", "board"],
            "[possible values: in-process, qemu]",
        ),
        (&["--law", "pid"], "unexpected argument '--law'"),
    ] {
        let output = plant_sim(folder.path(), &[&["bench", "motion"], arguments].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(why), "{arguments:?}: {said}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
