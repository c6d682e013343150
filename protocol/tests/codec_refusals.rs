//! Codec: every wrong frame is refused with its cause.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::{Bytes, frame_of, protected};
use protocol::codec::{self, DecodeError, ValueError};
use protocol::counters::Counters;
use protocol::e2e::{Profile, Verdict};
use protocol::messages::*;
use protocol::table::{self};

/// What postcard alone would let pass. The CRC is right in all of them.
#[test]
fn wrong_content_is_refused_by_cause() {
    use DecodeError::{Malformed, NotCanonical};
    let nan = f32::NAN.to_le_bytes();
    let not_finite =
        |signal, element| DecodeError::Value(ValueError::NotFinite { signal, element });
    let heartbeat = &table::DRIVES_HEARTBEAT;
    let mut long_counter = [1, 0, 0, 0x10, 0];
    // An 8-bit counter in place of 4 bits, under a matching CRC.
    long_counter[4] = common::crc8(heartbeat.id, &long_counter[..4]);
    let cases = [
        (
            "unknown code",
            protected(heartbeat, &[0x7F, 0, 0]),
            Malformed,
        ),
        (
            "reserved bit",
            protected(&table::COMMAND, &[0, 0, 0, 0, 0x10]),
            Malformed,
        ),
        (
            "reserved bit",
            protected(&table::STATE, &[0, 0, 0, 0x80]),
            Malformed,
        ),
        (
            "unknown tag",
            protected(&table::MOTION, &[0, 14]),
            Malformed,
        ),
        (
            "unknown tag",
            protected(&table::MOTION_REPLY, &[0, 2]),
            Malformed,
        ),
        (
            "tag cut short",
            protected(&table::MOTION, &[0, 0x84]),
            NotCanonical,
        ),
        (
            "overlong tag",
            protected(&table::MOTION, &[0, 0x81, 0]),
            NotCanonical,
        ),
        (
            "padding",
            protected(&table::MOTION, &[0, 1, 0, 0, 1]),
            NotCanonical,
        ),
        (
            "padding",
            protected(
                &table::MOTION_REPLY,
                &[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 7],
            ),
            NotCanonical,
        ),
        (
            "wide counter",
            frame_of(heartbeat.id, false, &long_counter),
            NotCanonical,
        ),
        (
            "NaN",
            protected(&table::MOTION, &[&[0, 5, 0, 0, 0, 0][..], &nan].concat()),
            not_finite("line_target", "y"),
        ),
        (
            "infinity",
            protected(
                &table::CONTROLLER_PARAMETER_REPLY,
                &[&[0, 1, 0][..], &f32::NEG_INFINITY.to_le_bytes()].concat(),
            ),
            not_finite("value", ""),
        ),
        (
            "range",
            protected(
                &table::MOTION,
                &[&[0, 7][..], &(-1.0f32).to_le_bytes()].concat(),
            ),
            DecodeError::Value(ValueError::OutOfRange {
                signal: "payload_mass",
                element: "",
                value: -1.0,
                min: 0.0,
                max: 100.0,
            }),
        ),
    ];
    for (what, frame, error) in cases {
        assert_eq!(codec::decode(&frame), Err(error), "{what}: {frame}");
    }
    // NaN where the selected variant has no float is nonzero padding.
    let enable = protected(&table::MOTION, &[&[0, 0][..], &nan].concat());
    assert_eq!(codec::decode(&enable), Err(NotCanonical));
}

/// A random frame of the right length passes a CRC of w bits with probability 2^-w. A binomial distribution with mean m
/// and so small a probability has a standard deviation of sqrt(m); three of them are allowed. The bytes are always the
/// same.
#[test]
fn random_frames_pass_the_crc_as_often_as_chance_has_it() {
    for (info, frames, mean) in [
        (&table::DRIVES_HEARTBEAT, 1 << 18, 1024.0),
        (&table::COMMAND, 1 << 20, 16.0f64),
    ] {
        let mut bytes = Bytes(0x2545_F491_4F6C_DD1D);
        let passed = (0..frames)
            .filter(|_| {
                let data: Vec<u8> = (0..info.len).map(|_| bytes.next()).collect();
                codec::decode(&frame_of(info.id, info.is_fd(), &data)) != Err(DecodeError::Crc)
            })
            .count();
        assert!(
            (passed as f64 - mean).abs() <= 3.0 * mean.sqrt(),
            "{}: {passed}",
            info.name
        );
    }
}

#[test]
fn every_cause_is_counted_once() {
    let signal = ("", "");
    let errors = [
        DecodeError::UnknownId,
        DecodeError::WrongKind,
        DecodeError::WrongLength {
            found: 0,
            expected: 1,
        },
        DecodeError::Crc,
        DecodeError::Malformed,
        DecodeError::NotCanonical,
        DecodeError::Value(ValueError::NotFinite {
            signal: signal.0,
            element: signal.1,
        }),
        DecodeError::Value(ValueError::OutOfRange {
            signal: "",
            element: "",
            value: 2.0,
            min: 0.0,
            max: 1.0,
        }),
    ];
    let mut counters = Counters::default();
    assert_eq!(counters.to_string(), "none");
    for error in &errors {
        counters.refuse(error);
    }
    counters.count(Verdict::Duplicate);
    counters.count(Verdict::Stale(3));
    counters.count(Verdict::Lost(5));
    counters.count(Verdict::Fresh);
    counters.count(Verdict::Initial);
    let one_each = Counters {
        unknown_id: 1,
        wrong_kind: 1,
        wrong_length: 1,
        crc: 1,
        malformed: 1,
        not_canonical: 1,
        not_finite: 1,
        out_of_range: 1,
        duplicate: 1,
        stale: 1,
        lost: 5,
    };
    assert_eq!(counters, one_each);
    assert_eq!(counters.dropped(), errors.len() as u16 + 2);
    assert_eq!(
        counters.to_string(),
        "1 with an unknown identifier, 1 of the wrong format, 1 of the wrong length, 1 with a wrong CRC, 1 malformed, \
         1 not canonical, 1 not finite, 1 out of range, 1 duplicate, 1 stale, 5 lost"
    );
    for _ in 0..=u16::MAX {
        counters.refuse(&DecodeError::Crc);
    }
    assert_eq!((counters.crc, counters.dropped()), (u16::MAX, u16::MAX));
}

/// The table says which profile each identifier has; a frame with the other one is refused.
#[test]
fn a_frame_moved_to_another_identifier_is_refused() {
    for node in Node::ALL {
        for other in Node::ALL {
            let heartbeat = Heartbeat {
                state: Mode::Ready,
                cause: Cause::None,
                reset: ResetReason::PowerOn,
            };
            let frame = codec::encode(&Message::Heartbeat(*node, heartbeat), 3).unwrap();
            let moved = frame_of(table::heartbeat(*other).id, false, frame.data());
            assert_eq!(codec::decode(&moved).is_ok(), node == other);
        }
    }
    assert_eq!(
        table::heartbeat(Node::Drives).protection,
        Some(Profile::Classical)
    );
}
