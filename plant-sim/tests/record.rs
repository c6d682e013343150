//! Buses recorded: over slcan, whose other end is a socket of the test. SocketCAN: `tests/ci/12-peers.sh`.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs::{self, File};
use std::io::{BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use plant_sim::record::{RecordError, Recording};
use proptest::prelude::*;
use protocol::frame::{CanFrame, StandardId};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::{TempDir, tempdir};
use trace::{Entry, Interface, Reader, Record};

/// Long enough for any machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A program that records from an adapter of the test's own.
struct Recorder {
    child: Child,
    adapter: TcpStream,
}

impl Recorder {
    fn start(out: &Path, more: &[&str]) -> Self {
        let server = TcpListener::bind("127.0.0.1:0").unwrap();
        let child = record(
            &format!("slcan:tcp:{}", server.local_addr().unwrap()),
            out,
            more,
        );
        Self {
            child,
            adapter: server.accept().unwrap().0,
        }
    }

    fn send(&mut self, lines: &str) {
        self.adapter.write_all(lines.as_bytes()).unwrap();
    }

    fn end(self, signal: Signal) -> Output {
        kill_process(Pid::from_child(&self.child), signal).unwrap();
        self.child.wait_with_output().unwrap()
    }
}

fn record(bus: &str, out: &Path, more: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(["record", "--bus", bus, "--out"])
        .arg(out)
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn eventually(what: &str, mut is_so: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < PATIENCE, "{what}");
        thread::sleep(Duration::from_millis(10));
    }
}

fn part(path: &Path) -> PathBuf {
    path.with_extension("log.part")
}

/// What a log holds, without its times.
fn entries(path: &Path) -> Vec<String> {
    fs::read_to_string(path)
        .unwrap_or_default()
        .lines()
        .filter_map(|line| line.split_once(") ").map(|(_, entry)| entry.into()))
        .collect()
}

fn names(folder: &TempDir) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn every_signal_leaves_a_whole_log_and_the_counts() {
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        let folder = tempdir().unwrap();
        let out = folder.path().join("bus.log");
        let mut recorder = Recorder::start(&out, &[]);
        recorder.send("t1232AABB\rT18FF00010\rr1234\rd1C09112233445566778899AABBCC\r");
        // What came can be read while it is recorded.
        eventually("the frames are in the file", || {
            entries(&part(&out)).len() == 4
        });
        assert!(!out.exists());
        let output = recorder.end(signal);
        assert_eq!(output.status.code(), Some(0), "{signal:?} {output:?}");
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.starts_with("4 frames and 0 error frames"), "{said}");
        assert_eq!(
            entries(&out),
            [
                "can0 123#AABB",
                "can0 18FF0001#",
                "can0 123#R4",
                "can0 1C0##0112233445566778899AABBCC"
            ]
        );
        assert_eq!(names(&folder), ["bus.log"]);
    }
}

#[test]
fn what_cannot_be_read_is_counted_and_fails() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("bus.log");
    let mut recorder = Recorder::start(&out, &[]);
    recorder.send("t1232AA\rt1230\rt12x0\r");
    eventually("the frame is in the file", || {
        entries(&part(&out)).len() == 1
    });
    let output = recorder.end(Signal::INT);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("2 frames are not in the recording"), "{said}");
    assert_eq!(entries(&out), ["can0 123#"]);
}

#[test]
fn an_adapter_that_goes_leaves_its_frames() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("bus.log");
    let mut recorder = Recorder::start(&out, &[]);
    recorder.send("t1230\r");
    eventually("the frame is in the file", || {
        entries(&part(&out)).len() == 1
    });
    drop(recorder.adapter);
    let output = recorder.child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("has closed the connection")
    );
    let shown = String::from_utf8(output.stdout).unwrap();
    assert!(shown.starts_with("1 frames and 0 error frames"), "{shown}");
    assert_eq!(entries(&out), ["can0 123#"]);
}

#[test]
fn a_hub_records_what_its_clients_say_to_each_other() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("bus.log");
    // A port that was free a moment ago.
    let address = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let child = record(&format!("slcan:listen:{address}"), &out, &[]);
    let mut clients: Vec<TcpStream> = Vec::new();
    eventually("the hub listens", || {
        clients.extend(TcpStream::connect(address));
        clients.len() == 2
    });
    for client in &mut clients {
        client.write_all(b"O\r").unwrap();
        client.set_read_timeout(Some(PATIENCE)).unwrap();
        client.read_exact(&mut [0]).unwrap();
    }
    clients[0].write_all(b"t1231AA\r").unwrap();
    clients[1].read_exact(&mut [0; 8]).unwrap();
    clients[1].write_all(b"t1241BB\r").unwrap();
    eventually("the frames are in the file", || {
        entries(&part(&out)).len() == 2
    });
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    assert!(child.wait_with_output().unwrap().status.success());
    assert_eq!(entries(&out), ["can0 123#AA", "can0 124#BB"]);
}

#[test]
fn nothing_that_is_there_is_replaced() {
    let folder = tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("kept.log"), "precious").unwrap();
    fs::write(at("growing.log.part"), "").unwrap();
    fs::create_dir(at("folder.log")).unwrap();
    symlink(at("kept.log"), at("link.log")).unwrap();
    rustix::fs::mkfifoat(rustix::fs::CWD, at("pipe.log"), 0o600.into()).unwrap();
    let fails = |path: &Path, why: fn(&RecordError) -> bool| {
        let error = Recording::create(path, None).err().unwrap();
        assert!(why(&error), "{error}");
        assert!(error.to_string().contains(path.to_str().unwrap()));
    };
    fails(&at("kept.log"), |e| matches!(e, RecordError::Exists(_)));
    fails(&at("growing.log"), |e| {
        matches!(e, RecordError::Unfinished(_))
    });
    for name in ["folder.log", "link.log", "pipe.log"] {
        fails(&at(name), |e| matches!(e, RecordError::NoFile(_)));
    }
    fails(Path::new("/dev/null"), |e| {
        matches!(e, RecordError::NoFile(_))
    });
    fails(&at("bus.blf"), |e| matches!(e, RecordError::Format { .. }));
    assert_eq!(fs::read_to_string(at("kept.log")).unwrap(), "precious");
    // As mktemp leaves it.
    fs::write(at("empty.log"), "").unwrap();
    Recording::create(&at("empty.log"), None).unwrap();
}

/// Exit codes: 2 where the name is wrong, 1 where the bus is not there; neither leaves a file.
#[test]
fn a_recording_that_cannot_begin_leaves_nothing() {
    let folder = tempdir().unwrap();
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let bus = format!("slcan:tcp:{}", server.local_addr().unwrap());
    let output = record(&bus, Path::new("/dev/null"), &[])
        .wait_with_output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    drop(server);
    let output = record(&bus, &folder.path().join("bus.log"), &[])
        .wait_with_output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(names(&folder), [""; 0]);
}

/// A file that has appeared in the meantime stays, and so does what was recorded.
#[test]
fn a_name_taken_while_recording_is_left_alone() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("bus.log");
    let recording = Recording::create(&out, None).unwrap();
    fs::write(&out, "another's").unwrap();
    assert!(matches!(recording.finish(), Err(RecordError::Exists(_))));
    assert_eq!(fs::read_to_string(&out).unwrap(), "another's");
    assert!(part(&out).exists());
}

fn read(path: &Path) -> Vec<Record> {
    Reader::new(BufReader::new(File::open(path).unwrap()))
        .map(Result::unwrap)
        .collect()
}

proptest! {
    // Every file is waited for until the disk has it.
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// One after the other, the files hold what was recorded; each but the last has reached the size, and none is empty.
    #[test]
    fn files_by_size_hold_everything_in_order(
        data in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=64), 1..200),
        rotate in 1000..3000_u64,
        extension in prop::sample::select(vec!["log", "pcapng", "asc"]),
    ) {
        let folder = tempdir().unwrap();
        let mut recording =
            Recording::create(&folder.path().join(format!("a.{extension}")), Some(rotate)).unwrap();
        let records: Vec<Record> = data
            .iter()
            .enumerate()
            .map(|(index, data)| Record {
                // After 1970, which an ASC file needs in every time zone.
                time_us: 1_000_000_000_000_000 + index as u64,
                interface: Interface::CAN0,
                direction: None,
                entry: Entry::Frame(
                    CanFrame::fd(StandardId::new(0x1C0).unwrap(), data, true).unwrap(),
                ),
            })
            .collect();
        for record in &records {
            recording.record(record).unwrap();
        }
        let recorded = recording.finish().unwrap();
        let names = names(&folder);
        let numbered: Vec<String> = (1..=names.len())
            .map(|number| format!("a-{number:04}.{extension}"))
            .collect();
        prop_assert_eq!(&names, &numbered);
        prop_assert_eq!(recorded.files as usize, names.len());
        prop_assert_eq!(recorded.frames as usize, records.len());
        let paths = names.iter().map(|name| folder.path().join(name));
        let sizes: Vec<u64> = paths.clone().map(|path| fs::metadata(path).unwrap().len()).collect();
        prop_assert_eq!(recorded.bytes, sizes.iter().sum::<u64>());
        prop_assert!(sizes[..sizes.len() - 1].iter().all(|&size| size >= rotate));
        let found: Vec<Vec<Record>> = paths.map(|path| read(&path)).collect();
        prop_assert!(found.iter().all(|records| !records.is_empty()));
        let entries = |records: &[Record]| -> Vec<Entry> { records.iter().map(|r| r.entry).collect() };
        prop_assert_eq!(entries(&found.concat()), entries(&records));
    }
}
