//! Codec: what is sent is received, and nothing else.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use std::collections::BTreeSet;

use common::{command, feedback, frame_of, heartbeat, message, protected, sample};
use proptest::prelude::*;
use protocol::codec::{self, DecodeError, EncodeError, Received, ValueError};
use protocol::frame::{CanFrame, ExtendedId, StandardId};
use protocol::messages::*;
use protocol::schema::{Content, Kind};
use protocol::table::{self, TABLE};

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

    /// Any bits in place of a float: the sender refuses exactly what the receiver would.
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

    /// The messages of every sample are not re-encoded after reading: each accepted body must be the only form anyway.
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
        // Reserved bits and float exponents leave this many.
        prop_assert!(accepted >= 16, "{} accepted", accepted);
    }

    #[test]
    fn random_frames_do_no_harm(id in 0..0x800u16, fd: bool, data in prop::collection::vec(any::<u8>(), 0..=64)) {
        let data = if fd { &data[..] } else { &data[..data.len().min(8)] };
        let _ = codec::decode(&frame_of(id, fd, data));
    }

    /// Three flips in a sample of some 9 million.
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

/// Not one float but all four of a sample, next to the limits of the table: no two wrongs make a right.
#[test]
fn a_sample_of_nothing_but_bad_floats_is_refused() {
    for info in [&table::FEEDBACK, &table::COMMAND] {
        let signals = info.signals.iter();
        let (signal, max) = signals
            .filter_map(|signal| match signal.kind {
                Kind::F32 { max, .. } => Some((signal, max)),
                _ => None,
            })
            .next()
            .unwrap();
        for value in [max.next_up(), -max.next_up(), f32::INFINITY, f32::NAN] {
            let mut body = vec![0; info.body_len()];
            body[signal.offset..][..16].copy_from_slice(&value.to_le_bytes().repeat(4));
            let refused = codec::decode(&protected(info, &body));
            assert!(
                matches!(refused, Err(DecodeError::Value(_))),
                "{value}: {refused:?}"
            );
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
        let identified =
            |frame: &CanFrame| TABLE.iter().filter(|info| info.identifies(frame)).count();
        assert_eq!(identified(&frame_of(id, false, &[])), usize::from(known));
        // The 29-bit twins: same number, and same first 11 bits.
        for raw in [u32::from(id), u32::from(id) << 18] {
            let twin = CanFrame::classical(ExtendedId::new(raw).unwrap(), &[0; 2]).unwrap();
            assert_eq!(codec::decode(&twin), Err(DecodeError::UnknownId));
            assert_eq!(identified(&twin), 0);
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

/// Major, minor and patch of the version, a byte each.
#[test]
fn the_build_of_the_handshake_is_the_version() {
    let parts = env!("CARGO_PKG_VERSION").split('.');
    let build = parts.fold(0, |build, part| build * 256 + part.parse::<u32>().unwrap());
    assert_eq!(table::HELLO.build, build);
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
