//! Every exit code of docs/exit-codes.md, as a shell sees it.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::process::{Command, Output, exit};

use terminal::guard;

/// Set in the process that has to panic.
const PANICS: &str = "PLANT_SIM_TEST_PANICS";

fn plant_sim(arguments: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("empty.log"), "").unwrap();
    fs::write(
        folder.path().join("bad.log"),
        "(0.000000) can0 1C0##1FFFF\n",
    )
    .unwrap();
    Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(arguments)
        .current_dir(folder.path())
        .env("PATH", "")
        .output()
        .unwrap()
}

/// The exit code, with one message and no sign of a panic on standard error.
fn code(arguments: &[&str]) -> i32 {
    let output = plant_sim(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let code = output.status.code().unwrap();
    assert_eq!(said.is_empty(), code == 0, "{arguments:?}: {said}");
    assert!(
        !said.contains("panicked") && !said.contains("backtrace"),
        "{said}"
    );
    code
}

#[test]
fn done_is_0() {
    for done in [
        &["--cycles", "1"][..],
        &[
            "run",
            "--cycles",
            "1",
            "--model",
            "irb930-12-0.85",
            "--json",
        ],
        &[
            "run",
            "--scenario",
            "estop-descent",
            "--junit",
            "verdicts.xml",
        ],
        &[
            "run",
            "--cycles",
            "1",
            "--law",
            "pid",
            "--set",
            "requirements=[]",
        ],
        &["check"],
        &["check", "gate", "--set", "gains.bandwidth=80", "--json"],
        &["model", "irb930-12-0.85"],
        &["completions", "bash"],
        &["man"],
        &["man", "--out", "pages"],
        &["--help"],
        &["--version"],
    ] {
        assert_eq!(code(done), 0, "{done:?}");
    }
}

/// Whatever a command has to show, a full disk at its standard output is an error.
#[test]
fn output_that_cannot_be_written_is_1() {
    let folder = tempfile::tempdir().unwrap();
    let run = ["run", "--cycles", "1", "--quiet"];
    let recorded = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(run)
        .current_dir(folder.path())
        .status();
    assert!(recorded.unwrap().success());
    let log = "out/trace.log";
    for shows in [
        &["--help"][..],
        &["--version"],
        &["help", "run"],
        &["trace", "stats", "--help"],
        &["completions", "fish"],
        &["man"],
        &["schema", "plan"],
        &["schema", "plan", "--markdown"],
        &["parameters", "--markdown"],
        &["dbc"],
        &["dissector"],
        &["model"],
        &["check"],
        &["check", "--json"],
        &["run", "--cycles", "1", "--out", "other"],
        &["trace", "check", log],
        &["trace", "decode", log],
        &["trace", "stats", log],
        &["trace", "plot", log],
        &["trace", "convert", log, "--to", "pcapng"],
        &["campaign", "plan", "--count", "2"],
    ] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
            .args(shows)
            .current_dir(folder.path())
            .stdout(full)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{shows:?}: {said}");
        assert!(said.contains("cannot write to standard output"), "{said}");
    }
}

/// A refusal is a result of a check, for a program as well.
#[test]
fn what_a_check_refuses_is_in_its_json() {
    let arguments = ["check", "--json", "--set", "cycle[0].jump.top=-0.29"];
    let output = plant_sim(&arguments);
    assert_eq!(output.status.code(), Some(1));
    let plan: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let refused = &plan["refused"][0];
    assert_eq!(
        (&refused["cycle"], &refused["step"]),
        (&1.into(), &"cycle[0].jump".into())
    );
    assert!(
        refused["reason"]
            .as_str()
            .unwrap()
            .contains("parameter top")
    );
    let plan: serde_json::Value =
        serde_json::from_slice(&plant_sim(&["check", "--json"]).stdout).unwrap();
    assert_eq!(plan["refused"], serde_json::json!([]));
}

#[test]
fn a_run_or_check_that_failed_is_1() {
    // Ten times the friction and the weight end in a fault.
    let faulty = [
        "--set",
        "mismatch.friction=10",
        "--set",
        "mismatch.payload=10",
    ];
    for failed in [
        &[&["run", "--cycles", "1"][..], &faulty].concat()[..],
        // The gate requires more than this law can do.
        &["run", "--cycles", "1", "--law", "pid"],
        // Stopped, where the scenario says completed, and the other way round.
        &[
            "run",
            "--scenario",
            "estop-descent",
            "--set",
            "ends=completed",
        ],
        &["run", "--cycles", "1", "--set", "ends=stopped"],
        &["check", "--set", "cycle[0].jump.top=-0.29"],
        &["run", "--set", "cycle[0].jump.top=-0.29"],
        &["trace", "check", "bad.log"],
        // Nothing is built for it first: there is no cargo either.
        &["run", "--controller", "qemu"],
        &["cost"],
        &["crash"],
        &["timing", "--bus", "slcan:/nowhere", "--seconds", "1"],
    ] {
        assert_eq!(code(failed), 1, "{failed:?}");
    }
    for needs in [&["run", "--controller", "qemu"][..], &["cost"], &["crash"]] {
        let said = String::from_utf8(plant_sim(needs).stderr).unwrap();
        assert!(said.contains("needs qemu-system-arm"), "{needs:?}: {said}");
    }
}

/// 2^63: no seed of a scenario file is so great.
const TOO_GREAT: &str = "9223372036854775808";

#[test]
fn wrong_usage_or_input_is_2() {
    for wrong in [
        &["--cylces", "1"][..],
        &["run", "--scenario", "nowhere.toml"],
        &["run", "--model", "irb940"],
        &["run", "--cycles", "0"],
        &["run", "--rate", "nan"],
        &["run", "--payload", "-1"],
        &["run", "--scenario", "pick-place", "--payload", "0"],
        &["run", "--set", "gains.bandwidth"],
        &["run", "--set", "gains.bandwidth=1e9"],
        &["run", "--set", "start=[-0.5, -0.5, -0.2, 0.0]"],
        &["run", "--image", "image.elf"],
        &["run", "--image", "empty.log"],
        &["run", "--seed", "-1"],
        &["campaign", "plan", "--count", "1", "--seed", TOO_GREAT],
        &["run", "--seed", TOO_GREAT],
        &["run", "--payload", "2kg"],
        &["eval", "dynamics", "--elbow", "positive"],
        &["eval", "ik", "--turn", "9"],
        &["cost", "--image", "image.elf"],
        &["dbc", "--out", "-"],
        &["trace", "plot", "bad.log", "--out", "plot.png"],
        &["run", "--channel", "uart"],
        &["run", "--out", "empty.log"],
        &["run", "--out", "/dev/null"],
        &["run", "--junit", "."],
        &["check", "nowhere.toml"],
        &["trace", "check", "nowhere.log"],
        &["trace", "decode", "bad.log", "--out", "bad.log"],
        &["monitor", "--bus", "socketcan:vcan0"],
    ] {
        assert_eq!(code(wrong), 2, "{wrong:?}");
    }
}

#[test]
fn a_number_of_three_hundred_digits_is_said_in_five() {
    for option in ["--rate", "--payload", "--set=gains.bandwidth"] {
        let output = plant_sim(&["run", &format!("{option}=1e300")]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("1e300") && said.len() < 300, "{said}");
    }
}

#[test]
fn nothing_judged_is_3() {
    for tool in ["check", "replay", "decode", "stats", "plot"] {
        assert_eq!(code(&["trace", tool, "empty.log"]), 3, "{tool}");
    }
}

#[test]
fn a_fault_of_our_own_is_70_and_one_line_for_a_report() {
    if std::env::var_os(PANICS).is_some() {
        exit(guard("plant-sim", "1.2.3", || panic!("two\nlines")).into());
    }
    let output = Command::new(std::env::current_exe().unwrap())
        .args([
            "--exact",
            "a_fault_of_our_own_is_70_and_one_line_for_a_report",
        ])
        .arg("--nocapture")
        .env(PANICS, "yes")
        .env_remove("RUST_BACKTRACE")
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(70), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    for word in [
        "plant-sim: this is a fault of the program itself, version 1.2.3, at ",
        "exit_codes.rs",
        "two lines",
        "report",
    ] {
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn the_page_has_these_codes_and_no_others() {
    let page = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../docs/exit-codes.md"
    ))
    .unwrap();
    let codes: Vec<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split(' ').next())
        .filter(|code| code.parse::<u8>().is_ok())
        .collect();
    assert_eq!(codes, ["0", "1", "2", "3", "70", "130"]);
}

#[test]
fn a_name_that_is_nearly_right_is_recognised() {
    for (args, meant) in [
        (["run", "gaet"], "gate"),
        (["check", "palletize"], "palletise"),
        (["--model", "irb930-12-0.8"], "irb930-12-0.85"),
        (["--law", "computed-torq"], "computed-torque"),
    ] {
        let output = plant_sim(&args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(error.contains(&format!("did you mean {meant}?")), "{error}");
    }
}

#[test]
fn what_is_built_in_is_named_in_help_and_refusals() {
    let help = String::from_utf8(plant_sim(&["run", "--help"]).stdout).unwrap();
    let words: Vec<&str> = help.split_whitespace().collect();
    let help = words.join(" ");
    let refused = String::from_utf8(plant_sim(&["run", "--model", "none"]).stderr).unwrap();
    for name in sim::model::names() {
        assert!(help.contains(name) && refused.contains(name), "{name}");
    }
    for name in sim::scenario::names() {
        assert!(help.contains(name), "{name}");
    }
}

/// The help of a command begins with what the list of commands says of it.
#[test]
fn help_begins_with_what_a_command_does() {
    let help = |arguments: &[&str]| String::from_utf8(plant_sim(arguments).stdout).unwrap();
    for group in [&[][..], &["campaign"], &["bench"], &["trace"]] {
        let list = help(&[group, &["--help"]].concat());
        let commands: Vec<_> = list
            .lines()
            .skip_while(|line| *line != "Commands:")
            .skip(1)
            .map_while(|line| line.strip_prefix("  "))
            .filter(|line| !line.starts_with(' '))
            .filter_map(|line| line.split_once(' '))
            .filter(|(name, _)| *name != "help")
            .collect();
        assert!(!commands.is_empty(), "{list}");
        for (name, does) in commands {
            let own = help(&[group, &[name, "--help"]].concat());
            let begins = own.lines().next().unwrap();
            // Either may go on in its next line.
            let does = does.trim().split(" [alias").next().unwrap();
            let short = does.len().min(begins.len());
            assert_eq!(begins[..short], does[..short], "{name}");
        }
    }
}

#[test]
fn a_robot_that_hangs_is_refused_by_file_and_key() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hangs.json");
    let text = include_str!("../models/irb930-22-1.05.json");
    let hangs = text.replace("[0.0, 0.0, -9.81]", "[0.0, 0.0, 9.81]");
    std::fs::write(&file, hangs).unwrap();
    let file = file.to_str().unwrap();
    for arguments in [
        &["check", "--model", file][..],
        &["check", "--plant-model", file],
        &["model", file],
    ] {
        let output = plant_sim(arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{error}");
        let place = format!("{file}: line 4, column ");
        assert!(error.contains(&place), "{error}");
        assert!(
            error.contains("gravity[2] is 9.81; it must be a number from -100 to 0 m/s2"),
            "{error}"
        );
        assert!(
            error.contains("a robot that hangs is not supported"),
            "{error}"
        );
    }
}
