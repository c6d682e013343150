//! A run can be repeated from its summary alone, to the byte.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use sim::model::RobotModel;

/// Runs `plant-sim run` with these words and returns its summary and its truth.
fn run(words: &[&str], out: &Path) -> (Value, Vec<u8>) {
    let output = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(["run", "--out", out.to_str().unwrap()])
        .args(words)
        .output()
        .unwrap();
    assert!(out.join("summary.json").exists(), "{output:?}");
    let summary = fs::read(out.join("summary.json")).unwrap();
    (
        serde_json::from_slice(&summary).unwrap(),
        fs::read(out.join("truth.csv")).unwrap(),
    )
}

/// Writes the file that a model of a summary was read from.
fn model_file(model: &Value, path: &Path) -> String {
    let text = match model["text"].as_str() {
        Some(text) => text.to_owned(),
        None => {
            let name = model["origin"].as_str().unwrap();
            RobotModel::built_in(name).unwrap().source.text
        }
    };
    fs::write(path, &text).unwrap();
    let hash = Command::new("sha256sum").arg(path).output().unwrap();
    let hash = String::from_utf8(hash.stdout).unwrap();
    assert_eq!(hash.split(' ').next(), model["sha256"].as_str());
    path.to_str().unwrap().to_owned()
}

/// Runs, repeats the run from its summary, and compares.
fn repeated(words: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let (summary, truth) = run(words, &first);

    let file = |name: &str| folder.path().join(name);
    let scenario = file("scenario.toml");
    fs::write(&scenario, summary["scenario_text"].as_str().unwrap()).unwrap();
    let models = &summary["models"];
    let believed = model_file(&models["controller"], &file("believed.json"));
    let true_one = model_file(&models["robot"], &file("true.json"));
    let (again, same_truth) = run(
        &[
            "--scenario",
            scenario.to_str().unwrap(),
            "--model",
            &believed,
            "--plant-model",
            &true_one,
        ],
        &second,
    );
    assert_eq!(summary["trace_sha256"], again["trace_sha256"], "{words:?}");
    assert!(truth == same_truth, "{words:?}: different truth");
    for key in [
        "law",
        "rate_hz",
        "gains",
        "payload",
        "mismatch",
        "each_cycle",
        "state",
        "fault",
    ] {
        assert_eq!(summary[key], again[key], "{key}");
    }
    summary
}

#[test]
fn what_the_command_line_changed_is_repeated() {
    let summary = repeated(&[
        "--scenario",
        "gate-mismatch",
        "--law",
        "computed-torque:integral",
        "--rate",
        "500",
        "--cycles",
        "2",
        "--payload",
        "3.3",
    ]);
    assert_eq!(summary["payload"]["mass"], 3.3);
    assert_eq!(summary["payload"]["com_flange_frame"][2], 0.05);
    assert_eq!(summary["mismatch"]["friction"], 1.2);
    // A corner of 0.17 rad per sample at 500 Hz.
    assert_eq!(summary["gains"]["bandwidth"], 85.0);
    assert_eq!(summary["state"], "ready");
    assert_eq!(summary["fault"], Value::Null);
    assert_eq!(summary["completed"], true);
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    let command: Vec<&str> = summary["command"]
        .as_array()
        .unwrap()
        .iter()
        .map(|word| word.as_str().unwrap())
        .collect();
    assert_eq!(command[4..6], ["--scenario", "gate-mismatch"]);
}

#[test]
fn two_robots_of_files_are_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let heavy = RobotModel::irb_930_22_105()
        .source
        .text
        .replace("14.5", "15.25");
    let path = folder.path().join("heavy.json");
    fs::write(&path, &heavy).unwrap();
    let summary = repeated(&["--cycles", "1", "--plant-model", path.to_str().unwrap()]);
    let models = &summary["models"];
    assert_eq!(models["robot"]["origin"], path.to_str().unwrap());
    assert_eq!(models["robot"]["text"], heavy);
    assert_eq!(models["controller"]["origin"], "irb930-22-1.05");
    assert_ne!(models["robot"]["sha256"], models["controller"]["sha256"]);
}

#[test]
fn a_run_that_ends_in_a_fault_is_repeated_and_says_how_it_ended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dead.toml");
    let scenario = include_str!("../scenarios/gate-mismatch.toml").replace(
        "\nrate_hz",
        "\nfaults = [\"motor:elbow:dead@0.5s\"]\nrate_hz",
    );
    fs::write(&path, scenario).unwrap();
    let summary = repeated(&["--scenario", path.to_str().unwrap()]);
    assert_eq!(summary["completed"], false);
    assert_eq!(summary["state"], "fault");
    let fault = summary["fault"].as_str().unwrap();
    assert!(fault.contains("following error"), "{fault}");
}
