//! Bad input on the wire: a node that receives it does what one without it does, to the bit, and counts it by cause.

use std::fmt::Write;

use protocol::codec::encode;
use protocol::e2e::Profile;
use protocol::frame::{CanFrame, ExtendedId, FD_MAX, Id, StandardId, fd_length_of_dlc};
use protocol::messages::{
    Cause, Heartbeat, Message, Mode, Motion, MotionRequest, Node as Name, ParameterRequest,
    ResetReason, Server,
};
use protocol::schema::{Kind, MessageInfo};
use protocol::table::{self, TABLE};

use crate::bench::Bench;
use crate::pair::{Bytes, Count, MOST, Pair};

// Frames of each test below, worked out by hand.
/// Every 11-bit identifier and both its 29-bit twins; 9 classical lengths, 9 remote ones, 16 of FD with and without bit
/// rate switch; without those that are right: each message of the table (FD twice, by its bit rate switch), and the empty
/// emergency stop.
const FORMATS: u32 = 2048 * 3 * (9 + 9 + 2 * 16) - (8 + 9 * 2) - 1;
/// One and two bits of 48 bytes, twice; up to three of 16 and of 5.
const FLIPS: u32 = 2 * ones_and_twos(48) + threes(16) + threes(5);
const RANDOM_CLASSICAL: u32 = 3 << 15;
const RANDOM_FD: u32 = 9 << 15;
/// Floats of the table, 400 of them NaN and two infinite; twice two out of range where the range ends before the floats do.
const FLOATS: u32 = 27_536;
/// 0 to 128 behind the newest counter, 256 times, of feedback and of requests.
const COUNTERS: u32 = 256 * 129 * 2;

/// What is sent, how many frames of it, and how it is counted, for the docs.
const SENT: [(&str, u32, &str); 5] = [
    (
        "every identifier of 11 bits and its two twins of 29, every length, classical, remote and FD",
        FORMATS,
        "unknown identifier, wrong format, wrong length",
    ),
    (
        "every flip of one and two bits of Feedback and Motion, of up to three of ParameterRequest and Heartbeat",
        FLIPS,
        "wrong CRC",
    ),
    (
        "random bytes of the right length; what the CRC lets through is within three standard deviations of chance",
        RANDOM_CLASSICAL + RANDOM_FD,
        "wrong CRC",
    ),
    (
        "NaN of any payload, infinity and numbers out of range in every float of every message",
        FLOATS,
        "not finite, out of range",
    ),
    (
        "Feedback and Motion with a counter that stands or runs backwards, all around its range",
        COUNTERS,
        "duplicate, stale",
    ),
];
const _: () =
    assert!(FORMATS + FLIPS + RANDOM_CLASSICAL + RANDOM_FD + FLOATS + COUNTERS >= 1_000_000);

#[test]
fn the_docs_have_the_frames() {
    let mut text = String::from("| sent | frames | counted as |\n|---|---|---|\n");
    for (what, frames, cause) in SENT {
        let _ = writeln!(text, "| {what} | {frames} | {cause} |");
    }
    crate::table::compare("frames", &text);
}

const fn ones_and_twos(bytes: u32) -> u32 {
    let bits = 8 * bytes;
    bits + bits * (bits - 1) / 2
}

const fn threes(bytes: u32) -> u32 {
    let bits = 8 * bytes;
    ones_and_twos(bytes) + bits * (bits - 1) * (bits - 2) / 6
}

fn standard(id: u16) -> StandardId {
    StandardId::new(id).unwrap()
}

/// A frame of this message with these bytes; the CRC is what they say.
fn frame_of(info: &MessageInfo, data: &[u8]) -> CanFrame {
    let id = standard(info.id);
    if info.is_fd() {
        CanFrame::fd(id, data, true).unwrap()
    } else {
        CanFrame::classical(id, data).unwrap()
    }
}

/// Every format that a frame with this identifier can have.
fn formats(id: Id, data: &[u8; FD_MAX]) -> impl Iterator<Item = CanFrame> {
    let short = (0..=8usize).flat_map(move |len| {
        [
            CanFrame::remote(id, len),
            CanFrame::classical(id, &data[..len]),
        ]
    });
    let long = (0..16u8).flat_map(move |dlc| {
        let data = &data[..fd_length_of_dlc(dlc).unwrap()];
        [true, false].map(|brs| CanFrame::fd(id, data, brs))
    });
    short.chain(long).map(Option::unwrap)
}

#[test]
fn every_identifier_format_and_length() {
    let mut pair = Pair::new();
    let mut bytes = Bytes(0x9E37_79B9_7F4A_7C15);
    for raw in 0..0x800u16 {
        let data = bytes.data();
        for frame in formats(standard(raw).into(), &data) {
            let info = TABLE.iter().find(|info| info.id == raw);
            let count: Count = match info {
                None => |counters| &mut counters.unknown_id,
                Some(info) if frame.is_remote() || frame.is_fd() != info.is_fd() => {
                    |counters| &mut counters.wrong_kind
                }
                Some(info) if frame.data().len() == info.len => continue,
                Some(info) if info.id == table::ESTOP.id && frame.data().is_empty() => continue,
                Some(_) => |counters| &mut counters.wrong_length,
            };
            pair.bad(&frame, count);
        }
        // The same number, and the same first eleven bits.
        for twin in [u32::from(raw), u32::from(raw) << 18] {
            for frame in formats(ExtendedId::new(twin).unwrap().into(), &data) {
                pair.bad(&frame, |counters| &mut counters.unknown_id);
            }
        }
    }
    assert_eq!(pair.finish(), FORMATS);
}

fn flip(pair: &mut Pair, info: &MessageInfo, data: &mut [u8], from: usize, left: u32) {
    if left == 0 {
        return;
    }
    for bit in from..data.len() * 8 {
        data[bit / 8] ^= 1 << (bit % 8);
        pair.bad(&frame_of(info, data), |counters| &mut counters.crc);
        flip(pair, info, data, bit + 1, left - 1);
        data[bit / 8] ^= 1 << (bit % 8);
    }
}

/// Both CRCs find up to three wrong bits at these lengths (Koopman). What is spoilt would switch off, or set a limit to nothing.
#[test]
fn every_flip_of_bits() {
    let mut pair = Pair::new();
    let feedback = pair.dirty.clone().next_feedback();
    let off = Message::Motion(Motion {
        sequence: 200,
        request: MotionRequest::Disable,
    });
    let set = ParameterRequest::Set {
        index: 0,
        value: 0.0,
    };
    let set = Message::ParameterRequest(Server::Controller, set);
    let heartbeat = Heartbeat {
        state: Mode::Fault,
        cause: Cause::EStop,
        reset: ResetReason::PowerOn,
    };
    let heartbeat = Message::Heartbeat(Name::Drives, heartbeat);
    let counter = pair.dirty.motion_counter;
    for (frame, most) in [
        (feedback, 2),
        (encode(&off, counter).unwrap(), 2),
        (encode(&set, 1).unwrap(), 3),
        (encode(&heartbeat, 0).unwrap(), 3),
    ] {
        let info = table::of_frame(&frame).unwrap();
        flip(&mut pair, info, &mut frame.data().to_vec(), 0, most);
    }
    assert_eq!(pair.finish(), FLIPS);
}

/// A random frame passes a CRC of w bits with probability 2^-w: so many and three standard deviations more or less, which
/// are square roots of a number so small beside all.
#[test]
fn random_frames() {
    let mut pair = Pair::new();
    let mut bytes = Bytes(0x2545_F491_4F6C_DD1D);
    for (profile, width, frames) in [
        (Profile::Classical, 8, RANDOM_CLASSICAL),
        (Profile::Fd, 16, RANDOM_FD),
    ] {
        let infos: Vec<_> = TABLE
            .iter()
            .filter(|info| info.protection == Some(profile))
            .collect();
        let mut passed = 0;
        for k in 0..frames as usize {
            let info = infos[k % infos.len()];
            let data = bytes.data();
            let before = pair.dirty.node.received().crc;
            let (fresh, data) = (pair.frames == MOST - 1, &data[..info.len]);
            pair.pass(&frame_of(info, data));
            let after = pair.dirty.node.received().crc;
            // A new node has not counted it.
            passed += u32::from(!fresh && after == before);
        }
        let mean = f64::from(frames) / f64::from(1 << width);
        let off = (f64::from(passed) - mean).abs();
        assert!(off <= 3.0 * mean.sqrt(), "{passed} passed, mean {mean}");
    }
    assert_eq!(pair.finish(), RANDOM_CLASSICAL + RANDOM_FD);
}

/// Every float of every message, in frames that are otherwise right.
#[test]
fn floats_that_are_no_numbers_or_out_of_range() {
    let mut pair = Pair::new();
    let mut bytes = Bytes(0xD1B5_4A32_D192_ED03);
    let mut floats = 0;
    for info in TABLE {
        let Some(profile) = info.protection else {
            continue;
        };
        let selector = info
            .signals
            .iter()
            .find(|signal| matches!(signal.kind, Kind::Selector(_)));
        for signal in info.signals {
            let Kind::F32 { min, max } = signal.kind else {
                continue;
            };
            for element in 0..signal.elements.len() {
                floats += 1;
                let mut send = |bits: u32, count: Count| {
                    let mut data = vec![0; info.len];
                    if let (Some(selector), Some(tag)) = (selector, signal.when) {
                        data[selector.offset] = tag;
                    }
                    data[signal.offset + 4 * element..][..4].copy_from_slice(&bits.to_le_bytes());
                    profile.protect(info.id, 1, &mut data);
                    pair.bad(&frame_of(info, &data), count);
                };
                // Signalling and quiet, of either sign, with the smallest, the greatest and random payloads.
                let payloads = [1, 0x3F_FFFF, 0x40_0000, 0x7F_FFFF];
                for k in 0..200 {
                    let payload = payloads.get(k).copied();
                    let payload = payload.unwrap_or_else(|| (bytes.word() & 0x7F_FFFF).max(1));
                    send(0x7F80_0000 | payload, |counters| &mut counters.not_finite);
                    send(0xFF80_0000 | payload, |counters| &mut counters.not_finite);
                }
                for infinity in [f32::INFINITY, f32::NEG_INFINITY] {
                    send(infinity.to_bits(), |counters| &mut counters.not_finite);
                }
                // Where the range ends before the floats do.
                for value in [max.next_up(), min.next_down(), f32::MAX, f32::MIN] {
                    if value.is_finite() && !(min..=max).contains(&value) {
                        send(value.to_bits(), |counters| &mut counters.out_of_range);
                    }
                }
            }
        }
    }
    assert!(floats > 50, "{floats}");
    assert_eq!(pair.finish(), FLOATS);
}

/// A sender whose counter stands, or runs backwards, everywhere in the range of the counter: Disable, and a feedback of an
/// arm elsewhere.
#[test]
fn counters_that_stand_or_run_backwards() {
    let mut pair = Pair::new();
    let count = |behind: u8| -> Count {
        if behind == 0 {
            |counters| &mut counters.duplicate
        } else {
            |counters| &mut counters.stale
        }
    };
    let off = Message::Motion(Motion {
        sequence: 200,
        request: MotionRequest::Disable,
    });
    let mut seen = [false; 256];
    for _ in 0..256 {
        for behind in 0..=128u8 {
            let counter = pair.dirty.motion_counter.wrapping_sub(1 + behind);
            pair.bad(&encode(&off, counter).unwrap(), count(behind));
            let mut other = pair.dirty.clone();
            other.follows = false;
            other.shove(0.5);
            seen[usize::from(other.feedback_counter)] = true;
            other.feedback_counter = other.feedback_counter.wrapping_sub(1 + behind);
            pair.bad(&other.next_feedback(), count(behind));
        }
    }
    assert_eq!(seen, [true; 256]);
    assert_eq!(pair.finish(), COUNTERS);
}

/// They are numbers like others: used, and next to nothing. 1.2e-38 rad/s times any gain is far below 1e-30 N m.
#[test]
fn subnormal_speeds_are_used() {
    let (mut zero, mut subnormal) = (Bench::enabled(), Bench::enabled());
    for bits in [1, 0x8000_0001, 0x40_0000, 0x7F_FFFF, 0x807F_FFFF] {
        for _ in 0..100 {
            subnormal.velocity = [f32::from_bits(bits); 4];
            let (a, b) = (zero.command(), subnormal.command());
            assert_eq!(a.control, b.control);
            for (a, b) in a.torque.iter().zip(b.torque) {
                assert!((a - b).abs() < 1e-30, "{a} {b}");
            }
        }
    }
    assert_eq!(subnormal.node.received().dropped(), 0);
}

/// The drives would long be missed. To believe it would make all that follow old.
#[test]
fn a_feedback_from_far_ahead_changes_nothing() {
    for ahead in [1_000, 1 << 20, u32::MAX / 2 - 1] {
        let mut bench = Bench::moving();
        let mut sound = bench.clone();
        let sample = bench.sample;
        bench.sample = sample.wrapping_add(ahead);
        let frame = bench.next_feedback();
        (bench.sample, bench.feedback_counter) = (sample, sound.feedback_counter);
        bench.wire.to_node.push_back(frame);
        bench.poll();
        assert_eq!(bench.node.received().stale, 1, "{ahead}");
        assert_eq!(bench.run(50).len(), sound.run(50).len(), "{ahead}");
        assert_eq!(bench.node.controller().cause(), Cause::None, "{ahead}");
        let torques = [bench.command(), sound.command()].map(|it| it.torque);
        assert_eq!(torques[0], torques[1], "{ahead}");
    }
}

/// Whatever its counter says. It may be up to 1000 samples ahead, which is a gap.
#[test]
fn a_feedback_has_its_place_by_its_sample() {
    for (ahead, dropped, expected) in [
        (-1, [0, 1], Cause::None),
        (0, [1, 0], Cause::None),
        (1, [0, 0], Cause::None),
        (1000, [0, 0], Cause::FeedbackLost),
        (1001, [0, 1], Cause::None),
    ] {
        let mut bench = Bench::enabled();
        bench.sample = (bench.sample - 1).wrapping_add_signed(ahead);
        bench.step();
        let counters = bench.node.received();
        assert_eq!([counters.duplicate, counters.stale], dropped, "{ahead}");
        assert_eq!(bench.node.controller().cause(), expected, "{ahead}");
    }
}
