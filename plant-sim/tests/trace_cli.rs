//! `plant-sim trace` on the command line: its messages, refusals and exit codes.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use flate2::Compression;
use flate2::write::GzEncoder;

/// Frames of a foreign node, unknown to the protocol.
const FOREIGN: &str = "(1.000000) can0 123#00\n(1.100000) can0 123#01 T\n(1.300000) can0 124#\n";

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());

/// One cycle, as written by `plant-sim run`.
static RUN: LazyLock<PathBuf> = LazyLock::new(|| {
    let out = FOLDER.path().join("run");
    let run = plant_sim(&[
        "run",
        "--scenario",
        "gate",
        "--cycles",
        "1",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(run.status.success(), "{run:?}");
    out.join("trace.log")
});

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plant-sim"));
    command.args(arguments);
    command
}

fn plant_sim(arguments: &[&str]) -> Output {
    command(arguments).output().unwrap()
}

/// `plant-sim trace ...` of a file with this text: exit code, output, messages.
fn trace(name: &str, text: impl AsRef<[u8]>, arguments: &[&str]) -> (i32, String, String) {
    let path = FOLDER.path().join(name);
    fs::write(&path, text).unwrap();
    of_file(&path, arguments)
}

fn of_file(path: &Path, arguments: &[&str]) -> (i32, String, String) {
    let (subcommand, rest) = arguments.split_first().unwrap();
    let output = plant_sim(&[&["trace", subcommand, path.to_str().unwrap()], rest].concat());
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

#[test]
fn a_log_without_anything_to_judge_has_an_exit_code_of_its_own() {
    for (subcommand, text, why) in [
        ("check", "", "the log is empty"),
        ("check", FOREIGN, "no frame of this protocol"),
        ("replay", "", "the log is empty"),
        ("replay", FOREIGN, "no command"),
        ("plot", "", "the log is empty"),
        ("plot", FOREIGN, "can be drawn"),
        ("stats", "# nothing\n\n", "the log is empty"),
        ("decode", "", "the log is empty"),
    ] {
        let (code, _, messages) = trace(&format!("{subcommand}-nothing"), text, &[subcommand]);
        assert_eq!(code, 3, "{subcommand}");
        assert!(
            messages.contains("nothing judged") && messages.contains(why),
            "{messages}"
        );
    }
    let (code, output, messages) = trace("unselected", FOREIGN, &["decode", "--id", "7FF"]);
    assert_eq!((code, output.as_str()), (3, ""));
    assert!(
        messages.contains("none of 3 records is selected; they are of can0 and from "),
        "{messages}"
    );
    let backwards = ["decode", "--from", "5", "--to", "1"];
    let (code, _, messages) = trace("backwards", FOREIGN, &backwards);
    assert!(
        code == 2 && messages.contains("--to is before --from"),
        "{messages}"
    );
}

#[test]
fn two_interfaces_are_two_buses() {
    let one = fs::read_to_string(&*RUN).unwrap();
    // As written by candump of `any` for traffic across two interfaces: every frame twice.
    let both: String = one
        .lines()
        .map(|line| format!("{}\n{line}\n", line.replace(" can0 ", "  vcan10 ")))
        .collect();
    let single: serde_json::Value =
        serde_json::from_str(&of_file(&RUN, &["stats", "--json"]).1).unwrap();
    let (code, json, _) = trace("two.log", &both, &["stats", "--json"]);
    let double: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(code, 0);
    let [first, second] = double["interfaces"].as_array().unwrap().as_slice() else {
        panic!("not two interfaces");
    };
    assert_eq!(first["ids"], single["interfaces"][0]["ids"]);
    assert_eq!(second["ids"], first["ids"]);
    assert_eq!(
        (&first["interface"], &second["interface"]),
        (&"vcan10".into(), &"can0".into())
    );
    for subcommand in ["check", "replay"] {
        assert_eq!(trace("two.log", &both, &[subcommand]).0, 0, "{subcommand}");
    }
    let pictures = trace("two.log", &both, &["plot"]).1;
    assert_eq!(pictures.matches("<polyline").count(), 24);
    let chosen = trace(
        "two.log",
        &both,
        &["convert", "--to", "candump", "--interface", "can0"],
    );
    assert_eq!(chosen.1, one);
    // A violation belongs to its interface.
    let commands: Vec<&str> = both
        .lines()
        .filter(|line| line.contains(" can0 240"))
        .collect();
    let missing = both.replace(commands[50], "# lost");
    let (code, _, messages) = trace("lost.log", missing, &["check"]);
    assert_eq!(code, 1);
    assert!(messages.contains(": can0: "), "{messages}");
}

#[test]
fn what_is_selected_is_judged_and_the_rest_is_followed() {
    let log = fs::read_to_string(&*RUN).unwrap();
    let (_, all, _) = of_file(&RUN, &["check"]);
    let (code, some, _) = of_file(
        &RUN,
        &["check", "--id", "Command", "--from", "+0.1", "--to", "0.2"],
    );
    assert_eq!(code, 0);
    let judged = |text: &str| -> u64 { text.split_once(' ').unwrap().0.parse().unwrap() };
    // 0.1 s of a controller at 1 kHz.
    assert!(
        (99..=101).contains(&judged(&some)) && judged(&all) > 1000,
        "{some} of {all}"
    );
    let (code, compared, _) = of_file(&RUN, &["replay", "--from", "0.1", "--to", "0.2"]);
    assert_eq!((code, judged(&compared)), (0, judged(&some)));
    // A damaged frame outside the selection is not a violation.
    let mut lines: Vec<&str> = log.lines().collect();
    let place = lines
        .iter()
        .position(|line| line.contains(" 240##"))
        .unwrap();
    let damaged = lines[place].replace("240##1", "240##1F");
    lines[place] = &damaged[..damaged.len() - 1];
    let damaged = lines.join("\n") + "\n";
    assert_eq!(trace("damaged.log", &damaged, &["check"]).0, 1);
    assert_eq!(
        trace("damaged.log", &damaged, &["check", "--id", "Feedback"]).0,
        0
    );
    let (_, decoded, _) = of_file(&RUN, &["decode", "--id", "740-742", "--to", "1"]);
    assert!(decoded.lines().count() > 5 && decoded.lines().all(|line| line.contains("Heartbeat")));
}

#[test]
fn the_load_is_that_of_the_bit_rate_asked_for() {
    let load = |arguments: &[&str]| -> f64 {
        let (_, json, _) = trace(
            "load.log",
            FOREIGN,
            &[&["stats", "--json"], arguments].concat(),
        );
        serde_json::from_str::<serde_json::Value>(&json).unwrap()["interfaces"][0]["load"]
            .as_f64()
            .unwrap()
    };
    let ratio = load(&["--bitrate", "500k"]) / load(&[]);
    assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
    let (_, text, _) = trace("load.log", FOREIGN, &["stats", "--bitrate", "500000,2M"]);
    assert!(
        text.contains("load for 0.5 Mbit/s, data 2 Mbit/s"),
        "{text}"
    );
    for wrong in ["", "0", "2M", "500k,250k", "fast", "1M,9M", "1.5", "nan"] {
        assert_eq!(
            trace("load.log", FOREIGN, &["stats", "--bitrate", wrong]).0,
            2,
            "{wrong}"
        );
    }
}

#[test]
fn errors_are_counted_by_class_and_interface() {
    let log = "(1.0) can0 20000088#0000040000000000\n(1.1) can0 20000080#\n(1.2) can1 20000040#\n(1.3) can1 001#\n";
    let (_, json, _) = trace("errors.log", log, &["stats", "--json"]);
    let statistics: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        statistics["interfaces"][0]["errors"],
        serde_json::json!({"protocol-violation": 1, "bus-error": 2})
    );
    assert_eq!(
        statistics["interfaces"][1]["errors"],
        serde_json::json!({"bus-off": 1})
    );
    let (_, text, _) = trace("errors.log", log, &["stats"]);
    assert!(
        text.contains("2 error frames: 2 bus-error, 1 protocol-violation"),
        "{text}"
    );
    let (_, text, _) = trace("errors.log", log, &["decode"]);
    assert!(
        text.contains("protocol-violation (bit-stuffing-error), bus-error"),
        "{text}"
    );
}

#[test]
fn a_clock_that_was_set_is_named_and_can_be_left_out() {
    let log = "(10.0) can0 123#\n(10.1) can0 123#\n(1720000000.0) can0 123#\n(1720000000.1) can0 123#\n(9.0) can0 123#\n";
    let (_, text, _) = trace("clock.log", log, &["stats"]);
    assert!(
        text.contains("largest step between two records is 1719999989.900000 s"),
        "{text}"
    );
    assert!(
        text.contains("1 records are earlier than the one before, by up to 1719999991.100000 s"),
        "{text}"
    );
    let (_, json, _) = trace("clock.log", log, &["stats", "--json", "--skip-gaps", "60"]);
    let statistics: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(statistics["span_s"], 0.2);
    let period = &statistics["interfaces"][0]["ids"][0]["period"];
    assert_eq!(
        (&period["mean_ms"], &period["max_ms"]),
        (&100.0.into(), &100.0.into())
    );
}

/// Two logs of the same second, one after the other, are two seconds of a bus, and no bus of twice the load.
#[test]
fn a_log_after_another_of_the_same_time_has_its_load() {
    let one: String = (0..1000_u64)
        .map(|n| format!("({}.{:03}000) can0 123#0011223344556677\n", 5, n))
        .collect();
    let load = |log: &str| {
        let (code, json, _) = trace("twice.log", log, &["stats", "--json"]);
        assert_eq!(code, 0);
        let statistics: serde_json::Value = serde_json::from_str(&json).unwrap();
        let bus = &statistics["interfaces"][0];
        let number = |key: &str| bus[key].as_f64().unwrap();
        (
            number("load"),
            number("peak_load"),
            statistics["span_s"].as_f64().unwrap(),
        )
    };
    let (single, twice) = (load(&one), load(&one.repeat(2)));
    assert!(
        (single.0 / twice.0 - 1.0).abs() < 0.01,
        "{single:?} {twice:?}"
    );
    assert!(
        (single.1 / twice.1 - 1.0).abs() < 0.02,
        "{single:?} {twice:?}"
    );
    assert_eq!((single.2, twice.2), (0.999, 1.998));
}

/// Interfaces whose clocks differ are no clock that was set.
#[test]
fn interfaces_may_be_ahead_of_each_other() {
    let log: String = (0..100)
        .map(|n| format!("(50.{n:02}0000) can0 123#\n(1.{n:02}0000) can1 123#\n"))
        .collect();
    let (_, json, _) = trace("ahead.log", &log, &["stats", "--json"]);
    let statistics: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(statistics["backwards"], 0);
    assert_eq!(statistics["span_s"], 0.99);
    assert_eq!(statistics["interfaces"][1]["span_s"], 0.99);
}

#[test]
fn gaps_below_the_period_are_no_gaps() {
    let log: String = (0..1000)
        .map(|n| format!("(5.{n:03}000) can0 123#\n(5.{n:03}150) can0 124#\n"))
        .collect();
    let stats = |skip| trace("gaps.log", &log, &["stats", "--skip-gaps", skip]);
    for skip in ["0", "0.0001", "0.0005"] {
        let (code, text, messages) = stats(skip);
        assert_eq!((code, text.as_str()), (2, ""), "{skip}");
        assert!(messages.contains("0.00"), "{messages}");
    }
    for skip in ["0.001", "1"] {
        let (code, text, _) = stats(skip);
        assert_eq!(code, 0, "{skip}: {text}");
    }
    // What is more than a bus can carry is said.
    let (_, text, _) = trace("gaps.log", &log, &["stats", "--bitrate", "50k"]);
    assert!(text.contains("no bus carries more than 100 %"), "{text}");
}

/// Nine of ten periods within the 90 % range, all of them in the histogram.
#[test]
fn periods_have_a_distribution() {
    let mut time = 1_000_000_u64;
    let log: String = (0..=1000_u64)
        .map(|n| {
            // 900 to 1099 us in mixed order, and occasionally 50 ms.
            time += if n % 100 == 99 {
                50_000
            } else {
                900 + n * 37 % 200
            };
            format!("({}.{:06}) can0 123#\n", time / 1_000_000, time % 1_000_000)
        })
        .collect();
    let (_, json, _) = trace("periods.log", &log, &["stats", "--json"]);
    let statistics: serde_json::Value = serde_json::from_str(&json).unwrap();
    let period = &statistics["interfaces"][0]["ids"][0]["period"];
    let [low, high] = [0, 1].map(|k| period["range_90_ms"][k].as_f64().unwrap());
    assert!(
        (0.905..0.915).contains(&low) && (1.085..1.1).contains(&high),
        "{low} to {high}"
    );
    let bins = period["histogram"].as_array().unwrap();
    assert_eq!(
        bins.iter()
            .map(|bin| bin["count"].as_u64().unwrap())
            .sum::<u64>(),
        1000
    );
    let (_, text, _) = trace("periods.log", &log, &["stats", "--histogram"]);
    assert!(
        text.contains("periods of 123 - on can0, ms") && text.contains("####"),
        "{text}"
    );
}

#[test]
fn compressed_logs_and_our_own_formats_are_read() {
    let log = fs::read(&*RUN).unwrap();
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(&log).unwrap();
    let packed = packed.finish().unwrap();
    let (_, expected, _) = of_file(&RUN, &["check"]);
    assert_eq!(trace("run.log.gz", &packed, &["check"]).1, expected);
    // Half of it: the readable part is shown, and reported as incomplete.
    let (code, decoded, messages) = trace("half.gz", &packed[..packed.len() / 2], &["decode"]);
    assert_eq!(code, 1);
    assert!(
        decoded.lines().count() > 100 && messages.contains("half.gz"),
        "{messages}"
    );
    for format in ["asc", "pcapng"] {
        let path = FOLDER.path().join(format);
        let path = path.to_str().unwrap();
        assert_eq!(
            of_file(&RUN, &["convert", "--to", format, "--out", path]).0,
            0
        );
        assert_eq!(of_file(Path::new(path), &["check"]).1, expected);
        let back = of_file(Path::new(path), &["convert", "--to", "candump"]).1;
        assert!(back.as_bytes() == log, "{format}");
    }
}

/// The header of an ASC file is in local time, as its readers expect.
#[test]
fn asc_is_in_local_time() {
    let path = FOLDER.path().join("zone.log");
    fs::write(&path, "(1720000000.000475) can0 123#00\n").unwrap();
    let asc = command(&["trace", "convert", path.to_str().unwrap(), "--to", "asc"])
        .env("TZ", "UTC-5:30")
        .output()
        .unwrap()
        .stdout;
    let asc = String::from_utf8(asc).unwrap();
    // date -u -d @1720000000 is 09:46:40.
    assert!(
        asc.starts_with("date Wed Jul 03 15:16:40.000 2024\n"),
        "{asc}"
    );
}
