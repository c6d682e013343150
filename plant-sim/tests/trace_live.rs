//! Inputs and outputs of `plant-sim trace`: live pipes, signals, files that must be kept.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

/// Frames of a foreign node, unknown to the protocol.
const FOREIGN: &str = "(1.000000) can0 123#00\n(1.100000) can0 123#01 T\n(1.300000) can0 124#\n";

/// `plant-sim trace` with these arguments: exit code, output, messages.
fn trace(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .arg("trace")
        .args(arguments)
        .output()
        .unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

/// The same with input from a pipe.
fn piped(subcommand: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(["trace", subcommand, "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn an_output_never_replaces_its_input() {
    let folder = tempfile::tempdir().unwrap();
    // A drawing has to be named .svg, so the trace is, too.
    let path = folder.path().join("precious.svg");
    let link = folder.path().join("link.svg");
    fs::write(&path, FOREIGN).unwrap();
    fs::hard_link(&path, &link).unwrap();
    let trace_text = path.to_str().unwrap();
    for out in [&path, &link] {
        let out = ["--out", out.to_str().unwrap()];
        for arguments in [
            &["convert", trace_text, "--to", "asc"][..],
            &["decode", trace_text],
            &["plot", trace_text],
        ] {
            let (code, _, messages) = trace(&[arguments, &out].concat());
            assert_ne!(code, 0);
            assert!(
                messages.contains("is an input of this command"),
                "{messages}"
            );
        }
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), FOREIGN);
}

#[test]
fn a_format_and_a_time_both_go_to_convert() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("to.log");
    fs::write(&path, FOREIGN).unwrap();
    let convert =
        |arguments: &[&str]| trace(&[&["convert", path.to_str().unwrap()], arguments].concat());
    let (code, text, _) = convert(&["--to", "candump", "--to", "1.1", "--from", "1.05"]);
    assert_eq!(
        (code, text.as_str()),
        (0, "(0000000001.100000) can0 123#01 T\n")
    );
    for wrong in [
        &["--to", "1.1"][..],
        &["--to", "asc", "--to", "candump"],
        &["--to", "blf"],
    ] {
        assert_ne!(convert(wrong).0, 0, "{wrong:?}");
    }
}

/// Every line is decoded on arrival, although the pipe stays open and the decoder's buffer is far from full.
#[test]
fn a_live_pipe_is_decoded_as_it_comes() {
    let mut child = piped("decode");
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    for line in FOREIGN.lines() {
        writeln!(input, "{line}").unwrap();
        let mut decoded = String::new();
        output.read_line(&mut decoded).unwrap();
        assert!(decoded.contains("unknown identifier"), "{decoded}");
    }
    drop(input);
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_signal_shows_what_there_is() {
    for (signal, subcommand) in [(Signal::INT, "stats"), (Signal::TERM, "decode")] {
        let mut child = piped(subcommand);
        let mut input = child.stdin.take().unwrap();
        input.write_all(FOREIGN.as_bytes()).unwrap();
        // Half a line: still incomplete.
        input.write_all(b"(1.400000) can0 12").unwrap();
        // The process must have installed its handler; a moment suffices, and a slow machine only weakens the test.
        std::thread::sleep(Duration::from_millis(500));
        kill_process(Pid::from_child(&child), signal).unwrap();
        let mut text = String::new();
        child
            .stdout
            .take()
            .unwrap()
            .read_to_string(&mut text)
            .unwrap();
        assert!(child.wait().unwrap().success());
        let expected = if subcommand == "stats" {
            "3 frames in 0.300000 s"
        } else {
            "1.300000 can0 124"
        };
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn a_message_whose_name_is_nearly_right_is_named() {
    for (text, near) in [
        ("Feedbak", Some("Feedback")),
        ("comand", Some("Command")),
        ("x", None),
    ] {
        let (code, _, said) = trace(&["stats", "nothing.log", "--id", text]);
        assert_eq!(code, 2);
        let hint = near.map(|near| format!("did you mean {near}?"));
        assert_eq!(said.contains("did you mean"), hint.is_some(), "{said}");
        assert!(hint.is_none_or(|hint| said.contains(&hint)), "{said}");
    }
}
