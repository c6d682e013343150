//! End-to-end protection: the CRCs against the published catalogue, their definition and the error classes that they
//! guarantee to find, and the counter against an unbounded count.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::{Bytes, bitwise_crc, crc8, crc16};
use crc::{CRC_8_AUTOSAR, CRC_16_IBM_3740, Crc};
use proptest::prelude::*;
use protocol::counters::Counters;
use protocol::e2e::{Profile, Receiver, Verdict};

#[test]
fn crcs_are_those_of_the_catalogue() {
    // Check values of the CRC RevEng catalogue.
    let check = b"123456789";
    assert_eq!(Crc::<u16>::new(&CRC_16_IBM_3740).checksum(check), 0x29B1);
    assert_eq!(Crc::<u8>::new(&CRC_8_AUTOSAR).checksum(check), 0xDF);
    assert_eq!(bitwise_crc(16, 0x1021, 0xFFFF, 0x0000, check), 0x29B1);
    assert_eq!(bitwise_crc(8, 0x2F, 0xFF, 0xFF, check), 0xDF);
    // The same text as a frame: data id "12", payload "345678", counter "9".
    let mut frame = *b"345678???";
    Profile::Fd.protect(0x3132, b'9', &mut frame);
    assert_eq!(frame, *b"3456789\x29\xB1");
}

#[test]
fn frames_too_short_are_neither_written_nor_believed() {
    for (profile, overhead) in [(Profile::Classical, 2), (Profile::Fd, 3)] {
        assert_eq!(profile.overhead(), overhead);
        for len in 0..overhead {
            let mut frame = vec![0xA5; len];
            profile.protect(0x123, 7, &mut frame);
            assert!(frame.iter().all(|&byte| byte == 0xA5));
            assert_eq!(profile.check(0x123, &frame), None);
        }
        // Not even with the CRC of no bytes in the right place.
        let (crc8, crc16) = (crc8(0x123, &[]), crc16(0x123, &[]));
        assert_eq!(Profile::Classical.check(0x123, &[crc8]), None);
        assert_eq!(Profile::Fd.check(0x123, &crc16.to_be_bytes()), None);
    }
}

/// A protected frame of random payload.
fn protected(profile: Profile, id: u16, len: usize, seed: u64) -> Vec<u8> {
    let mut bytes = Bytes(seed);
    let mut frame: Vec<u8> = (0..len).map(|_| bytes.next()).collect();
    profile.protect(id, bytes.next(), &mut frame);
    assert!(profile.check(id, &frame).is_some());
    frame
}

/// Calls `visit` with the frame after every flip of one, two and three bits.
fn flips(frame: &mut [u8], mut visit: impl FnMut(&[u8])) {
    let bits = frame.len() * 8;
    let flip = |frame: &mut [u8], bit: usize| frame[bit / 8] ^= 1 << (bit % 8);
    for a in 0..bits {
        flip(frame, a);
        visit(frame);
        for b in a + 1..bits {
            flip(frame, b);
            visit(frame);
            for c in b + 1..bits {
                flip(frame, c);
                visit(frame);
                flip(frame, c);
            }
            flip(frame, b);
        }
        flip(frame, a);
    }
}

/// Both polynomials keep a Hamming distance of 4 at these lengths (Koopman), so nothing up to three flips may pass.
#[test]
fn every_flip_of_up_to_three_bits_is_found() {
    for (profile, len) in [
        (Profile::Classical, 5),
        (Profile::Classical, 8),
        (Profile::Fd, 12),
    ] {
        let mut frame = protected(profile, 0x741, len, 0x9E37_79B9_7F4A_7C15);
        let (mut visited, bits) = (0, len * 8);
        flips(&mut frame, |flipped| {
            visited += 1;
            assert_eq!(profile.check(0x741, flipped), None, "{flipped:02X?}");
        });
        assert_eq!(
            visited,
            bits + bits * (bits - 1) / 2 + bits * (bits - 1) * (bits - 2) / 6
        );
    }
}

proptest! {
    #[test]
    fn protection_is_counter_and_crc_as_defined(
        id in 0..0x800u16, counter: u8, frame in prop::collection::vec(any::<u8>(), 3..=64),
    ) {
        let n = frame.len();
        let mut fd = frame.clone();
        Profile::Fd.protect(id, counter, &mut fd);
        prop_assert_eq!(&fd[..n - 3], &frame[..n - 3]);
        prop_assert_eq!(fd[n - 3], counter);
        prop_assert_eq!(&fd[n - 2..], &crc16(id, &fd[..n - 2]).to_be_bytes());
        prop_assert_eq!(Profile::Fd.check(id, &fd), Some((&frame[..n - 3], counter)));

        let mut classical = frame.clone();
        Profile::Classical.protect(id, counter, &mut classical);
        prop_assert_eq!(&classical[..n - 2], &frame[..n - 2]);
        prop_assert_eq!(classical[n - 2], counter & 0x0F);
        prop_assert_eq!(classical[n - 1], crc8(id, &classical[..n - 1]));
        prop_assert_eq!(Profile::Classical.check(id, &classical), Some((&frame[..n - 2], counter & 0x0F)));
    }

    /// Two identifiers of 11 bits differ by a burst no longer than that, which a 16-bit CRC always finds.
    #[test]
    fn a_frame_on_another_identifier_is_refused(
        id in 0..0x800u16, other in 0..0x800u16, seed in 1..u64::MAX,
    ) {
        prop_assume!(id != other);
        let frame = protected(Profile::Fd, id, 24, seed);
        prop_assert_eq!(Profile::Fd.check(other, &frame), None);
    }

    /// Any CRC finds every burst up to its own width, wherever it is: the code word is in order of division.
    #[test]
    fn bursts_up_to_the_width_are_found(seed in 1..u64::MAX, pattern in 1..=u16::MAX, place: prop::sample::Index) {
        for (profile, width, len) in [(Profile::Classical, 8, 8usize), (Profile::Fd, 16, 48)] {
            let mut frame = protected(profile, 0x1C0, len, seed);
            let pattern = if width == 8 { (pattern & 0xFF).max(1) } else { pattern };
            let start = place.index(len * 8 - width + 1);
            for bit in (0..width).filter(|bit| pattern >> bit & 1 == 1) {
                // Bit 7 of a byte goes first into the division.
                frame[(start + bit) / 8] ^= 0x80 >> ((start + bit) % 8);
            }
            prop_assert_eq!(profile.check(0x1C0, &frame), None);
        }
    }

    /// The receiver sees a count modulo 16 or 256; the oracle sees the count itself.
    #[test]
    fn verdicts_are_those_of_an_unbounded_count(classical: bool, start in 0..1000i64, steps in prop::collection::vec(-128..=127i64, 1..200)) {
        let (profile, half) = if classical { (Profile::Classical, 8) } else { (Profile::Fd, 128) };
        let mut receiver = Receiver::new(profile);
        let wire = |count: i64| count.rem_euclid(2 * half) as u8;
        prop_assert_eq!(receiver.check(wire(start)), Verdict::Initial);
        let mut newest = start;
        for step in steps {
            // From half the range behind to one less than half ahead.
            let step = (step + half).rem_euclid(2 * half) - half;
            let expected = match step {
                0 => Verdict::Duplicate,
                1 => Verdict::Fresh,
                2.. => Verdict::Lost((step - 1) as u8),
                _ => Verdict::Stale(-step as u8),
            };
            prop_assert_eq!(receiver.check(wire(newest + step)), expected);
            newest = newest.max(newest + step);
        }
        receiver.reset();
        prop_assert_eq!(receiver.check(wire(newest)), Verdict::Initial);
    }
}

#[test]
fn a_stuck_counter_never_becomes_new() {
    let mut receiver = Receiver::new(Profile::Fd);
    assert!(receiver.check(9).is_new());
    assert!((0..1000).all(|_| receiver.check(9) == Verdict::Duplicate));
    assert_eq!(receiver.check(10), Verdict::Fresh);
}

/// A saturated count shows that there may have been more.
#[test]
fn a_count_that_ran_out_is_no_exact_one() {
    let mut counters = Counters::default();
    for _ in 0..u16::MAX - 1 {
        counters.count(Verdict::Duplicate);
    }
    assert_eq!(counters.to_string(), "65534 duplicate");
    for _ in 0..2 {
        counters.count(Verdict::Duplicate);
    }
    assert_eq!(counters.to_string(), ">= 65535 duplicate");
}
