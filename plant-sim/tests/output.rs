//! The folder of a run: what appears in it, when, and what is left alone.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::os::unix::fs::{FileTypeExt as _, symlink};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

const RESULTS: [&str; 4] = ["report.html", "summary.json", "trace.log", "truth.csv"];

fn plant_sim() -> Command {
    Command::new(env!("CARGO_BIN_EXE_plant-sim"))
}

fn run(out: &Path) -> Command {
    let mut command = plant_sim();
    command.args(["run", "--out"]).arg(out);
    command
}

fn says(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn summary(out: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A run that goes on until it is stopped, and has begun.
fn endless(out: &Path) -> Child {
    let child = run(out)
        .args(["--cycles", "1000000", "--quiet"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !out.exists()
        || !names(out)
            .iter()
            .any(|name| name.starts_with(".unfinished-"))
    {
        std::thread::yield_now();
    }
    child
}

fn signal(child: &Child, signal: Signal) {
    let pid = Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
    kill_process(pid, signal).unwrap();
}

#[test]
fn a_signal_leaves_the_summary_of_what_was_done() {
    for by in [Signal::INT, Signal::TERM] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let child = endless(&out);
        signal(&child, by);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", says(&output));
        assert!(
            says(&output).contains("ended by a signal"),
            "{}",
            says(&output)
        );
        assert_eq!(summary(&out)["completed"], false);
        assert!(summary(&out)["error"].as_str().unwrap().contains("signal"));
        assert_eq!(names(&out), RESULTS);
    }
}

#[test]
fn a_second_run_into_the_folder_of_one_that_goes_on_is_refused_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut first = endless(&out);
    for _ in 0..3 {
        let second = run(&out).output().unwrap();
        assert_eq!(second.status.code(), Some(1));
        assert!(
            says(&second).contains("another run is writing into"),
            "{}",
            says(&second)
        );
    }
    // Killed, it leaves neither results nor a lock, and the next run clears up after it.
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(!out.join("summary.json").exists());
    let third = run(&out).args(["--cycles", "1"]).output().unwrap();
    assert!(third.status.success(), "{}", says(&third));
    assert_eq!(names(&out), RESULTS);
}

#[test]
fn older_results_do_not_lie_beside_new_ones_and_stay_where_nothing_was_run() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    assert!(run(out).args(["--cycles", "1"]).status().unwrap().success());
    fs::write(out.join("controller.log"), "of a run on the board").unwrap();
    fs::write(out.join("notes.txt"), "mine").unwrap();

    let refused = run(out).args(["--set", "cycles=0"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(out.join("controller.log").exists());
    // Nobody listens at this port, which needs a right of its own.
    let nobody = ["--controller", "external", "--bus", "slcan:tcp:127.0.0.1:1"];
    let alone = run(out).args(nobody).output().unwrap();
    assert!(says(&alone).contains("out of reach") && !alone.status.success());
    assert!(out.join("controller.log").exists());

    let quiet = run(out)
        .args(["--cycles", "1", "--no-trace", "--quiet"])
        .output()
        .unwrap();
    assert!(quiet.status.success() && quiet.stdout.is_empty() && quiet.stderr.is_empty());
    assert_eq!(names(out), ["notes.txt", "report.html", "summary.json"]);
    assert_eq!(summary(out)["trace_sha256"], Value::Null);
}

#[test]
fn no_output_replaces_an_input_or_another_output() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scenario = sim::scenario::built_in("gate").unwrap();
    fs::write(path.join("my.toml"), scenario).unwrap();
    let robot = include_str!("../models/irb930-12-0.85.json");
    fs::write(path.join("r.json"), robot).unwrap();
    for (arguments, what) in [
        ("run --scenario my.toml --junit my.toml", "an input"),
        ("run my.toml --markdown ./my.toml", "an input"),
        ("run --model r.json --needs r.json", "an input"),
        ("run --plant-model r.json --mcap r.json", "an input"),
        ("run --junit x --needs x", "another output"),
        ("run --out o --junit o/../o/summary.json", "another output"),
        ("model r.json --out r.json", "an input"),
    ] {
        fs::create_dir_all(path.join("o")).unwrap();
        let refused = plant_sim()
            .args(arguments.split(' '))
            .current_dir(path)
            .output()
            .unwrap();
        let said = says(&refused);
        assert_eq!(refused.status.code(), Some(2), "{arguments}: {said}");
        assert!(said.contains(what), "{arguments}: {said}");
        assert_eq!(fs::read_to_string(path.join("my.toml")).unwrap(), scenario);
        assert_eq!(fs::read_to_string(path.join("r.json")).unwrap(), robot);
        assert_eq!(names(path), ["my.toml", "o", "r.json"], "{arguments}");
    }
}

#[test]
fn what_is_no_regular_file_is_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let dbc = |out: &Path| {
        plant_sim()
            .args(["dbc", "--out"])
            .arg(out)
            .output()
            .unwrap()
    };

    // A FIFO: refused without a reader, and written to with one.
    let fifo = path.join("fifo");
    assert!(
        Command::new("mkfifo")
            .arg(&fifo)
            .status()
            .unwrap()
            .success()
    );
    let refused = dbc(&fifo);
    assert_eq!(refused.status.code(), Some(2), "{}", says(&refused));
    let reader = Command::new("cat")
        .arg(&fifo)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut written = dbc(&fifo);
    while !written.status.success() {
        written = dbc(&fifo);
    }
    assert_eq!(reader.wait_with_output().unwrap().stdout, dbc_text());

    // A device stays one; a link leads to its file.
    assert!(dbc(Path::new("/dev/null")).status.success());
    assert!(
        fs::metadata("/dev/null")
            .unwrap()
            .file_type()
            .is_char_device()
    );
    fs::write(path.join("file"), "old").unwrap();
    symlink(path.join("file"), path.join("link")).unwrap();
    assert!(dbc(&path.join("link")).status.success());
    assert_eq!(fs::read(path.join("file")).unwrap(), dbc_text());
    assert!(
        fs::symlink_metadata(path.join("link"))
            .unwrap()
            .is_symlink()
    );
    symlink(path.join("nowhere"), path.join("broken")).unwrap();
    assert_eq!(dbc(&path.join("broken")).status.code(), Some(2));
    assert_eq!(dbc(path).status.code(), Some(2));

    // In the folder of a run each is named, before anything runs.
    let out = path.join("out");
    fs::create_dir(&out).unwrap();
    symlink("/dev/null", out.join("truth.csv")).unwrap();
    let refused = run(&out).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        says(&refused).contains("truth.csv: it is a link"),
        "{}",
        says(&refused)
    );
    let refused = run(&fifo).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        says(&refused).contains("it is a FIFO"),
        "{}",
        says(&refused)
    );
    assert!(fs::symlink_metadata(&fifo).unwrap().file_type().is_fifo());
}

fn dbc_text() -> Vec<u8> {
    plant_sim().arg("dbc").output().unwrap().stdout
}

#[test]
fn a_standard_output_or_error_that_is_full_or_gone_loses_no_results() {
    // The first is long enough for a line of progress.
    for (sinks, cycles) in [
        ("2>&1 >/dev/full | head -c 1 >/dev/null", 600),
        ("2>/dev/full", 1),
        (">&- 2>&-", 1),
        ("2>&1 | head -c 1 >/dev/null", 1),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let script = format!("\"$1\" run --cycles {cycles} --out \"$2\" {sinks}");
        let status = Command::new("sh")
            .args(["-c", &script, "sh", env!("CARGO_BIN_EXE_plant-sim")])
            .arg(folder.path())
            .stdout(Stdio::null())
            .status()
            .unwrap();
        assert!(status.success(), "{sinks}");
        assert_eq!(summary(folder.path())["completed"], true, "{sinks}");
    }
    // A summary that could not be shown is said to be lost; the file has it.
    let folder = tempfile::tempdir().unwrap();
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let output = run(folder.path())
        .args(["--cycles", "1"])
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(says(&output).contains("cannot write to standard output"));
    assert_eq!(summary(folder.path())["completed"], true);
}

#[test]
fn a_tilde_that_the_shell_has_left_makes_no_folder() {
    let folder = tempfile::tempdir().unwrap();
    for command in [
        &["run", "--cycles", "1", "--out", "~/x"][..],
        &["dbc", "--out", "~/x.dbc"],
        &["man", "--out", "~"],
    ] {
        let output = plant_sim()
            .args(command)
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{command:?}");
        assert!(says(&output).contains("$HOME"), "{}", says(&output));
    }
    assert!(names(folder.path()).is_empty());
    // One of this name may be there.
    fs::create_dir(folder.path().join("~")).unwrap();
    let output = plant_sim()
        .args(["dbc", "--out", "~/x.dbc"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", says(&output));
    assert_eq!(names(&folder.path().join("~")), ["x.dbc"]);
}

#[test]
fn a_file_that_cannot_be_made_is_the_one_that_was_named() {
    let output = plant_sim()
        .args(["dbc", "--out", "/nowhere/x.dbc"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = says(&output);
    assert!(
        said.contains("/nowhere/x.dbc") && !said.contains("partial"),
        "{said}"
    );
}

#[test]
fn a_page_about_two_runs_replaces_neither() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    assert!(
        run(&out)
            .args(["--cycles", "1"])
            .output()
            .unwrap()
            .status
            .success()
    );
    let page = out.join("report.html");
    let before = fs::read(&page).unwrap();
    let report = plant_sim()
        .arg("report")
        .args([&out, &out])
        .arg("--out")
        .arg(&page)
        .output();
    let report = report.unwrap();
    assert_eq!(report.status.code(), Some(2));
    assert!(
        says(&report).contains("an input of this command"),
        "{}",
        says(&report)
    );
    assert_eq!(fs::read(&page).unwrap(), before);
}
