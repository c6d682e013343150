//! `plant-sim view`: strangers are kept out, viewers do not disturb the loop, and it ends in order.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod program;

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use plant_sim::view::{Air, Ear, ROOM, Scribe, Server, Session, Subject, Wish};
use protocol::messages::MotionRequest;
use protocol::time::Instant;
use protocol::wire::BitTiming;
use serde_json::json;
use sim::controller::InProcess;
use sim::model::RobotModel;
use sim::observer::Pace;
use sim::operator::Order;
use sim::record::TraceLog;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

/// Reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(20);

/// A server without a loop, and what is asked of it.
fn server() -> (Server, Receiver<Wish>) {
    let (asked, wishes) = sync_channel(8);
    let air = Arc::new(Air::default());
    let server = Server::start(0, "<p>page</p>".into(), &json!({}), air, Some(asked)).unwrap();
    (server, wishes)
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream
}

/// The answer to a request of these lines: status, and everything after it.
fn answer(address: SocketAddr, first: &str, lines: &[String], body: &str) -> (u16, String) {
    let mut stream = connect(address);
    let mut request = format!(
        "{first} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n",
        body.len()
    );
    for line in lines {
        request += &format!("{line}\r\n");
    }
    stream
        .write_all(format!("{request}\r\n{body}").as_bytes())
        .unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    (text[9..12].parse().unwrap(), text)
}

fn token(server: &Server) -> String {
    server.url().split_once('#').unwrap().1.to_owned()
}

#[test]
fn another_host_another_origin_and_no_token_are_refused() {
    let (server, wishes) = server();
    let address = server.address();
    let port = address.port();
    let host = format!("Host: 127.0.0.1:{port}");
    let bearer = format!("Authorization: Bearer {}", token(&server));
    let other = server_of_another_run();
    let stop = r#"{"stop":{}}"#;
    let cases: [(&str, Vec<String>, u16, &str); 13] = [
        ("GET /", vec![host.clone()], 200, "<p>page</p>"),
        (
            "GET /",
            vec![format!("Host: localhost:{port}")],
            200,
            "<p>page</p>",
        ),
        (
            "GET /",
            vec!["Host: bench.example".into()],
            403,
            "answers to 127.0.0.1",
        ),
        (
            "GET /",
            vec![format!("Host: bench.example:{port}")],
            403,
            "answers to 127.0.0.1",
        ),
        (
            "GET /",
            vec!["Host: 127.0.0.1:1".into()],
            403,
            "answers to 127.0.0.1",
        ),
        (
            "GET /stream",
            vec![format!("Host: bench.example:{port}")],
            403,
            "answers to 127.0.0.1",
        ),
        (
            "GET /stream",
            vec![host.clone(), "Origin: http://bench.example".into()],
            403,
            "comes from http://bench.example",
        ),
        (
            "POST /do",
            vec![
                host.clone(),
                bearer.clone(),
                "Origin: http://bench.example".into(),
            ],
            403,
            "comes from http://bench.example",
        ),
        (
            "POST /do",
            vec![host.clone(), bearer.clone(), "Origin: null".into()],
            403,
            "comes from null",
        ),
        (
            "POST /do",
            vec![
                host.clone(),
                bearer.clone(),
                "Origin: http://127.0.0.1:1".into(),
            ],
            403,
            "comes from http://127.0.0.1:1",
        ),
        ("POST /do", vec![host.clone()], 401, "needs the token"),
        (
            "POST /do",
            vec![host.clone(), format!("Authorization: Bearer {other}")],
            401,
            "of another run",
        ),
        (
            "POST /do",
            vec![host.clone(), format!("Authorization: {}", token(&server))],
            401,
            "needs the token",
        ),
    ];
    for (first, lines, status, text) in &cases {
        let (found, words) = answer(address, first, lines, stop);
        assert!(
            found == *status && words.contains(text),
            "{first} {lines:?}: {words}"
        );
        assert!(!words.to_lowercase().contains("set-cookie"), "{words}");
        assert!(words.contains("frame-ancestors 'none'"), "{words}");
    }
    assert!(wishes.try_recv().is_err(), "a stranger was listened to");

    let own = [host, bearer, format!("Origin: http://127.0.0.1:{port}")];
    assert_eq!(answer(address, "POST /do", &own, stop).0, 204);
    let wish = wishes.recv_timeout(LIMIT).unwrap();
    assert_eq!(wish, Wish::Order(Order::Request(MotionRequest::Stop)));

    for (body, text) in [
        ("stop", "not understood"),
        (r#"{"fly":{}}"#, "unknown variant `fly`"),
        (
            r#"{"law":{"law":"magic"}}"#,
            "no control law 'magic'; allowed: ",
        ),
        (
            r#"{"payload":{"mass":1,"colour":2}}"#,
            "unknown field `colour`",
        ),
        (
            r#"{"fault":{"fault":"encoder:knee:stuck","when":"at once","seconds":0}}"#,
            "there is no axis",
        ),
        (
            r#"{"fault":{"fault":"encoder:elbow:stuck","when":"at once","seconds":-1}}"#,
            "seconds is -1; allowed: a time, or 0 for what stays broken",
        ),
        (
            r#"{"jog":{"axis":"elbow","step":1,"sign":1,"speed":10}}"#,
            "have sent no feedback yet",
        ),
    ] {
        let (status, words) = answer(address, "POST /do", &own, body);
        assert!(status == 400 && words.contains(text), "{body}: {words}");
    }
    let (status, _) = answer(
        address,
        "POST /do",
        &own,
        &format!("{stop}{}", " ".repeat(5000)),
    );
    assert_eq!(status, 413);
}

fn server_of_another_run() -> String {
    token(&server().0)
}

/// Ends a run after so many samples.
struct Samples(u32);

impl Pace for Samples {
    fn sample(&mut self, _: Instant) -> io::Result<()> {
        self.0 = self.0.checked_sub(1).ok_or(io::ErrorKind::Interrupted)?;
        Ok(())
    }
}

/// Those who look: they read until they have seen what they wait for, or they do not read.
type Viewers = (Vec<JoinHandle<()>>, Vec<TcpStream>);

/// Lives for four seconds under the eyes of these viewers; the trace, and how many looked at a time.
fn lived(look: impl FnOnce(SocketAddr) -> Viewers) -> (Vec<u8>, usize) {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 3;
    let config = RunConfig::new(scenario);
    let (ear, heard) = sync_channel(ROOM);
    let (asked, wishes) = sync_channel(8);
    let subject = Subject {
        title: "gate".into(),
        bus: "builtin".into(),
        robot: RobotModel::irb_930_22_105(),
        timing: BitTiming::default(),
        period_s: None,
        is_real: false,
    };
    let air = Arc::new(Air::default());
    let server = Server::start(
        0,
        String::new(),
        &subject.setup(&[]),
        Arc::clone(&air),
        Some(asked),
    )
    .unwrap();
    let scribe = Scribe::start(&subject, heard, Arc::clone(&air));
    let (readers, slow) = look(server.address());
    let session = Session::new(
        &config,
        |config| Ok(InProcess::new(config)),
        wishes,
        Ear::new(ear),
    )
    .unwrap();
    let mut trace = TraceLog::new(Vec::new());
    let done = session.run(&mut Samples(4000), &mut trace).unwrap();
    assert_eq!((done.good, done.bad), (1, 0), "the scenario is completed");
    scribe.join().unwrap();
    for reader in readers {
        reader.join().unwrap();
    }
    drop((slow, server));
    (trace.finish().unwrap().0, air.most_viewers())
}

/// Looks, if there is room.
fn try_to_look(address: SocketAddr) -> Option<TcpStream> {
    let mut stream = connect(address);
    write!(stream, "GET /stream HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut first = [0; 12];
    stream.read_exact(&mut first).unwrap();
    (&first == b"HTTP/1.1 200").then_some(stream)
}

fn look(address: SocketAddr) -> TcpStream {
    try_to_look(address).unwrap()
}

#[test]
fn viewers_that_read_that_do_not_and_that_vanish_change_no_byte_of_the_run() {
    let (alone, nobody) = lived(|_| Viewers::default());
    let (watched, most) = lived(|address| {
        let read = |stream: TcpStream| {
            let mut lines = BufReader::new(stream).lines();
            for part in ["event: setup", "scenario: completed", "event: glimpse"] {
                let seen = lines.any(|line| line.unwrap().contains(part));
                assert!(seen, "no {part}");
            }
        };
        let readers = (0..4).map(|_| look(address));
        let readers = readers.map(|stream| std::thread::spawn(move || read(stream)));
        let readers = readers.collect();
        let slow = (0..4).map(|_| look(address)).collect();
        drop([look(address), look(address)]);
        (readers, slow)
    });
    assert_eq!(nobody, 0);
    assert!(most >= 8, "{most} viewers");
    assert!(alone == watched, "the traces differ");
}

#[test]
fn there_is_room_for_so_many_viewers_and_no_more() {
    let (server, _wishes) = server();
    let mut viewers: Vec<TcpStream> = (0..64).map(|_| look(server.address())).collect();
    let host = format!("Host: {}", server.address());
    let full = || {
        answer(
            server.address(),
            "GET /stream",
            std::slice::from_ref(&host),
            "",
        )
    };
    let (status, words) = full();
    assert!(status == 503 && words.contains("64 viewers"), "{words}");
    viewers.truncate(60);
    // Those who left are noticed, sooner or later.
    while try_to_look(server.address()).is_none() {
        std::thread::yield_now();
    }
}
