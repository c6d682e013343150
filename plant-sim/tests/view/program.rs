//! The program: what it refuses, and that it ends in order.

use std::fs::Permissions;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener};
use std::os::unix::fs::PermissionsExt as _;
use std::process::{Child, ChildStderr, Command, Output, Stdio};

use rustix::process::{Pid, Signal, kill_process};

use super::{answer, connect, look};

fn view(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plant-sim"));
    command.arg("view").args(arguments);
    command
}

fn refused(arguments: &[&str]) -> (i32, String) {
    let Output { status, stderr, .. } = view(arguments).output().unwrap();
    (status.code().unwrap(), String::from_utf8(stderr).unwrap())
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    for (arguments, code, text) in [
        (
            &["--no-open", "--port", &port][..],
            1,
            "is in use; name another one with --port",
        ),
        (
            &["--no-open", "--port", "70000"],
            2,
            "70000 is not in 0..=65535",
        ),
        (
            &["--no-open", "--port", "0", "--bus", "socketcan:none0"],
            1,
            "none0",
        ),
        (
            &["--bus", "socketcan:none0", "--law", "pid"],
            2,
            "cannot be used with",
        ),
        (
            &["--no-open", "--port", "0", "none"],
            2,
            "no scenario 'none'",
        ),
        (
            &["--no-open", "--port", "0", "--record", "/"],
            2,
            "not a regular file",
        ),
    ] {
        let (found, words) = refused(arguments);
        assert!(
            found == code && words.contains(text),
            "{arguments:?}: {found}, {words}"
        );
    }
}

/// Starts the program; its URL.
fn start(arguments: &[&str]) -> (Child, BufReader<ChildStderr>, String) {
    let mut program = view(&[&["--no-open", "--port", "0"], arguments].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(program.stderr.take().unwrap());
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    let url = line
        .trim()
        .split_once("the page is at ")
        .unwrap()
        .1
        .to_owned();
    (program, said, url)
}

/// Ends it as Ctrl-C does; what it has said of its work.
fn end(mut program: Child) -> String {
    kill_process(Pid::from_child(&program), Signal::INT).unwrap();
    let mut text = String::new();
    program
        .stdout
        .take()
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    assert!(program.wait().unwrap().success(), "{text}");
    text
}

#[test]
fn what_was_asked_for_is_in_the_recording_and_in_the_summary() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lived.log");
    let (program, _said, url) = start(&[
        "--scenario",
        "pick-place",
        "--record",
        file.to_str().unwrap(),
    ]);
    let (address, token) = url
        .strip_prefix("http://")
        .unwrap()
        .split_once("/#")
        .unwrap();
    let address: SocketAddr = address.parse().unwrap();
    let lines = [
        format!("Host: {address}"),
        format!("Authorization: Bearer {token}"),
    ];
    let ask = |body: &str| assert_eq!(answer(address, "POST /do", &lines, body).0, 204);
    let mut stream = BufReader::new(look(address));
    let mut until = |text: &str| {
        let mut line = String::new();
        while !line.contains(text) {
            line.clear();
            assert!(stream.read_line(&mut line).unwrap() > 0, "no {text}");
        }
    };
    until("\"mode\":\"moving\"");
    ask(r#"{"stop":{}}"#);
    until("stop: accepted");
    until("\"mode\":\"enabled\"");
    ask(r#"{"jog":{"axis":"elbow","step":2,"sign":-1,"speed":100}}"#);
    until("move-joint: accepted");
    ask(r#"{"law":{"law":"pd-gravity"}}"#);
    until("select-law");
    ask(r#"{"fault":{"fault":"encoder:wrist:jump=1","when":"at once","seconds":0}}"#);
    until("fault planted: encoder:wrist:jump=1@");
    let text = end(program);
    for part in [
        "planted: --fault encoder:wrist:jump=1@",
        "up to 1 viewers",
        "timing of ",
        "lived.log",
    ] {
        assert!(text.contains(part), "no {part} in {text}");
    }
    let replayed = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(["trace", "replay"])
        .arg(&file)
        .output()
        .unwrap();
    assert!(replayed.status.success(), "{replayed:?}");
}

#[test]
fn a_watched_bus_is_shown_and_not_asked_for_anything() {
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let bus = format!("slcan:listen:{free}");
    let (program, _said, url) = start(&["--bus", &bus]);
    let (address, token) = url
        .strip_prefix("http://")
        .unwrap()
        .split_once("/#")
        .unwrap();
    let address: SocketAddr = address.parse().unwrap();
    let lines = [
        format!("Host: {address}"),
        format!("Authorization: Bearer {token}"),
    ];
    let (status, words) = answer(address, "POST /do", &lines, r#"{"stop":{}}"#);
    assert!(status == 409 && words.contains("only watched"), "{words}");
    let mut stream = BufReader::new(look(address));
    let mut client = connect(free);
    // A frame of nobody's protocol.
    client.write_all(b"S8\rO\rt12321122\r").unwrap();
    let mut line = String::new();
    while !line.contains("\"id\":\"123\"") {
        line.clear();
        assert!(
            stream.read_line(&mut line).unwrap() > 0,
            "the frame is not shown"
        );
    }
    let text = end(program);
    assert!(text.contains("1 frames of slcan:listen:"), "{text}");
}

#[test]
fn the_page_opens_in_a_browser_unless_it_is_not_to() {
    let folder = tempfile::tempdir().unwrap();
    let (browser, opened) = (folder.path().join("xdg-open"), folder.path().join("opened"));
    // A new name appears with its content.
    let script = format!(
        "#!/bin/sh\necho \"$1\" >{0}.new\nmv {0}.new {0}\n",
        opened.display()
    );
    std::fs::write(&browser, script).unwrap();
    std::fs::set_permissions(&browser, Permissions::from_mode(0o755)).unwrap();
    let path = format!(
        "{}:{}",
        folder.path().display(),
        std::env::var("PATH").unwrap()
    );
    for no_open in [false, true] {
        let mut program = view(&["--port", "0"])
            .args(no_open.then_some("--no-open"))
            .env("PATH", &path)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(program.stderr.take().unwrap()).lines();
        let url = said.next().unwrap().unwrap();
        // Said after the browser has been started.
        assert!(
            said.next()
                .unwrap()
                .unwrap()
                .contains("begins when somebody looks")
        );
        if !no_open {
            while !opened.exists() {
                std::thread::yield_now();
            }
            let opened = std::fs::read_to_string(&opened).unwrap();
            assert!(
                opened.starts_with("http://127.0.0.1:") && url.ends_with(opened.trim()),
                "{opened}"
            );
            std::fs::remove_file(folder.path().join("opened")).unwrap();
        }
        end(program);
    }
    assert!(!opened.exists(), "--no-open opens a browser");
}
