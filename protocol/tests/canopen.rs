//! The message table against CANopen (CiA 301), and which messages may go without protection.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use protocol::e2e::Profile;
use protocol::messages::*;
use protocol::schema::Content;
use protocol::table::TABLE;

/// CiA 301, predefined connection set, for node n = 40h, 41h, 42h.
#[test]
fn identifiers_follow_canopen() {
    for info in TABLE {
        let node = |base: u16| Node::try_from((info.id - base) as u8).unwrap();
        match info.content {
            Content::Nmt => assert_eq!(info.id, 0),
            Content::Emergency(n) => assert_eq!((node(0x080), info.sender), (n, Some(n))),
            Content::Feedback => assert_eq!(
                (node(0x180), info.sender),
                (Node::Drives, Some(Node::Drives))
            ),
            Content::Command => assert_eq!(
                (node(0x200), info.receiver),
                (Node::Drives, Some(Node::Drives))
            ),
            Content::ParameterReply(server) => {
                assert_eq!(
                    (node(0x580), info.sender),
                    (server.node(), Some(server.node()))
                );
            }
            Content::ParameterRequest(server) => {
                assert_eq!(
                    (node(0x600), info.receiver),
                    (server.node(), Some(server.node()))
                );
            }
            Content::Heartbeat(n) => assert_eq!((node(0x700), info.sender), (n, Some(n))),
            Content::EStop | Content::Motion | Content::State | Content::MotionReply => {}
        }
    }
}

/// Only what CANopen fixes, or what must be obeyed even if damaged, goes without protection.
#[test]
fn what_is_acted_upon_is_protected() {
    for info in TABLE {
        let expected = match info.content {
            Content::Nmt | Content::EStop | Content::Emergency(_) => None,
            Content::Heartbeat(_) => Some(Profile::Classical),
            _ => Some(Profile::Fd),
        };
        assert_eq!(info.protection, expected, "{}", info.name);
    }
}

/// CiA 301: a code says whether there is an error, and which bit of the register goes with it.
#[test]
fn emergency_codes_agree_with_the_register() {
    for &cause in Cause::ALL {
        let (code, register) = (cause.error_code(), cause.error_register());
        assert_eq!(register & 1 == 1, cause != Cause::None, "{cause}");
        assert_eq!(code == 0, cause == Cause::None, "{cause}");
        for (bit, of_code) in [
            (1, code >> 8 == 0x23),
            (4, matches!(code >> 8, 0x81 | 0x82)),
            (5, matches!(code >> 8, 0x73 | 0x83..=0x86)),
        ] {
            assert_eq!(register >> bit & 1 == 1, of_code, "{cause}, bit {bit}");
        }
    }
}
