//! Codec: what is sent is received, and nothing else is.

mod common;

use std::collections::BTreeSet;

use common::{Bytes, command, feedback, heartbeat, message};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use protocol::codec::{self, DecodeError, EncodeError, Received, ValueError};
use protocol::counters::Counters;
use protocol::e2e::{Profile, Verdict};
use protocol::frame::{CanFrame, ExtendedId, StandardId};
use protocol::messages::*;
use protocol::schema::{Content, Kind, MessageInfo};
use protocol::table::{self, TABLE};

fn frame_of(id: u16, fd: bool, data: &[u8]) -> CanFrame {
    let id = StandardId::new(id).unwrap();
    if fd {
        CanFrame::fd(id, data, true)
    } else {
        CanFrame::classical(id, data)
    }
    .unwrap()
}

/// A frame with this body, zero-padded, and right protection: the sender's software is wrong, the wire is not.
fn protected(info: &MessageInfo, body: &[u8]) -> CanFrame {
    let mut data = vec![0; info.len];
    data[..body.len()].copy_from_slice(body);
    if let Some(profile) = info.protection {
        profile.protect(info.id, 1, &mut data);
    }
    frame_of(info.id, info.is_fd(), &data)
}

fn sample(strategy: impl Strategy<Value = Message>) -> Message {
    strategy
        .new_tree(&mut TestRunner::deterministic())
        .unwrap()
        .current()
}

proptest! {
    #[test]
    fn what_is_sent_is_received(message in message(), counter: u8) {
        let frame = codec::encode(&message, counter).unwrap();
        let info = table::of_frame(&frame).unwrap();
        let counter = info.protection.map(|profile| counter & profile.counter_max());
        prop_assert_eq!(codec::decode(&frame), Ok(Received { message, counter }));
        // Flags of the link do not matter.
        prop_assert_eq!(codec::decode(&frame.with_esi(true)), Ok(Received { message, counter }));
    }

    /// Bodies of random bytes under a right CRC: whatever is accepted has exactly one frame.
    #[test]
    fn what_is_received_could_have_been_sent(
        k in 0..TABLE.len(), noise in prop::collection::vec(any::<u8>(), 48), used in 0..48usize, tag in 0..12u8,
    ) {
        let info = TABLE[k];
        let mut body = noise[..info.body_len()].to_vec();
        body.iter_mut().skip(used).for_each(|byte| *byte = 0);
        // Small numbers in front reach the selectors.
        body.iter_mut().take(2).for_each(|byte| *byte = tag);
        let frame = protected(info, &body);
        if let Ok(Received { message, counter }) = codec::decode(&frame) {
            prop_assert_eq!(codec::encode(&message, counter.unwrap_or(0)), Ok(frame));
        }
    }

    /// Any bits where a float stands: the sender refuses exactly what the receiver would.
    #[test]
    fn sender_and_receiver_agree_on_floats(bits: u32, k in 0..4usize) {
        let mut torque = [0.0; 4];
        torque[k] = f32::from_bits(bits);
        let command = Command { sample: 0, control: ControlWord::EMPTY, torque };
        let mut body = [0; 21];
        body[5 + 4 * k..][..4].copy_from_slice(&bits.to_le_bytes());
        let received = codec::decode(&protected(&table::COMMAND, &body));
        let value = f32::from_bits(bits);
        match codec::encode(&Message::Command(command), 1) {
            Ok(frame) => {
                prop_assert!(value.abs() <= 200.0);
                prop_assert_eq!(received, codec::decode(&frame));
                prop_assert!(received.is_ok());
            }
            Err(EncodeError::Value(error)) => {
                // Bits, because a NaN does not equal itself.
                prop_assert_eq!(format!("{:?}", received), format!("{:?}", Err::<Received, _>(DecodeError::Value(error))));
                prop_assert_eq!(matches!(error, ValueError::NotFinite { .. }), !value.is_finite());
                prop_assert!(!value.is_finite() || value.abs() > 200.0);
            }
            Err(EncodeError::TooLong) => prop_assert!(false),
        }
    }

    /// The messages of every sample are not written again after reading: what is accepted must have one form without it.
    #[test]
    fn what_is_received_every_sample_has_one_form(
        k in 0..2usize, noise in prop::collection::vec(any::<u8>(), 48), place: prop::sample::Index,
    ) {
        let info = [&table::FEEDBACK, &table::COMMAND][k];
        let mut body = noise[..info.body_len()].to_vec();
        // Small exponents and no reserved bit, so that most are accepted; then every value of one byte.
        body[4] &= 0x0F;
        for signal in info.signals.iter().filter(|signal| matches!(signal.kind, Kind::F32 { .. })) {
            body[signal.offset..signal.end()].chunks_mut(4).for_each(|float| float[3] &= 0xBF);
        }
        let place = place.index(body.len());
        let mut accepted = 0;
        for byte in 0..=255 {
            body[place] = byte;
            let frame = protected(info, &body);
            if let Ok(Received { message, counter }) = codec::decode(&frame) {
                accepted += 1;
                prop_assert_eq!(codec::encode(&message, counter.unwrap()), Ok(frame));
            }
        }
        // The sets have bits to spare, and floats exponents.
        prop_assert!(accepted >= 16, "{} accepted", accepted);
    }

    #[test]
    fn random_frames_do_no_harm(id in 0..0x800u16, fd: bool, data in prop::collection::vec(any::<u8>(), 0..=64)) {
        let data = if fd { &data[..] } else { &data[..data.len().min(8)] };
        let _ = codec::decode(&frame_of(id, fd, data));
    }

    /// The sample says three flips of some 9 million.
    #[test]
    fn three_flips_in_feedback_are_found(message in feedback(), flips in prop::array::uniform3(0..384usize)) {
        prop_assume!(BTreeSet::from(flips).len() == 3);
        let frame = codec::encode(&message, 0).unwrap();
        let mut data = frame.data().to_vec();
        for bit in flips {
            data[bit / 8] ^= 1 << (bit % 8);
        }
        prop_assert_eq!(codec::decode(&frame_of(0x1C0, true, &data)), Err(DecodeError::Crc));
    }
}

/// Every element of the floats of every sample, on and next to the limits of the table.
#[test]
fn the_range_of_every_sample_is_that_of_the_table() {
    for info in [&table::FEEDBACK, &table::COMMAND] {
        for signal in info.signals {
            let Kind::F32 { min, max } = signal.kind else {
                continue;
            };
            for (k, &(element, _)) in signal.elements.iter().enumerate() {
                let result = |value: f32| {
                    let mut body = vec![0; info.body_len()];
                    body[signal.offset + 4 * k..][..4].copy_from_slice(&value.to_le_bytes());
                    codec::decode(&protected(info, &body)).map(|_| ())
                };
                for value in [min, -0.0, f32::MIN_POSITIVE, max] {
                    assert_eq!(result(value), Ok(()));
                }
                let signal = signal.name;
                for value in [min.next_down(), max.next_up(), f32::MIN, f32::MAX] {
                    let error = ValueError::OutOfRange {
                        signal,
                        element,
                        value,
                        min,
                        max,
                    };
                    assert_eq!(result(value), Err(DecodeError::Value(error)));
                }
                for value in [f32::NEG_INFINITY, f32::INFINITY, f32::NAN, -f32::NAN] {
                    let error = ValueError::NotFinite { signal, element };
                    assert_eq!(result(value), Err(DecodeError::Value(error)));
                }
            }
        }
    }
}

/// Every flip of one and two bits in the cyclic frames, and of three in the shortest.
#[test]
fn flips_are_found() {
    for (message, most) in [
        (sample(heartbeat()), 3),
        (sample(command()), 2),
        (sample(feedback()), 2),
    ] {
        let frame = codec::encode(&message, 0x55).unwrap();
        assert!(codec::decode(&frame).is_ok());
        let mut data = frame.data().to_vec();
        refuse_flips(&mut data, 0, most, &|data| {
            let frame = frame_of(frame.raw_id() as u16, frame.is_fd(), data);
            assert_eq!(codec::decode(&frame), Err(DecodeError::Crc));
        });
    }
}

fn refuse_flips(data: &mut [u8], from: usize, left: u32, check: &dyn Fn(&[u8])) {
    if left == 0 {
        return;
    }
    for bit in from..data.len() * 8 {
        data[bit / 8] ^= 1 << (bit % 8);
        check(data);
        refuse_flips(data, bit + 1, left - 1, check);
        data[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn identifiers_that_are_not_ours_are_unknown() {
    for id in 0..0x800u16 {
        let known = TABLE.iter().any(|info| info.id == id);
        let found = codec::decode(&frame_of(id, false, &[0; 3]));
        assert_eq!(found == Err(DecodeError::UnknownId), !known, "{id:#x}");
        // The 29-bit twins: same number, and same first 11 bits.
        for raw in [u32::from(id), u32::from(id) << 18] {
            let twin = CanFrame::classical(ExtendedId::new(raw).unwrap(), &[0; 2]).unwrap();
            assert_eq!(codec::decode(&twin), Err(DecodeError::UnknownId));
        }
    }
}

/// Every data length code, classical, remote and FD, on every identifier.
#[test]
fn format_and_length_must_be_those_of_the_message() {
    for info in TABLE {
        for len in (0..=64)
            .filter_map(protocol::frame::fd_length)
            .collect::<BTreeSet<_>>()
        {
            let data = vec![0x5A; len];
            let id = StandardId::new(info.id).unwrap();
            let frames = [
                (false, CanFrame::remote(id, len)),
                (!info.is_fd(), CanFrame::classical(id, &data)),
                (info.is_fd(), CanFrame::fd(id, &data, false)),
            ];
            for (right_kind, frame) in frames {
                let Some(frame) = frame else { continue };
                let found = codec::decode(&frame);
                if !right_kind {
                    assert_eq!(found, Err(DecodeError::WrongKind), "{frame}");
                } else if info.content == Content::EStop && len == 0 {
                    assert!(matches!(
                        found,
                        Ok(Received {
                            message: Message::EStop(_),
                            ..
                        })
                    ));
                } else if len != info.len {
                    assert_eq!(
                        found,
                        Err(DecodeError::WrongLength {
                            found: len,
                            expected: info.len
                        })
                    );
                } else {
                    assert!(!matches!(
                        found,
                        Err(DecodeError::WrongKind | DecodeError::WrongLength { .. })
                    ));
                }
            }
        }
    }
}

#[test]
fn every_emergency_stop_stops() {
    for reason in 0..=255 {
        let frame = frame_of(0x001, false, &[reason, 0]);
        assert!(matches!(
            codec::decode(&frame),
            Ok(Received {
                message: Message::EStop(_),
                ..
            })
        ));
    }
}

/// What postcard alone would let pass. The CRC is right in all of them.
#[test]
fn wrong_content_is_refused_by_cause() {
    use DecodeError::{Malformed, NotCanonical};
    let nan = f32::NAN.to_le_bytes();
    let not_finite =
        |signal, element| DecodeError::Value(ValueError::NotFinite { signal, element });
    let heartbeat = &table::DRIVES_HEARTBEAT;
    let mut long_counter = [1, 0, 0, 0x10, 0];
    // An 8-bit counter where 4 bits are due, under a CRC made for it.
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
            protected(&table::STATE, &[0, 0, 0, 0x40]),
            Malformed,
        ),
        (
            "unknown tag",
            protected(&table::MOTION, &[0, 10]),
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
    // A NaN where the selected variant has no float is padding, not a number.
    let enable = protected(&table::MOTION, &[&[0, 0][..], &nan].concat());
    assert_eq!(codec::decode(&enable), Err(NotCanonical));
}

/// A random frame of the right length passes a CRC of w bits with probability 2^-w. Binomial with mean m and this small
/// a probability has a standard deviation of sqrt(m); three of them are allowed. The bytes are always the same ones.
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
    counters.judge(Verdict::Duplicate);
    counters.judge(Verdict::Stale(3));
    counters.judge(Verdict::Lost(5));
    counters.judge(Verdict::Fresh);
    counters.judge(Verdict::Initial);
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
        "1 of unknown identifier, 1 of the wrong format, 1 of the wrong length, 1 with a wrong CRC, 1 malformed, \
         1 not canonical, 1 not finite, 1 out of range, 1 duplicate, 1 stale, 5 lost"
    );
    for _ in 0..=u16::MAX {
        counters.refuse(&DecodeError::Crc);
    }
    assert_eq!((counters.crc, counters.dropped()), (u16::MAX, u16::MAX));
}

/// The table says which profile each identifier has; a frame of the other one is no frame of ours.
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
