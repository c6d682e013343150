//! Traces played onto a serial line with a socket of the test at its other end. SocketCAN: `tests/ci/10-vcan.sh`.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use link::{Link, LinkAddress, LinkError, SlcanPeer};
use plant_sim::play::{Pace, PlayError, Played, Player};
use proptest::prelude::*;
use protocol::frame::{CanFrame, ExtendedId, StandardId};
use trace::{Entry, ErrorFrame, Interface, Record};

fn adapter() -> (Link, TcpStream) {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = SlcanPeer::Tcp(server.local_addr().unwrap().to_string());
    let link = Link::open(&LinkAddress::Slcan(address)).unwrap();
    (link, server.accept().unwrap().0)
}

fn record(time_us: u64, frame: CanFrame) -> Record {
    Record {
        time_us,
        interface: Interface::CAN0,
        direction: None,
        entry: Entry::Frame(frame),
    }
}

fn long_frame() -> CanFrame {
    CanFrame::fd(StandardId::new(0x1C0).unwrap(), &[0xA5; 64], true).unwrap()
}

#[test]
fn every_frame_is_played_in_order_and_none_before_its_time() {
    let (link, mut peer) = adapter();
    let heard = thread::spawn(move || {
        let mut text = String::new();
        peer.read_to_string(&mut text).unwrap();
        text
    });
    let classical = CanFrame::classical(ExtendedId::new(0x123).unwrap(), &[1, 2]).unwrap();
    let error = Record {
        time_us: 5_000,
        interface: Interface::CAN0,
        direction: None,
        entry: Entry::Error(ErrorFrame::new(0x40, &[0; 8]).unwrap()),
    };
    let mut player = Player::new(link, Pace::new(2.0, None));
    let begun = Instant::now();
    player.record(&record(1_000, classical)).unwrap();
    player.record(&error).unwrap();
    player.record(&record(201_000, long_frame())).unwrap();
    // 200 ms at twice the speed. A lower bound holds on any machine.
    assert!(begun.elapsed() >= Duration::from_millis(100));
    let played = player.finish().unwrap();
    assert_eq!(
        played,
        Played {
            frames: 2,
            waited: 0,
            left_out: 1,
            lost: 0
        }
    );
    let expected = format!(
        "\rC\rS8\rY5\rZ0\rO\rT0000012320102\rb1C0F{}\r",
        "A5".repeat(64)
    );
    assert_eq!(heard.join().unwrap(), expected);
}

#[test]
fn a_slow_reader_delays_and_loses_nothing() {
    // More than the buffers of any socket can hold: megabytes.
    const FRAMES: u64 = 100_000;
    let (link, mut peer) = adapter();
    let mut player = Player::new(link, Pace::new(0.0, None));
    let heard = thread::spawn(move || {
        // The reader starts only once the buffers are full.
        thread::sleep(Duration::from_millis(300));
        let mut text = Vec::new();
        peer.read_to_end(&mut text).unwrap();
        text.iter().filter(|&&byte| byte == b'b').count() as u64
    });
    for time_us in 0..FRAMES {
        player.record(&record(time_us, long_frame())).unwrap();
    }
    let played = player.finish().unwrap();
    assert_eq!((played.frames, played.lost), (FRAMES, 0));
    assert_eq!(heard.join().unwrap(), FRAMES);
}

#[test]
fn a_bus_that_takes_nothing_is_given_up() {
    let (link, _peer) = adapter();
    let mut player = Player::new(link, Pace::new(0.0, None));
    let ended = (0..1_000_000).find_map(|_| player.record(&record(0, long_frame())).err());
    assert!(matches!(ended, Some(PlayError::Stuck)), "{ended:?}");
}

#[test]
fn a_peer_that_has_gone_is_named() {
    let (link, peer) = adapter();
    drop(peer);
    let mut player = Player::new(link, Pace::new(0.0, None));
    let ended = (0..1_000_000).find_map(|_| player.record(&record(0, long_frame())).err());
    assert!(
        matches!(ended, Some(PlayError::Link(LinkError::Closed { .. }))),
        "{ended:?}"
    );
}

proptest! {
    #[test]
    fn frames_are_due_at_their_share_of_the_recorded_time(
        times in prop::collection::vec(any::<u32>(), 1..50),
        speed in 0.001..1000.0_f64,
    ) {
        let mut pace = Pace::new(speed, None);
        let mut latest = 0.0_f64;
        for &time in &times {
            let recorded = f64::from(time.saturating_sub(times[0])) * 1e-6;
            latest = latest.max(recorded / speed);
            // A duration counts nanoseconds; the two computations round a few times each.
            let allowed = 1e-9 + latest * 4.0 * f64::EPSILON;
            prop_assert!((pace.due(u64::from(time)).as_secs_f64() - latest).abs() <= allowed);
        }
    }

    #[test]
    fn without_pauses_all_are_due_at_once(times in prop::collection::vec(any::<u64>(), 1..50)) {
        let mut pace = Pace::new(0.0, None);
        for time in times {
            prop_assert_eq!(pace.due(time), Duration::ZERO);
        }
    }
}
