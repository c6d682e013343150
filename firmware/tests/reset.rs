//! The record of the last stop in memory of arbitrary content.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::cabinet::reset::{Record, Stop};
use proptest::prelude::*;
use protocol::messages::ResetReason;

const STOP: Stop = Stop {
    reason: ResetReason::HardFault,
    pins: [0b0111, 0b1000],
    at: 0x0000_1234,
    status: 0x0000_0082,
};

fn any_stop() -> impl Strategy<Value = Stop> {
    let reason = proptest::sample::select(ResetReason::ALL);
    (reason, any::<[u8; 2]>(), any::<u32>(), any::<u32>()).prop_map(|(reason, pins, at, status)| {
        Stop {
            reason,
            pins,
            at,
            status,
        }
    })
}

proptest! {
    #[test]
    fn what_was_kept_is_taken_once(stop in any_stop(), garbage: [u32; 4]) {
        let record = Record::from_words(garbage);
        record.keep(&stop);
        prop_assert_eq!(record.take(), Some(stop));
        prop_assert_eq!(record.take(), None);
    }

    #[test]
    fn memory_after_power_on_is_no_record(garbage: [u32; 4]) {
        prop_assert_eq!(Record::from_words(garbage).take(), None);
    }

    /// A reset in the middle of writing: the first words belong to one stop, the rest to another.
    #[test]
    fn a_torn_record_is_none(old in any_stop(), new in any_stop(), written in 1_usize..4) {
        let mut words = words_of(&old);
        let whole = words_of(&new);
        words[..written].copy_from_slice(&whole[..written]);
        let kept = Record::from_words(words).take();
        prop_assert!(kept.is_none() || words == whole || words == words_of(&old), "{:?}", kept);
    }
}

/// The words of a record as a debugger would see them.
fn words_of(stop: &Stop) -> [u32; 4] {
    let record = Record::from_words([0; 4]);
    record.keep(stop);
    let text = format!("{record:?}");
    let words: Vec<u32> = text
        .split(|c: char| !c.is_ascii_digit())
        .filter_map(|digits| digits.parse().ok())
        .collect();
    words.try_into().expect("four words")
}

#[test]
fn memory_full_of_one_value_is_no_record() {
    for word in [0, u32::MAX, 0xCCCC_CCCC, 0x5555_5555, 0xAAAA_AAAA] {
        assert_eq!(Record::from_words([word; 4]).take(), None, "{word:#x}");
    }
}

#[test]
fn every_flipped_bit_is_seen() {
    let words = words_of(&STOP);
    assert_eq!(Record::from_words(words).take(), Some(STOP));
    for bit in 0..128 {
        let mut flipped = words;
        flipped[bit / 32] ^= 1 << (bit % 32);
        assert_eq!(Record::from_words(flipped).take(), None, "bit {bit}");
    }
}
