//! Frame lengths against a second derivation: every frame is built bit by bit, CRC, stuff count and fixed stuff bits
//! included, and counted.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "../../../firmware/tests/common/draws.rs"]
mod draws;

use proptest::prelude::*;
use protocol::frame::{CanFrame, ExtendedId, FrameKind, Id, StandardId};
use protocol::wire::{BitTiming, FrameBits, TimingError};

/// The frame as a transmitter sends it, each bit marked with whether it belongs to the data phase.
struct Wire(Vec<(bool, bool)>);

impl Wire {
    /// ISO 11898-1:2015, figures of the frame formats, field by field.
    fn of(frame: &CanFrame) -> Self {
        let (fd, brs, esi, remote) = match frame.kind() {
            FrameKind::Classical { remote } => (false, false, false, remote),
            FrameKind::Fd { brs, esi } => (true, brs, esi, false),
        };
        let mut header = vec![false]; // SOF
        match frame.id() {
            Id::Standard(id) => {
                header.extend(number(u64::from(id.as_raw()), 11));
                header.push(remote); // RTR, or RRS of an FD frame
                header.push(false); // IDE
            }
            Id::Extended(id) => {
                header.extend(number(u64::from(id.as_raw() >> 18), 11));
                header.push(true); // SRR
                header.push(true); // IDE
                header.extend(number(u64::from(id.as_raw() & 0x3FFFF), 18));
                header.push(remote); // RTR, or RRS of an FD frame
                if !fd {
                    header.push(false); // r1, which an FD frame uses as FDF
                }
            }
        }
        if fd {
            header.push(true); // FDF
            header.push(false); // res
            header.push(brs);
        } else {
            header.push(false); // r0
        }
        let switch = header.len();
        if fd {
            header.push(esi);
        }
        header.extend(number(u64::from(frame.dlc()), 4));
        for &byte in frame.data() {
            header.extend(number(u64::from(byte), 8));
        }

        let mut bits: Vec<(bool, bool)> = header
            .iter()
            .enumerate()
            .map(|(at, &bit)| (bit, brs && at >= switch))
            .collect();
        if fd {
            let stuffed = stuff(&bits, false);
            let inserted = stuffed.len() - bits.len();
            let field = Self::check_field(&stuffed, inserted, frame.data().len());
            bits = stuffed;
            bits.extend(field.iter().map(|&bit| (bit, brs)));
        } else {
            bits.extend(number(crc(15, 0x4599, 0, &header), 15).map(|bit| (bit, false)));
            bits = stuff(&bits, true);
        }
        bits.push((true, brs)); // CRC delimiter
        // ACK slot, ACK delimiter, 7 bits of EOF, 3 of intermission.
        bits.push((false, false));
        bits.extend([(true, false); 1 + 7 + 3]);
        Self(bits)
    }

    /// CRC field of an FD frame: stuff count (Gray code, parity), CRC over all bits sent so far and the stuff count,
    /// a fixed stuff bit, complement of the bit before it, before the first and after every fourth bit.
    fn check_field(stuffed: &[(bool, bool)], inserted: usize, len: usize) -> Vec<bool> {
        let count = (inserted % 8) as u64;
        let gray = count ^ count >> 1;
        let mut field: Vec<bool> = number(gray, 3).collect();
        field.push(gray.count_ones() % 2 == 1);
        let mut covered: Vec<bool> = stuffed.iter().map(|&(bit, _)| bit).collect();
        covered.extend(&field);
        field.extend(if len <= 16 {
            number(crc(17, 0x1685B, 1 << 16, &covered), 17).collect::<Vec<_>>()
        } else {
            number(crc(21, 0x10_2899, 1 << 20, &covered), 21).collect()
        });
        let mut last = stuffed[stuffed.len() - 1].0;
        let mut out = Vec::new();
        for chunk in field.chunks(4) {
            out.push(!last);
            out.extend(chunk);
            last = chunk[chunk.len() - 1];
        }
        // A last chunk of four would be followed by a fixed stuff bit too; neither 4 + 17 nor 4 + 21 bits end with one.
        assert_ne!(field.len() % 4, 0);
        out
    }

    fn length(&self) -> FrameBits {
        let data = self.0.iter().filter(|&&(_, data)| data).count() as u32;
        FrameBits {
            nominal: self.0.len() as u32 - data,
            data,
        }
    }
}

/// Big-endian bits of a number.
fn number(value: u64, width: u32) -> impl Iterator<Item = bool> {
    (0..width).rev().map(move |bit| value >> bit & 1 == 1)
}

/// Long division of the message by the polynomial, as by hand: message bits, then `width` zeros.
fn crc(width: u32, polynomial: u64, start: u64, message: &[bool]) -> u64 {
    let divisor = 1 << width | polynomial;
    let padded = message.iter().copied().chain((0..width).map(|_| false));
    // A start value inverts the message's first bits where it has ones.
    let padded = padded.enumerate().map(|(at, bit)| {
        bit ^ (at < width as usize && start >> (width as usize - 1 - at) & 1 == 1)
    });
    padded.fold(0, |remainder: u64, bit| {
        let next = remainder << 1 | u64::from(bit);
        if next >> width & 1 == 1 {
            next ^ divisor
        } else {
            next
        }
    })
}

/// Looks back over the bits sent: five equal bits are followed by their complement; `behind_last` also at the very end.
fn stuff(bits: &[(bool, bool)], behind_last: bool) -> Vec<(bool, bool)> {
    let mut out: Vec<(bool, bool)> = Vec::new();
    for (at, &(bit, data)) in bits.iter().enumerate() {
        out.push((bit, data));
        let five = out.len() >= 5 && out[out.len() - 5..].iter().all(|&(b, _)| b == bit);
        if five && (behind_last || at + 1 < bits.len()) {
            out.push((!bit, data));
        }
    }
    out
}

fn standard(id: u16) -> StandardId {
    StandardId::new(id).unwrap()
}

fn any_id() -> impl Strategy<Value = Id> {
    // Extremes give the longest runs.
    prop_oneof![
        (0_u16..0x800).prop_map(|id| Id::Standard(standard(id))),
        prop_oneof![Just(0_u16), Just(0x7FF), Just(0x41F)]
            .prop_map(|id| Id::Standard(standard(id))),
        (0_u32..0x2000_0000).prop_map(|id| Id::Extended(ExtendedId::new(id).unwrap())),
        prop_oneof![Just(0_u32), Just(0x1FFF_FFFF), Just(0x0003_FFFF)]
            .prop_map(|id| Id::Extended(ExtendedId::new(id).unwrap())),
    ]
}

/// Random bytes, and bytes with long runs of equal bits.
fn any_data(max: usize) -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![
        any::<u8>(),
        prop_oneof![
            Just(0x00_u8),
            Just(0xFF),
            Just(0x0F),
            Just(0xF8),
            Just(0x1F),
            Just(0x83)
        ],
    ];
    proptest::collection::vec(byte, 0..=max)
}

fn any_frame() -> impl Strategy<Value = CanFrame> {
    prop_oneof![
        (any_id(), any_data(8)).prop_map(|(id, data)| CanFrame::classical(id, &data).unwrap()),
        (any_id(), 0_usize..=8).prop_map(|(id, len)| CanFrame::remote(id, len).unwrap()),
        (any_id(), any_data(64), any::<bool>(), any::<bool>()).prop_map(|(id, data, brs, esi)| {
            CanFrame::fd(id, &data, brs).unwrap().with_esi(esi)
        }),
    ]
}

/// Check values of the catalogue of parametrised CRC algorithms: the second derivation computes the right CRCs. (The
/// catalogue has the start value 0 of the first FD specification; ISO 11898-1:2015 starts with a leading one.)
#[test]
fn crcs_of_the_second_derivation_have_the_published_check_values() {
    let digits: Vec<bool> = b"123456789"
        .iter()
        .flat_map(|&byte| number(u64::from(byte), 8))
        .collect();
    assert_eq!(crc(15, 0x4599, 0, &digits), 0x059E);
    assert_eq!(crc(17, 0x1685B, 0, &digits), 0x0_4F03);
    assert_eq!(crc(21, 0x10_2899, 0, &digits), 0x0E_D841);
}

proptest! {
    #![proptest_config(draws::cases(4096))]

    #[test]
    fn exact_length_is_that_of_the_frame_built_bit_by_bit(frame in any_frame()) {
        prop_assert_eq!(FrameBits::exact(&frame), Wire::of(&frame).length());
    }

    #[test]
    fn exact_length_lies_between_the_bounds(frame in any_frame()) {
        let timing = BitTiming::default();
        let exact = timing.duration(FrameBits::exact(&frame));
        prop_assert!(timing.duration(FrameBits::without_stuffing(&frame)) <= exact);
        prop_assert!(exact <= timing.duration(FrameBits::worst_case(&frame)));
    }
}

/// ISO 11898-1: six equal bits are an error frame, so a data or remote frame never has them before its CRC delimiter.
#[test]
fn every_payload_byte_and_its_neighbour_is_stuffed() {
    for pair in 0..=u16::MAX {
        let frame = CanFrame::classical(standard(0x240), &pair.to_be_bytes()).unwrap();
        let wire = Wire::of(&frame);
        assert_eq!(FrameBits::exact(&frame), wire.length(), "{frame}");
        let before_delimiter = &wire.0[..wire.0.len() - 13];
        assert!(
            before_delimiter
                .windows(6)
                .all(|six| six.iter().any(|&(bit, _)| bit != six[0].0)),
            "{frame}"
        );
    }
}

/// Published: 44 + 8 n bits and 3 of interframe space, at most floor((34 + 8 n - 1) / 4) stuff bits (Davis et al.,
/// "Controller Area Network (CAN) schedulability analysis: refuted, revisited and revised", 2007).
#[test]
fn classical_bounds_are_the_published_ones() {
    for len in 0..=8_u32 {
        let data = vec![0; len as usize];
        let frame = CanFrame::classical(standard(0x123), &data).unwrap();
        assert_eq!(FrameBits::without_stuffing(&frame).nominal, 47 + 8 * len);
        let stuff = (34 + 8 * len - 1) / 4;
        assert_eq!(FrameBits::worst_case(&frame).nominal, 47 + 8 * len + stuff);

        let frame = CanFrame::classical(ExtendedId::ZERO, &data).unwrap();
        assert_eq!(FrameBits::without_stuffing(&frame).nominal, 67 + 8 * len);
        let stuff = (54 + 8 * len - 1) / 4;
        assert_eq!(FrameBits::worst_case(&frame).nominal, 67 + 8 * len + stuff);
    }
    let frame = CanFrame::classical(standard(0x123), &[0; 8]).unwrap();
    assert_eq!(FrameBits::without_stuffing(&frame).nominal, 111);
    assert_eq!(FrameBits::worst_case(&frame).nominal, 135);
}

/// Known durations at 1 / 5 Mbit/s of standard FD frames with bit rate switch, rounded to 1 us.
#[test]
fn fd_durations_are_the_known_ones() {
    let timing = BitTiming::default();
    for (len, best, worst) in [(24, 75, 89), (32, 88, 105), (48, 113, 137), (64, 139, 169)] {
        let frame = CanFrame::fd(standard(0x1C0), &vec![0; len], true).unwrap();
        let us = |bits| (timing.duration(bits).nanos() as f64 / 1e3).round() as u64;
        assert_eq!(us(FrameBits::without_stuffing(&frame)), best, "{len} bytes");
        assert_eq!(us(FrameBits::worst_case(&frame)), worst, "{len} bytes");
    }
}

/// Five equal bits at the very end: the first fixed stuff bit takes the place of the dynamic one.
#[test]
fn a_run_that_ends_with_the_data_field_adds_no_bit_to_an_fd_frame() {
    // Identifier, ESI 0 and DLC 0001 contain no run of five.
    let bits = |byte| FrameBits::exact(&CanFrame::fd(standard(0x555), &[byte], true).unwrap());
    let no_run = bits(0b1010_1010);
    assert_eq!(bits(0b1010_0000), no_run);
    // One bit earlier, the same run is stuffed.
    assert_eq!(bits(0b0100_0001).data, no_run.data + 1);
}

#[test]
fn without_bit_rate_switch_all_bits_are_nominal() {
    let data = [0x5A; 64];
    let slow = FrameBits::exact(&CanFrame::fd(standard(0x2C0), &data, false).unwrap());
    let fast = FrameBits::exact(&CanFrame::fd(standard(0x2C0), &data, true).unwrap());
    assert_eq!(slow.data, 0);
    // Between FDF 1 and DLC 1111 are res 0, BRS and ESI 0: no run of five for either value of BRS.
    assert_eq!(slow.nominal, fast.nominal + fast.data);
}

#[test]
fn bit_timing_refuses_what_no_controller_has() {
    assert_eq!(BitTiming::new(0, 1, 800), Err(TimingError::Nominal(0)));
    assert!(BitTiming::new(1_000_001, 5_000_000, 800).is_err());
    let below_nominal = TimingError::Data {
        data: 499_999,
        nominal: 500_000,
    };
    assert_eq!(BitTiming::new(500_000, 499_999, 800), Err(below_nominal));
    assert!(BitTiming::new(500_000, 8_000_001, 800).is_err());
    assert_eq!(
        BitTiming::new(500_000, 2_000_000, 1000),
        Err(TimingError::SamplePoint(1000))
    );
    assert_eq!(
        BitTiming::new(1_000_000, 5_000_000, 800),
        Ok(BitTiming::default())
    );
}

/// 3 Mbit/s has no whole number of ns per bit: never shorter than exact, and less than 1 ns longer per phase.
#[test]
fn durations_round_up_to_a_whole_ns() {
    let timing = BitTiming::new(1_000_000, 3_000_000, 800).unwrap();
    for data in 0..600 {
        let bits = FrameBits { nominal: 30, data };
        // In thirds of a ns, exactly.
        let exact = 3 * 30_000 + 1000 * u64::from(data);
        let got = 3 * timing.duration(bits).nanos();
        assert!((exact..exact + 3).contains(&got), "{data}");
    }
}
