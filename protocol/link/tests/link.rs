//! Addresses of links, and the serial link against a scripted peer. SocketCAN needs a kernel with CAN:
//! `tests/ci/10-vcan.sh`.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

use link::{Clients, Link, LinkAddress, LinkError, SlcanHub, SlcanPeer};
use protocol::bus::{Bus, Transmit, TransmitError};
use protocol::frame::{CanFrame, ExtendedId, StandardId};

/// Long enough for any machine; reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(20);

fn adapter() -> (Link, TcpStream) {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = SlcanPeer::Tcp(server.local_addr().unwrap().to_string());
    let link = Link::open(&LinkAddress::Slcan(address)).unwrap();
    let (peer, _) = server.accept().unwrap();
    peer.set_read_timeout(Some(LIMIT)).unwrap();
    (link, peer)
}

fn read(peer: &mut TcpStream, expected: &[u8]) {
    let mut buffer = vec![0; expected.len()];
    peer.read_exact(&mut buffer).unwrap();
    assert_eq!(
        String::from_utf8_lossy(&buffer),
        String::from_utf8_lossy(expected)
    );
}

const OPENING: &[u8] = b"\rC\rS8\rY5\rZ0\rO\r";

#[test]
fn addresses_read_back_as_they_were_written() {
    for text in [
        "socketcan:can0",
        "socketcan:vcan0",
        "slcan:/dev/ttyACM0",
        "slcan:tcp:localhost:29536",
        "slcan:tcp:[::1]:1",
        "slcan:listen:0.0.0.0:29536",
    ] {
        let address: LinkAddress = text.parse().unwrap();
        assert_eq!(address.to_string(), text);
    }
}

#[test]
fn what_is_no_address_is_refused_with_the_allowed_forms() {
    for text in [
        "",
        "can0",
        "socketcan:",
        "socketcan:../../etc",
        "socketcan:a name",
        "socketcan:sixteen-bytes-xx",
        "slcan:",
        "slcan:tcp:",
        "slcan:tcp:host",
        "slcan:listen:",
        "slcan:tcp::1",
        "slcan:tcp:host:65536",
        "udp:1",
    ] {
        let message = text.parse::<LinkAddress>().unwrap_err().to_string();
        assert!(message.contains("socketcan:INTERFACE"), "{message}");
    }
}

#[test]
fn interfaces_that_are_none_are_named() {
    let open = |name: &str| Link::open(&LinkAddress::SocketCan(name.into())).unwrap_err();
    assert!(matches!(open("nosuch0"), LinkError::NoInterface { name, .. } if name == "nosuch0"));
    assert!(open("nosuch0").may_pass() && !open("lo").may_pass());
    // Every Linux has a loopback interface, and it is not CAN.
    assert!(matches!(open("lo"), LinkError::NotCan { name } if name == "lo"));
}

#[test]
fn serial_link_opens_its_adapter_and_carries_frames_both_ways() {
    let (mut link, mut peer) = adapter();
    read(&mut peer, OPENING);

    let fd = CanFrame::fd(StandardId::new(0x1C0).unwrap(), &[0xA5; 24], true).unwrap();
    let classical = CanFrame::classical(ExtendedId::new(0x123).unwrap(), &[1, 2]).unwrap();
    link.transmit(&fd).unwrap();
    link.transmit(&classical).unwrap();
    let mut expected = b"b1C0C".to_vec();
    expected.extend(b"A5".repeat(24));
    expected.extend(b"\rT0000012320102\r");
    read(&mut peer, &expected);

    // Acknowledgements, a refusal and noise around two frames, the second in two pieces.
    assert_eq!(link.receive(), None);
    // The six lines of the opening are answered first, one by a refusal: the adapter does not know Z0.
    peer.write_all(b"\r\r\r\r\x07\r\rz\r\x07garbage\rt240211220FA1\r\nb1C0")
        .unwrap();
    assert!(link.wait(LIMIT).unwrap());
    let first = CanFrame::classical(StandardId::new(0x240).unwrap(), &[0x11, 0x22]).unwrap();
    assert_eq!(link.receive(), Some(first));
    peer.write_all(&expected[4..]).unwrap();
    let mut second = link.receive();
    while second.is_none() {
        assert!(link.wait(LIMIT).unwrap());
        second = link.receive();
    }
    assert_eq!(second, Some(fd));
    let Link::Slcan(port) = &link else {
        unreachable!("opened as slcan");
    };
    assert_eq!((port.refused(), port.unreadable()), (1, 1));
}

#[test]
fn a_peer_that_does_not_read_fills_the_queue_and_never_blocks() {
    let (mut link, _peer) = adapter();
    let frame = CanFrame::fd(StandardId::new(1).unwrap(), &[0; 64], true).unwrap();
    // The kernel's socket buffers are finite: some megabytes are more than enough.
    let refused = (0..1_000_000).find_map(|_| link.transmit(&frame).err());
    assert_eq!(refused, Some(TransmitError::QueueFull));
}

#[test]
fn a_peer_that_has_gone_is_reported() {
    let (mut link, peer) = adapter();
    drop(peer);
    let failure = loop {
        match link.wait(LIMIT) {
            Ok(_) => assert_eq!(link.receive(), None),
            Err(failure) => break failure,
        }
    };
    assert!(matches!(failure, LinkError::Closed { .. }), "{failure}");
}

fn hub(may: Clients) -> (SlcanHub, LinkAddress) {
    let hub = SlcanHub::bind("127.0.0.1:0", may).unwrap();
    let address = SlcanPeer::Tcp(hub.local_address().unwrap().to_string());
    (hub, LinkAddress::Slcan(address))
}

/// Lets the hub work until the link has a frame.
fn carried(hub: &mut SlcanHub, link: &mut Link) -> CanFrame {
    loop {
        hub.exchange();
        if link.wait(Duration::from_millis(1)).unwrap() {
            return link.receive().unwrap();
        }
    }
}

#[test]
fn what_one_client_of_a_hub_sends_all_others_receive_and_nobody_twice() {
    let (hub, address) = hub(Clients::TakePart);
    let mut links = [0, 1, 2].map(|_| Link::open(&address).unwrap());
    let frame = |id| CanFrame::fd(StandardId::new(id).unwrap(), &[id as u8; 48], true).unwrap();
    for link in &mut links {
        link.transmit(&frame(7)).unwrap();
    }
    // Once the hub has a client's frame it also has its opening, and all three receive the next frame.
    let mut link = Link::SlcanHub(hub);
    for _ in 0..3 {
        while !link.wait(LIMIT).unwrap() {}
        assert_eq!(link.receive(), Some(frame(7)));
    }
    let Link::SlcanHub(mut hub) = link else {
        unreachable!("made so");
    };
    hub.transmit(&frame(6)).unwrap();
    for link in &mut links {
        while carried(&mut hub, link) != frame(6) {}
    }
    let [first, second, third] = &mut links;
    first.transmit(&frame(8)).unwrap();
    assert_eq!(carried(&mut hub, second), frame(8));
    assert_eq!(carried(&mut hub, third), frame(8));
    hub.transmit(&frame(9)).unwrap();
    // The sender's own frame did not come back: the next one it receives is the hub's.
    assert_eq!(carried(&mut hub, first), frame(9));
}

#[test]
fn a_hub_to_watch_refuses_frames_and_answers_like_an_adapter() {
    let (mut hub, address) = hub(Clients::Watch);
    let LinkAddress::Slcan(SlcanPeer::Tcp(server)) = &address else {
        unreachable!("made so");
    };
    let mut peer = TcpStream::connect(server).unwrap();
    // As python-can opens a bus; then the queries of other programs, with their line ends.
    peer.write_all(b"C\rS8\r\rO\rV\rN\rF\rt1230\r?\r").unwrap();
    peer.write_all(b"Z0\r\nM00000000\r\nmFFFFFFFF\r\nm00000000\r\ns031C\r\nX1\r\nX0\r\n")
        .unwrap();
    peer.set_nonblocking(true).unwrap();
    let expected = b"\r\r\r\rV1010\rN0001\rF00\r\x07\x07\r\r\r\x07\r\r\x07";
    let mut answer: Vec<u8> = Vec::new();
    while answer.len() < expected.len() {
        hub.exchange();
        let mut buffer = [0; 64];
        match peer.read(&mut buffer) {
            Ok(count) => answer.extend(&buffer[..count]),
            Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::WouldBlock),
        }
    }
    assert_eq!(answer, expected);
}

/// Checks that what a client receives is `expected`.
fn heard(hub: &mut SlcanHub, peer: &mut TcpStream, expected: &[u8]) {
    peer.set_nonblocking(true).unwrap();
    let mut answer: Vec<u8> = Vec::new();
    while answer.len() < expected.len() {
        hub.exchange();
        let mut buffer = [0; 64];
        match peer.read(&mut buffer) {
            Ok(count) => answer.extend(&buffer[..count]),
            Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::WouldBlock),
        }
    }
    assert_eq!(
        answer.escape_ascii().to_string(),
        expected.escape_ascii().to_string()
    );
}

fn connect(address: &LinkAddress) -> TcpStream {
    let LinkAddress::Slcan(SlcanPeer::Tcp(server)) = address else {
        unreachable!("made so");
    };
    TcpStream::connect(server).unwrap()
}

#[test]
fn a_client_that_listens_only_cannot_send() {
    let (mut hub, address) = hub(Clients::TakePart);
    let (mut listener, mut other) = (connect(&address), connect(&address));
    other.write_all(b"O\r").unwrap();
    heard(&mut hub, &mut other, b"\r");
    listener.write_all(b"L\rt0010\rO\rt0020\r").unwrap();
    heard(&mut hub, &mut listener, b"\r\x07\r\r");
    // Only the frame of the open channel is forwarded.
    heard(&mut hub, &mut other, b"t0020\r");
    let mut link = Link::SlcanHub(hub);
    let frame = CanFrame::classical(StandardId::new(2).unwrap(), &[]).unwrap();
    assert_eq!(link.receive(), Some(frame));
    assert_eq!(link.receive(), None);
}

#[test]
fn clients_come_and_go_while_others_listen_and_get_timestamps_if_they_ask() {
    let (mut hub, address) = hub(Clients::Watch);
    let mut first = connect(&address);
    first.write_all(b"O\r").unwrap();
    heard(&mut hub, &mut first, b"\r");
    let mut second = connect(&address);
    second.write_all(b"Z1\rO\r").unwrap();
    heard(&mut hub, &mut second, b"\r\r");
    let frame = CanFrame::classical(StandardId::new(0x123).unwrap(), &[0xAB]).unwrap();
    hub.transmit(&frame).unwrap();
    heard(&mut hub, &mut first, b"t1231AB\r");
    let mut stamped = [0; 12];
    second.set_nonblocking(false).unwrap();
    second.read_exact(&mut stamped).unwrap();
    assert!(stamped.starts_with(b"t1231AB") && stamped.ends_with(b"\r"));
    let milliseconds = std::str::from_utf8(&stamped[7..11]).unwrap();
    assert!(u16::from_str_radix(milliseconds, 16).unwrap() < 60_000);
    // Once closed it receives nothing but its answer, and the other continues.
    first.write_all(b"C\r").unwrap();
    heard(&mut hub, &mut first, b"\r");
    hub.transmit(&frame).unwrap();
    first.write_all(b"V\r").unwrap();
    heard(&mut hub, &mut first, b"V1010\r");
    drop(first);
    second.read_exact(&mut stamped).unwrap();
    while hub.is_open() {
        second.shutdown(std::net::Shutdown::Both).unwrap();
        hub.exchange();
    }
}

/// A client that sends as fast as it can and reads no answers is held back, and the node can always drain its queue.
#[test]
fn a_flood_is_held_back() {
    for may in [Clients::TakePart, Clients::Watch] {
        let (hub, address) = hub(may);
        let mut flood = connect(&address);
        flood.write_all(b"O\r").unwrap();
        flood.set_nonblocking(true).unwrap();
        let lines = b"t0000\r".repeat(10_000);
        let mut link = Link::SlcanHub(hub);
        let mut sent = 0;
        let mut stalled = 0;
        // Nobody takes a frame or reads an answer: some buffers fill up, then sending stalls.
        while stalled < 200 {
            match flood.write(&lines) {
                Ok(count) => (sent, stalled) = (sent + count, 0),
                Err(error) => {
                    assert_eq!(error.kind(), std::io::ErrorKind::WouldBlock);
                    stalled += 1;
                }
            }
            link.wait(Duration::from_millis(1)).unwrap();
            assert!(sent < 1 << 26, "{sent} bytes taken");
        }
        // What waits is bounded, and one turn takes all of it.
        assert!(link.unsent() < 4096 * 139 + 4096);
        let waiting = std::iter::from_fn(|| link.receive()).count();
        assert!(waiting <= 4096 + 4096 / 6 + 1, "{waiting}");
        assert_eq!(waiting > 0, may == Clients::TakePart);
    }
}
