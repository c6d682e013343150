//! `plant-sim bench motion`: its figures against those that are worked out here from `truth.csv` of ordinary runs, and its
//! properties.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod others;
mod truth;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use ::plant_sim::bench::gate::gates;
use serde_json::Value;
use truth::{
    COULOMB, EPS, PEAK, RISE, RISE_TIME, SPEED, Truth, Z, across, distance, motions, rms, scenario,
    tool, truth,
};

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
    let rows = truth(folder.path(), &scenario(2.0, 1.0, 0.25), None);
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

/// At the speed that is said to do for ever, a run that is asked for that speed is at its rating, and takes as long as is said.
#[test]
fn a_run_at_the_speed_for_ever_is_at_its_rating() {
    let folder = tempfile::tempdir().unwrap();
    let report: Value =
        serde_json::from_str(&bench(folder.path(), &["--quick", "--json"])).unwrap();
    for (row, kg) in [2.0, 22.0].into_iter().enumerate() {
        let row = &report["rows"][row];
        let figure = |name: &str| row[name].as_f64().unwrap();
        let speed = figure("continuous_speed");
        let rows = truth(folder.path(), &scenario(kg, speed, 0.25), None);
        let motions = motions(&rows);
        let ways = motions.iter();
        let ways = ways.map(|&(begun, ended)| rows[ended].t - rows[begun - 1].t);
        let cycle = ways.sum::<f64>() / 2.0;
        // A way begins and ends between two samples, here and there: so much of it is more or less.
        let samples = 2.0 * 2.0;
        let said = figure("continuous_cycle_s");
        assert!(
            (cycle - said).abs() < samples * 0.001,
            "{kg}: {cycle} {said}"
        );
        let rms = rms(&rows, &motions);
        assert!((rms - 1.0).abs() < samples * 0.001 / cycle, "{kg}: {rms}");
        assert!(figure("rms_share") > 1.0 && figure("pause_s") > 0.0);
    }
}

/// What holds for every gate, whatever the numbers.
#[test]
fn no_gate_is_faster_than_the_optimum_and_finer_takes_longer() {
    let folder = tempfile::tempdir().unwrap();
    let report: Value = serde_json::from_str(&bench(folder.path(), &["--json"])).unwrap();
    let all = |key: &str| report[key].as_array().unwrap().clone();
    let rows = all("rows");
    assert_eq!(
        (rows.len(), all("mismatched").len()),
        (7 * 4 * 2, 7 * 14 * 2)
    );
    let figure = |row: &Value, name: &str| row[name].as_f64().unwrap();
    for row in &rows {
        let of = |name| figure(row, name);
        let finer = [
            1.0,
            of("to_1_mm_ratio"),
            of("to_0_1_mm_ratio"),
            of("to_0_01_mm_ratio"),
        ];
        assert!(
            finer.is_sorted_by(|a, b| a < b) && of("planned_ratio") > 1.0,
            "{row}"
        );
        assert!(
            of("torque_share") <= 1.0 && of("speed_share") <= 1.0,
            "{row}"
        );
        assert!(of("tracking_rms_mm") <= of("tracking_max_mm"), "{row}");
        // What never stops can go no faster than what rests between two cycles of full speed.
        assert!(of("continuous_cycle_s") >= of("planned_s"), "{row}");
        assert!(
            of("continuous_cycle_s") <= of("planned_s") + of("pause_s"),
            "{row}"
        );
    }
    // Only what is heavier than announced may have needed more torque than there is.
    for row in all("mismatched") {
        assert!(
            row["fault"].is_null() || figure(&row, "payload_factor") > 1.0,
            "{row}"
        );
        assert_eq!(row["fault"].is_null(), row["planned_s"].is_f64(), "{row}");
    }
    for group in all("groups") {
        let members = rows.iter().filter(|row| {
            ["payload_kg", "rate_hz"]
                .iter()
                .all(|key| row[key] == group[key])
        });
        let ratios: Vec<f64> = members.map(|row| figure(row, "planned_ratio")).collect();
        assert_eq!(ratios.len(), 7);
        let mean = figure(&group["mean"], "planned_ratio");
        assert!(
            (mean - ratios.iter().sum::<f64>() / 7.0).abs() < 1e-12,
            "{group}"
        );
    }
}

/// The planner is held to the same places and optima as the benchmark.
#[test]
fn the_optima_are_those_of_the_test_of_the_planner() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let test = fs::read_to_string(root.join("../firmware/tests/optimum.rs")).unwrap();
    let test: String = test.split_whitespace().collect();
    let gates = gates();
    for of_payload in gates.chunks(7) {
        let places = of_payload
            .iter()
            .map(|gate| format!("({:.2},{:.1})", gate.radius_m, gate.stroke_deg));
        assert!(test.contains(&places.collect::<Vec<_>>().join(",")));
        let optima = of_payload
            .iter()
            .map(|gate| format!("{:.3}", gate.optimum_s));
        let optima = optima.collect::<Vec<_>>().join(",");
        let row = format!("({:.1},[{optima}],", of_payload[0].payload_kg);
        assert!(
            test.contains(&row),
            "firmware/tests/optimum.rs has no {row}"
        );
    }
    assert_eq!(gates.len(), 28);
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
    assert_eq!(of("4294967295"), one);
    // The header, two gates, and each with two frictions and two payloads.
    assert_eq!(one[1].lines().count(), 1 + 2 + 2 * 4);
    let text = bench(folder.path(), &["--quick"]);
    assert_eq!(text.matches("| 0 of 1 |").count(), 2 * 4, "{text}");
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
