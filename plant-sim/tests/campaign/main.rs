//! `plant-sim campaign`: the same results whatever the division and however often a part was ended, and refusals of what does
//! not belong together.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod altered;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// Few cases. One of the robots, with ten times the friction of the model, cannot survive what a sound one does.
const CASES: &str = r#"
faults = ["feedback:duplicate", "feedback:corrupt"]
lasts_ms = [12, 0]
[[situation]]
name = "gate"
scenario = "gate"
set = ["cycles=1"]
payload = 22
begin_ms = { from = 525, until = 529, step = 2 }
[[situation]]
name = "rusty"
scenario = "gate"
set = ["cycles=1", "mismatch.friction=10"]
begin_ms = { from = 525, until = 529, step = 2 }
"#;

struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Self::with(CASES)
    }

    fn with(cases: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("cases.toml"), cases).unwrap();
        let bench = Self { folder };
        bench.keep("plan.jsonl", &["plan", "--cases", "cases.toml"], 0);
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn call(&self, arguments: &[&str], status: i32) -> Output {
        let output = self.try_it(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {said}");
        output
    }

    fn try_it(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_plant-sim"))
            .arg("campaign")
            .args(arguments)
            .current_dir(self.folder.path())
            .env_remove("SLURM_ARRAY_TASK_ID")
            .output()
            .unwrap()
    }

    fn keep(&self, name: &str, arguments: &[&str], status: i32) -> String {
        let output = self.call(arguments, status);
        fs::write(self.path(name), &output.stdout).unwrap();
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs a part, which may hold cases that miss something, or not; returns what is said of it.
    fn run(&self, shard: &str, out: &str, more: &[&str]) -> (Option<i32>, String) {
        let arguments = ["run", "plan.jsonl", "--shard", shard, "--out", out];
        let output = self.try_it(&[&arguments[..], more].concat());
        assert!(matches!(output.status.code(), Some(0 | 1)), "{output:?}");
        let shown = String::from_utf8_lossy(&output.stdout);
        let (part, of) = shard.split_once('/').unwrap();
        let file = format!("{out}/results-{part}-of-{of}.jsonl");
        assert!(
            shown.contains(" cases run, ") && shown.contains(&file),
            "{shown}"
        );
        (output.status.code(), shown.into_owned())
    }

    fn refused(&self, arguments: &[&str], why: &str) {
        let output = self.call(arguments, 2);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(why), "{arguments:?}: {said}");
    }
}

#[test]
fn a_plan_crosses_everything_and_a_draw_follows_its_seed() {
    let bench = Bench::new();
    let plan = bench.read("plan.jsonl");
    let header: Value = serde_json::from_str(plan.lines().next().unwrap()).unwrap();
    // Two situations and faults, two durations, three beginnings.
    assert_eq!(header["cases"], 2 * 2 * 2 * 3);
    assert_eq!(plan.lines().count(), 1 + 2 * 2 * 2 * 3);
    let drawn = |seed: &str| {
        let output = bench.call(&["plan", "--count", "40", "--seed", seed], 0);
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(drawn("1"), drawn("1"));
    assert_ne!(drawn("1"), drawn("2"));
    assert_eq!(drawn("1").lines().count(), 41);
}

#[test]
fn results_are_the_same_bytes_however_they_are_divided() {
    let bench = Bench::new();
    bench.run("0/1", "whole", &["--jobs", "2"]);
    let whole = bench.keep("whole.jsonl", &["merge", "whole"], 0);
    for part in ["0/3", "1/3", "2/3"] {
        bench.run(part, "parts", &["--jobs", "1"]);
    }
    assert_eq!(bench.keep("parts.jsonl", &["merge", "parts"], 0), whole);
    assert_eq!(whole.lines().count(), 1 + 24);
    let report = String::from_utf8(bench.call(&["report", "whole.jsonl"], 1).stdout).unwrap();
    assert!(report.contains("\n24 cases: "), "{report}");
}

/// A process that is killed leaves a piece of what it would have written.
#[test]
fn a_part_that_was_ended_anywhere_goes_on_to_the_same_bytes() {
    let bench = Bench::new();
    let (status, shown) = bench.run("0/2", "out", &[]);
    assert_eq!(status, Some(1), "a rusty robot misses something");
    let of_both = shown.split(" kept, ").nth(1).unwrap();
    let file = "out/results-0-of-2.jsonl";
    let whole = bench.read(file);
    let lines: Vec<usize> = whole.match_indices('\n').map(|(at, _)| at).collect();
    let cuts = [0, 1, lines[0] - 1, lines[0], lines[0] + 1, lines[3] + 1];
    for cut in cuts.into_iter().chain([lines[5] - 7, whole.len() - 1]) {
        fs::remove_file(bench.path(file)).unwrap();
        fs::write(bench.path(&format!("{file}.partial")), &whole[..cut]).unwrap();
        // What was missed before it was ended is missed, too.
        let (again, shown) = bench.run("0/2", "out", &["--resume"]);
        assert_eq!(again, status, "cut at {cut}");
        assert!(shown.ends_with(of_both), "cut at {cut}: {shown}");
        assert_eq!(bench.read(file), whole, "cut at {cut}");
        assert!(!bench.path(&format!("{file}.partial")).exists());
    }
    // Complete results are left alone, and judged.
    let (again, shown) = bench.run("0/2", "out", &["--resume"]);
    assert_eq!(again, status);
    assert!(shown.starts_with("0 cases run, 12 kept, ") && shown.ends_with(of_both));
    assert_eq!(bench.read(file), whole);
}

/// What a disk, an editor or a copy that was cut off makes of results is found, and run again.
#[test]
fn damaged_results_are_missing_and_run_again() {
    let bench = Bench::new();
    let (status, _) = bench.run("0/2", "out", &[]);
    bench.run("1/2", "out", &[]);
    let merged = bench.call(&["merge", "out"], 0).stdout;
    let file = "out/results-0-of-2.jsonl";
    let whole = bench.read(file);
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    // Lines in this order, counted from 0.
    let of = |order: &[usize]| order.iter().map(|at| lines[*at]).collect::<String>();
    let rest: Vec<usize> = (4..lines.len()).collect();
    let tailed = |head: &[usize]| of(&[head, &rest].concat());
    let spoiled = |at: usize, by: &str| {
        let mut lines: Vec<String> = lines.iter().map(|&line| line.into()).collect();
        lines[at].replace_range(7..10, by);
        lines.concat()
    };
    for (damaged, why) in [
        (String::new(), "line 1 is not that of results of part 0/2"),
        (
            spoiled(0, "\0\0\0"),
            "line 1 is not that of results of part 0/2",
        ),
        (
            whole.replacen("\"part\":0", "\"part\":1", 1),
            "line 1 is not that of results of part 0/2",
        ),
        (
            whole[..whole.len() - 30].into(),
            "line 13 is no result of a case",
        ),
        (
            whole[..whole.len() - 1].into(),
            "line 13 is no result of a case",
        ),
        (of(&[0, 1, 2]), "it ends before case 4"),
        (tailed(&[0, 1, 2]), "line 4 is case 6, where case 4 belongs"),
        (
            tailed(&[0, 1, 2, 2, 3]),
            "line 4 is case 2, where case 4 belongs",
        ),
        (
            tailed(&[0, 1, 3, 2]),
            "line 3 is case 4, where case 2 belongs",
        ),
        (spoiled(3, "x"), "line 4 is no result of a case"),
        (
            format!("{whole}{}", lines[3]),
            "line 14 is case 4, after the last",
        ),
        (format!("{whole}\n"), "line 14 is no result of a case"),
    ] {
        for name in [file, "out/results-0-of-2.jsonl.partial"] {
            fs::remove_file(bench.path(file)).unwrap();
            fs::write(bench.path(name), &damaged).unwrap();
            if name == file {
                let missing = bench.call(&["missing", "out"], 0);
                assert_eq!(missing.stdout, b"0\n", "{why}");
                let said = String::from_utf8_lossy(&missing.stderr);
                assert!(
                    said.contains(why) && said.contains("--shard 0/2 --resume --out out"),
                    "{why}: {said}"
                );
                bench.refused(&["merge", "out"], why);
            }
            assert_eq!(bench.run("0/2", "out", &["--resume"]).0, status, "{why}");
            assert_eq!(bench.read(file), whole, "{why}");
            assert!(!bench.path("out/results-0-of-2.jsonl.partial").exists());
            assert_eq!(bench.call(&["missing", "out"], 0).stdout, b"\n", "{why}");
        }
    }
    fs::write(bench.path(file), b"\xff\xfe\n").unwrap();
    assert_eq!(bench.call(&["missing", "out"], 0).stdout, b"0\n");
    bench.run("0/2", "out", &["--resume"]);
    assert_eq!(bench.call(&["merge", "out"], 0).stdout, merged);
    fs::copy(bench.path(file), bench.path("out/results-copy.jsonl")).unwrap();
    bench.refused(&["merge", "out"], "results are called results-K-of-N.jsonl");
}

#[test]
fn what_is_missing_or_there_twice_is_refused_by_number() {
    let bench = Bench::new();
    for part in ["0/6", "2/6", "4/6", "5/6"] {
        bench.run(part, "some", &[]);
    }
    let missing = bench.call(&["missing", "some"], 0).stdout;
    assert_eq!(String::from_utf8_lossy(&missing), "1,3\n");
    bench.refused(&["merge", "some"], "case 1 is missing before case 2");
    for part in ["1/6", "3/6"] {
        bench.run(part, "rest", &[]);
    }
    assert_eq!(bench.call(&["missing", "some", "rest"], 0).stdout, b"\n");
    bench.call(&["merge", "some", "rest"], 0);
    bench.run("1/6", "twice", &[]);
    bench.refused(
        &["merge", "some", "rest", "twice"],
        "case 1 is here and in another file, too",
    );
    bench.refused(&["merge", "nowhere"], "cannot be read");
    fs::create_dir(bench.path("empty")).unwrap();
    bench.refused(&["missing", "empty"], "no shard is complete here");
}

#[test]
fn results_of_another_plan_do_not_belong_here() {
    let bench = Bench::new();
    bench.run("0/2", "first", &[]);
    let other = CASES.replace("until = 529", "until = 531");
    fs::write(bench.path("cases.toml"), other).unwrap();
    bench.keep("plan.jsonl", &["plan", "--cases", "cases.toml"], 0);
    bench.run("1/2", "second", &[]);
    for command in ["merge", "missing"] {
        bench.refused(&[command, "first", "second"], "of another plan than");
    }
    fs::rename(bench.path("first"), bench.path("out")).unwrap();
    let again = "run plan.jsonl --shard 0/2 --out out --resume".split(' ');
    bench.refused(&again.collect::<Vec<_>>(), "results of another plan");
}

#[test]
fn a_plan_that_was_changed_or_is_none_is_refused() {
    let bench = Bench::new();
    let plan = bench.read("plan.jsonl");
    for (wrong, why) in [
        (
            plan.replace("feedback:corrupt", "feedback:loss"),
            "plan.jsonl: the cases are here, but not as they were written; write it again",
        ),
        (
            plan.lines().next().unwrap().to_owned(),
            "plan.jsonl: the plan has 0 cases of 24; write it again",
        ),
        (String::new(), "not that of a plan"),
        ("{}".to_owned(), "not that of a plan"),
    ] {
        fs::write(bench.path("plan.jsonl"), wrong).unwrap();
        bench.refused(&["run", "plan.jsonl"], why);
    }
    bench.refused(&["run", "nowhere.jsonl"], "cannot be read");
    bench.refused(&["report", "plan.jsonl"], "not that of merged results");
    bench.refused(&["run", "plan.jsonl", "--shard", "2/2"], "allowed: K/N");
    bench.refused(&["plan", "--cases", "plan.jsonl"], "plan.jsonl: ");
}

#[test]
fn a_replay_and_a_shrunk_case_are_judged_like_the_case() {
    let bench = Bench::new();
    bench.run("0/1", "out", &[]);
    let results = bench.read("out/results-0-of-1.jsonl");
    let missed = results
        .lines()
        .skip(1)
        .find(|line| !line.contains("\"missed\":[]"));
    let missed = missed.expect("a robot that cannot go on");
    let missed: Value = serde_json::from_str(missed).unwrap();
    let number = missed["case"]["case"].to_string();
    let replayed = bench.keep(
        "v",
        &["replay", "plan.jsonl", &number, "--out", "replay"],
        1,
    );
    let verdict = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    assert_eq!(verdict(&replayed), missed["verdict"]);
    for file in ["trace.log", "truth.csv", "summary.json", "report.html"] {
        assert!(Path::exists(&bench.path("replay").join(file)), "{file}");
    }

    let small = bench.keep("small.jsonl", &["shrink", "plan.jsonl", &number], 0);
    assert_eq!(small.lines().count(), 2, "{small}");
    let again = bench.keep("v", &["replay", "small.jsonl", "0"], 1);
    let one = &verdict(&again)["missed"][0];
    assert!(
        missed["verdict"]["missed"]
            .as_array()
            .unwrap()
            .contains(one)
    );

    let held = results
        .lines()
        .skip(1)
        .find(|line| line.contains("\"missed\":[]"));
    let held: Value = serde_json::from_str(held.unwrap()).unwrap();
    bench.call(
        &["shrink", "plan.jsonl", &held["case"]["case"].to_string()],
        3,
    );
    bench.refused(&["replay", "plan.jsonl", "24"], "allowed: 0 to 23");
}
