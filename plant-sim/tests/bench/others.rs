//! Gates at random and the repeatability of a pose, against ordinary runs of the same.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::bench;
use crate::truth::{Truth, across, distance, motions, truth};

/// A gate as anyone would write it, from its row.
fn scenario(row: &Value, clearance: f64) -> String {
    let [start, end] = ["start", "end"].map(|key| row[key].to_string());
    let [first, second] = [0, 1].map(|end| row["turns"][end].to_string());
    let jump = |to: &str, turn: &str| {
        format!(
            "[[cycle]]\njump = {{ to = {to}, turn = {turn}, top = {}, clearance = {clearance} }}\n[[cycle]]\ndwell = 0.25\n",
            row["top_m"]
        )
    };
    let kg = row["payload_kg"].as_f64().unwrap();
    let payload = format!(
        "[payload]\nmass = {kg}\ncom_flange_frame = [0.0, 0.0, 0.05]\ninertia_com_diag = [{0}, {0}, {1}]\n",
        0.004 * kg,
        0.005 * kg
    );
    format!(
        "name = \"other\"\ncycles = 1\nrate_hz = {}\nlaw = \"computed-torque:observer\"\nstart = {start}\nstart_turn = {first}\n\
         start_elbow = {}\n{payload}{}{}",
        row["rate_hz"],
        row["elbow"],
        jump(&end, &second),
        jump(&start, &first)
    )
}

/// Round trip as planned and to 0.01 mm, and the least height above the chamfer of the nearer end.
fn trip(rows: &[Truth], row: &Value) -> [f64; 3] {
    let four = |key: &str| std::array::from_fn(|axis| row[key][axis].as_f64().unwrap());
    let ends: [[f64; 4]; 2] = [four("start"), four("end")];
    let (rate, top) = (
        row["rate_hz"].as_f64().unwrap(),
        row["top_m"].as_f64().unwrap(),
    );
    let (mut planned, mut arrived, mut margin) = (0.0, 0.0, f64::INFINITY);
    for (way, (begun, ended)) in motions(rows).into_iter().enumerate() {
        let to = &ends[1 - way % 2];
        planned += rows[ended].t - rows[begun - 1].t;
        let rest = &rows[begun..=ended + (0.25 * rate) as usize];
        let turned = |row: &Truth| {
            let turns = (row.tool[3] - to[3]) / std::f64::consts::TAU;
            (turns - turns.round()).abs() * std::f64::consts::TAU
        };
        let out = |row: &Truth| distance(&row.tool, to) > 1e-5 || turned(row) > 1e-4;
        let last = rest.iter().rposition(out).unwrap();
        arrived += rest[last + 1].t - rows[begun - 1].t;
        for row in &rows[begun..ended] {
            let near = ends
                .iter()
                .min_by(|a, b| across(&row.tool, a).total_cmp(&across(&row.tool, b)));
            let near = near.unwrap();
            let chamfer = across(&row.tool, near).min(top - near[2]);
            margin = margin.min(row.tool[2] - near[2] - chamfer);
        }
    }
    [planned, arrived, margin]
}

/// The model of the robot with the caps that models had before.
fn capped(folder: &Path) {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/irb930-22-1.05.json");
    let model = fs::read_to_string(model).unwrap();
    let caps = "\"acceleration_cap\": [60, 120, 60, 600], \"jerk_cap\": [2500, 7500, 10000, 40000], \"effort_peak\"";
    fs::write(
        folder.join("capped.json"),
        model.replace("\"effort_peak\"", caps),
    )
    .unwrap();
}

#[test]
fn gates_at_random_take_what_ordinary_runs_of_them_take() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    capped(folder);
    let files = ["--others", "others.csv", "--repeatability", "pose.csv"];
    let report: Value = serde_json::from_str(&bench(
        folder,
        &[&["--quick", "--json"], &files[..]].concat(),
    ))
    .unwrap();
    let rows = report["others"]["rows"].as_array().unwrap();
    let heavy = rows.iter().filter(|row| row["payload_kg"] != 0.0);
    let gates: Vec<&Value> = heavy.take(2).collect();
    assert_eq!(gates.len(), 2);
    for row in gates {
        for (key, model, clearance) in [
            ("now", None, 0.0),
            ("capped", Some("capped.json"), 0.0),
            ("before", Some("capped.json"), 0.005),
        ] {
            let seen = truth(folder, &scenario(row, clearance), model);
            let [planned, arrived, margin] = trip(&seen, row);
            let close = |found: &Value, expected: f64| {
                assert!(
                    (found.as_f64().unwrap() - expected).abs() < 1e-9,
                    "{key}: {found}, {expected}"
                );
            };
            close(&row[key]["planned_s"], planned);
            close(&row[key]["to_0_01_mm_s"], arrived);
            if key == "now" {
                close(&row["gate_margin_mm"], margin * 1e3);
            }
        }
    }
    // A line for each, under the same names.
    let text = fs::read_to_string(folder.join("others.csv")).unwrap();
    assert_eq!(text.lines().count(), 1 + rows.len());
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    for name in [
        "end[3]",
        "now.to_0_01_mm_s",
        "peaks.torque_rate",
        "gate_margin_mm",
    ] {
        assert!(head.contains(&name), "{head:?}");
    }
    assert_eq!(
        fs::read_to_string(folder.join("pose.csv"))
            .unwrap()
            .lines()
            .count(),
        2
    );
}

/// What is said of all gates follows from their rows; they are as various as they are said to be, and none is outside its limits.
#[test]
fn the_gates_at_random_are_various_and_keep_their_limits() {
    let folder = tempfile::tempdir().unwrap();
    let report: Value = serde_json::from_str(&bench(folder.path(), &["--json"])).unwrap();
    let others = &report["others"];
    let rows = others["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 200);
    let of = |row: &Value, key: &str| row[key].as_f64().unwrap();
    let share = |is: &dyn Fn(&Value) -> bool| rows.iter().filter(|row| is(row)).count();
    assert!((70..130).contains(&share(&|row| row["elbow"] == "negative")));
    assert!(share(&|row| of(row, "turn_deg").abs() > 180.0) > 40);
    assert!(
        share(&|row| of(row, "stroke_m") > 0.3) > 40
            && share(&|row| of(row, "stroke_m") < 0.15) > 20
    );
    assert!(
        share(
            &|row| (row["start"][2].as_f64().unwrap() - row["end"][2].as_f64().unwrap()).abs()
                > 0.03
        ) > 60
    );
    for row in rows {
        assert!(
            (0.05 - 1e-9..=0.6 + 1e-9).contains(&of(row, "stroke_m")),
            "{row}"
        );
        assert!(of(row, "turn_deg").abs() <= 350.0 + 1e-9, "{row}");
    }
    for key in ["faults", "outside", "missed"] {
        assert_eq!(others[key], 0, "{key}");
    }
    for key in ["capped", "before"] {
        let time = |row: &Value, key: &str| row[key]["to_0_01_mm_s"].as_f64().unwrap();
        let mut saved: Vec<f64> = rows
            .iter()
            .map(|row| 1.0 - time(row, "now") / time(row, key))
            .collect();
        saved.sort_by(f64::total_cmp);
        assert!((of(&others[key], "median") - (saved[99] + saved[100]) / 2.0).abs() < 1e-12);
        assert_eq!(of(&others[key], "least"), saved[0]);
    }
    // ISO 9283, with the numbers of the goal: a step of the encoders is some micrometres at the tool, of which rest less.
    let poses = report["repeatability"].as_array().unwrap();
    assert_eq!(poses.len(), 4);
    for pose in poses {
        let sum = of(pose, "mean_mm") + 3.0 * of(pose, "deviation_mm");
        assert_eq!(
            (&pose["cycles"], &pose["fault"]),
            (&100.into(), &Value::Null)
        );
        assert!((of(pose, "repeatability_mm") - sum).abs() < 1e-12, "{pose}");
        assert!(sum > 0.0 && sum < 0.005, "{pose}");
    }
}

/// The pose of an ordinary run with the same noise, from its truth.
#[test]
fn the_repeatability_is_what_the_truth_of_an_ordinary_run_says() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let report: Value = serde_json::from_str(&bench(folder, &["--quick", "--json"])).unwrap();
    let pose = &report["repeatability"][0];
    let mut text = crate::truth::scenario(2.0, 1.0, 0.25).replace("cycles = 2", "cycles = 100");
    let noise = ["shoulder", "elbow", "lift", "wrist"]
        .into_iter()
        .zip(pose["noise"].as_array().unwrap());
    let faults: Vec<String> = noise
        .map(|(axis, noise)| format!("\"encoder:{axis}:noise={}@0s\"", noise.as_f64().unwrap()))
        .collect();
    text = format!("faults = [{}]\n{text}", faults.join(", "));
    let rows = truth(folder, &text, None);
    let ends = motions(&rows);
    assert_eq!(ends.len(), 200);
    // The last sample before the arm goes back.
    let attained: Vec<[f64; 4]> = ends
        .iter()
        .skip(1)
        .step_by(2)
        .map(|(begun, _)| rows[begun - 1].tool)
        .collect();
    let count = attained.len() as f64;
    let centre: [f64; 4] =
        std::array::from_fn(|axis| attained.iter().map(|at| at[axis]).sum::<f64>() / count);
    let away: Vec<f64> = attained.iter().map(|at| distance(at, &centre)).collect();
    let mean = away.iter().sum::<f64>() / count;
    let squares: f64 = away.iter().map(|it| (it - mean).powi(2)).sum();
    let expected = (mean + 3.0 * (squares / (count - 1.0)).sqrt()) * 1e3;
    let found = pose["repeatability_mm"].as_f64().unwrap();
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}
