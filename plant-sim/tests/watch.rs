//! `plant-sim run --listen`: every client is served as by an adapter, from the first to the last.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(20);

/// The next line of an adapter: up to a carriage return, or BEL alone.
fn line(input: &mut BufReader<TcpStream>) -> String {
    if input.fill_buf().unwrap().first() == Some(&0x07) {
        input.consume(1);
        return "\x07".into();
    }
    let mut line = Vec::new();
    input.read_until(b'\r', &mut line).unwrap();
    String::from_utf8(line).unwrap()
}

/// The next line that is not a frame.
fn answer(input: &mut BufReader<TcpStream>) -> String {
    loop {
        let line = line(input);
        if !line.starts_with(['t', 'b']) {
            return line;
        }
    }
}

#[test]
fn every_client_of_a_watched_run_is_served() {
    // A free port, assigned by the system.
    let server = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut run = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(["run", "--scenario", "gate", "--cycles", "1", "--listen"])
        .arg(format!("slcan:tcp:{server}"))
        .arg("--out")
        .arg(folder.path().join("out"))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut messages = BufReader::new(run.stderr.take().unwrap());
    let mut waiting = String::new();
    messages.read_line(&mut waiting).unwrap();
    assert!(waiting.contains("waiting for a client"), "{waiting}");

    let client = || {
        let stream = TcpStream::connect(server).unwrap();
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        (stream.try_clone().unwrap(), BufReader::new(stream))
    };
    let (mut first, mut heard_by_first) = client();
    first.write_all(b"O\r").unwrap();
    assert_eq!(line(&mut heard_by_first), "\r");
    assert!(line(&mut heard_by_first).starts_with(['t', 'b']));
    // The run continues in real time; the second client connects later.
    let (mut second, mut heard_by_second) = client();
    second.write_all(b"V\rO\r").unwrap();
    assert_eq!(answer(&mut heard_by_second), "V1010\r");
    assert_eq!(line(&mut heard_by_second), "\r");
    for _ in 0..100 {
        assert!(line(&mut heard_by_second).starts_with(['t', 'b']));
    }
    second.write_all(b"t0010\r").unwrap();
    assert_eq!(answer(&mut heard_by_second), "\x07");
    // A client that has closed receives no more frames, but is still answered.
    first.write_all(b"C\rV\r").unwrap();
    assert_eq!(answer(&mut heard_by_first), "\r");
    assert_eq!(line(&mut heard_by_first), "V1010\r");
    drop((first, heard_by_first));
    assert!(line(&mut heard_by_second).starts_with(['t', 'b']));
    drop((second, heard_by_second));
    // Without any client the run ends normally.
    assert!(run.wait().unwrap().success());
}
