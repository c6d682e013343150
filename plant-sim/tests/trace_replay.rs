//! What `trace replay` says of traces that it cannot repeat.

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

use protocol::codec;
use protocol::messages::{Hello, Message, ParameterRequest, Server};
use trace::{Entry, Interface, Reader, Writer};

fn plant_sim(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

#[test]
fn a_difference_comes_with_what_may_be_behind_it() {
    let folder = tempfile::tempdir().unwrap();
    let plant_sim = |arguments: &[&str]| plant_sim(folder.path(), arguments);
    let run = [
        "run",
        "--rate",
        "2000",
        "--cycles",
        "1",
        "--quiet",
        "--set",
        "requirements=[]",
    ];
    assert_eq!(plant_sim(&run).0, 0);
    let replay = |name: &str, rate: &str| plant_sim(&["trace", "replay", name, "--rate", rate]);
    assert_eq!(replay("out/trace.log", "2000").0, 0);
    for rate in ["1000", "1900", "4000"] {
        let (code, said) = replay("out/trace.log", rate);
        assert_eq!(code, 1);
        assert!(
            said.contains("come at about 2000 Hz") && said.contains(&format!("--rate is {rate}")),
            "{said}"
        );
    }

    // Recorded with a message table of another time: the same, but for the hash of it.
    let log = fs::read(folder.path().join("out/trace.log")).unwrap();
    let mut older = Writer::new(Vec::new(), Interface::CAN0);
    for record in Reader::new(log.as_slice()) {
        let mut record = record.unwrap();
        if let Entry::Frame(frame) = &record.entry
            && let Ok(received) = codec::decode(frame)
            && let Message::ParameterRequest(Server::Controller, ParameterRequest::Hello(hello)) =
                received.message
        {
            let hello = ParameterRequest::Hello(Hello {
                schema: 0xABCD_EF01,
                ..hello
            });
            let hello = Message::ParameterRequest(Server::Controller, hello);
            record.entry = Entry::Frame(codec::encode(&hello, received.counter.unwrap()).unwrap());
        }
        older.record(&record).unwrap();
    }
    fs::write(folder.path().join("older.log"), older.finish().unwrap().0).unwrap();
    let (code, said) = replay("older.log", "2000");
    assert_eq!(code, 1);
    assert!(
        said.contains("schema abcdef01") && said.contains("the version that recorded it"),
        "{said}"
    );

    // The controller of another robot.
    let arguments = [
        "trace",
        "replay",
        "out/trace.log",
        "--rate",
        "2000",
        "--model",
    ];
    let (code, said) = plant_sim(&[&arguments[..], &["irb930-12-0.85"]].concat());
    assert_eq!(code, 1);
    assert!(
        said.contains("name its --model, --rate and --bitrate"),
        "{said}"
    );
}
