//! Wires that are held at one level: counters by rules d, e and f of ISO 11898-1, bit by bit, worked out by hand.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/bench.rs"]
mod bench;

use bench::{Bench, ns};
use protocol::frame::{CanFrame, Id, StandardId};
use protocol::wire::{BitTiming, FrameBits};
use sim::bus::{Affliction, Level, Noticed, State};

/// A microsecond is a nominal bit at the default 1 Mbit/s.
const BIT: u64 = 1_000;

/// Of a frame of identifier 1C0h and eight bytes 55h, the bits before the data: SOF, identifier with a stuff bit, RTR, IDE, r0,
/// length. The first bit of the data is dominant, the second recessive.
const HEADER: u64 = 1 + 11 + 1 + 3 + 4;

fn frame() -> CanFrame {
    let id = Id::Standard(StandardId::new(0x1C0).unwrap());
    CanFrame::classical(id, &[0x55; 8]).unwrap()
}

/// Counters of a transmitter and of two receivers when the wires have been held for so many bits from `from` on, and before
/// anything else is sent.
fn held(level: Level, frame: Option<CanFrame>, from: u64, bits: u64) -> (Bench, Vec<(u16, u16)>) {
    let mut bench = Bench::of(3);
    let until = from + bits * BIT;
    bench
        .bus
        .afflict(Affliction::Wires(level), ns(from), ns(until));
    if let Some(frame) = frame {
        bench.send(0, 0, &frame);
    }
    bench.run(from + (bits.max(20) + 10) * BIT);
    let both = |&node| {
        let counters = bench.bus.counters(node);
        (counters.transmit(), counters.receive())
    };
    let counters = bench.nodes.iter().map(both).collect();
    (bench, counters)
}

/// Nobody sends: the sixth dominant bit is an error (a), the flag is bits 7 to 12, the first bit after it counts 8 (b), and so does
/// the 14th since the beginning of the flag, the 20th in all, and every eighth from there (f).
#[test]
fn receivers_on_a_bus_held_dominant() {
    for (bits, receive, state) in [
        (1, 1, State::ErrorActive),
        (6, 1, State::ErrorActive),
        (12, 1, State::ErrorActive),
        (13, 9, State::ErrorActive),
        (19, 9, State::ErrorActive),
        (20, 17, State::ErrorActive),
        (27, 17, State::ErrorActive),
        (28, 25, State::ErrorActive),
        (99, 89, State::ErrorActive),
        (100, 97, State::Warning),
        (131, 121, State::Warning),
        (132, 129, State::ErrorPassive),
        (251, 241, State::ErrorPassive),
        (252, 249, State::ErrorPassive),
        (260, 255, State::ErrorPassive),
        (1_000_000, 255, State::ErrorPassive),
    ] {
        let (bench, counters) = held(Level::Dominant, None, 10 * BIT, bits);
        assert_eq!(counters, [(0, receive); 3], "{bits}");
        assert_eq!(bench.bus.counters(bench.nodes[0]).state(), state, "{bits}");
    }
}

/// In the second bit of the data, which is sent recessive. The transmitter sees an error in it (c), its flag is the next six bits,
/// the 14th dominant bit from there is the 15th in all (f). Receivers have the counts of the other table.
#[test]
fn a_transmitter_on_a_bus_held_dominant() {
    let from = (HEADER + 1) * BIT;
    for (bits, transmit, receive) in [
        (1, 8, 1),
        (12, 8, 1),
        (13, 8, 9),
        (14, 8, 9),
        (15, 16, 9),
        (22, 16, 17),
        (23, 24, 17),
        (126, 120, 121),
        (127, 128, 121),
        (131, 128, 121),
        (132, 128, 129),
        (254, 248, 249),
    ] {
        let (_, counters) = held(Level::Dominant, Some(frame()), from, bits);
        let others = [(0, receive); 2];
        assert_eq!(
            (counters[0], &counters[1..]),
            ((transmit, 0), &others[..]),
            "{bits}"
        );
    }
    // 8 + 31 x 8, in the 255th bit; then 128 times 11 bits after the wires are free, of which 11 are delimiter and intermission.
    let (mut bench, counters) = held(Level::Dominant, Some(frame()), from, 255);
    assert_eq!(counters[0].0, 256);
    let off = bench
        .reports
        .iter()
        .find(|it| it.what == Noticed::State(State::BusOff));
    assert_eq!(off.unwrap().time, ns(from + 255 * BIT));
    let back = from + 255 * BIT + 128 * 11 * BIT;
    assert_eq!(bench.bus.next_event(), Some(ns(back)));
    assert_eq!(bench.run(u64::MAX - 1)[0].start, ns(back));
}

/// Dominant bits where the frame has dominant bits are not seen, nor is what ends before the frame begins again.
#[test]
fn a_hold_within_a_dominant_bit_changes_nothing() {
    let (mut bench, counters) = held(Level::Dominant, Some(frame()), HEADER * BIT, 1);
    assert_eq!(counters, [(0, 0); 3]);
    assert_eq!(bench.run(u64::MAX - 1).len(), 1);
    assert!(bench.reports.is_empty());
}

/// A node that reads dominant what it sends recessive in arbitration takes another one for the winner, and is a receiver: the
/// third bit of the identifier is its first recessive one.
#[test]
fn a_hold_in_arbitration_makes_a_receiver() {
    let (_, counters) = held(Level::Dominant, Some(frame()), 3 * BIT, 20);
    assert_eq!(counters, [(0, 17); 3]);
}

/// From the start of frame on, which is dominant: an error in it (c), and one in every bit of the flag (d), each of which begins a
/// new one, until the node is passive: 8 + 15 x 8 = 128. Nobody else reads anything.
#[test]
fn a_transmitter_on_a_bus_held_recessive() {
    for (bits, transmit) in [(1, 8), (2, 16), (5, 40), (15, 120), (16, 128), (20, 128)] {
        let (_, counters) = held(Level::Recessive, Some(frame()), 0, bits);
        assert_eq!(counters, [(transmit, 0), (0, 0), (0, 0)], "{bits}");
    }
    // Sixteen attempts of a passive node more, 8 each.
    let mut bench = Bench::of(3);
    bench
        .bus
        .afflict(Affliction::Wires(Level::Recessive), ns(0), ns(1_000_000));
    bench.send(0, 0, &frame());
    bench.run(999_999);
    let of = |kind: fn(&Noticed) -> bool| bench.reports.iter().filter(|it| kind(&it.what)).count();
    assert_eq!(of(|what| matches!(what, Noticed::Error { .. })), 17);
    assert_eq!(of(|what| *what == Noticed::State(State::BusOff)), 1);
    assert_eq!(bench.bus.counters(bench.nodes[1]).receive(), 0);
    // It comes back, and the frame is sent.
    assert_eq!(bench.run(u64::MAX - 1).len(), 1);
}

/// In the first bit of the data, which is sent dominant. Receivers see an error in the sixth recessive bit (a); from the seventh on
/// their own flag is read wrong (e).
#[test]
fn receivers_of_a_frame_that_the_wires_swallow() {
    for (bits, transmit, receive) in [
        (1, 8, 1),
        (6, 48, 1),
        (7, 56, 9),
        (8, 64, 17),
        (16, 128, 81),
        (21, 128, 121),
        (22, 128, 129),
        (30, 128, 129),
    ] {
        let (_, counters) = held(Level::Recessive, Some(frame()), HEADER * BIT, bits);
        let others = [(0, receive); 2];
        assert_eq!(
            (counters[0], &counters[1..]),
            ((transmit, 0), &others[..]),
            "{bits}"
        );
    }
}

/// What is held for ever is no reason to look ahead for ever.
#[test]
fn a_hold_without_an_end_comes_to_rest() {
    let mut bench = Bench::of(3);
    bench
        .bus
        .afflict(Affliction::Wires(Level::Dominant), ns(0), ns(u64::MAX));
    bench.send(1, 0, &frame());
    assert!(bench.run(u64::MAX - 1).is_empty());
    assert_eq!(bench.bus.next_event(), None);
}

/// It sends whenever the bus is free; nobody else gets through, and afterwards everything waits there still.
#[test]
fn a_babbling_node_fills_the_bus() {
    let mut bench = Bench::of(3);
    let babbling = Affliction::Babbling(bench.nodes[2]);
    bench.bus.afflict(babbling, ns(0), ns(10_000_000));
    bench.send(0, 0, &frame());
    let delivered = bench.run(9_900_000);
    let lowest = Id::Standard(StandardId::new(0).unwrap());
    assert!(delivered.iter().all(|it| it.frame.id() == lowest));
    // A classical frame of eight bytes takes 111 bits and its stuff bits.
    assert!(
        (9_900 / 135..=9_900 / 111).contains(&delivered.len()),
        "{}",
        delivered.len()
    );
    let frame_time = BitTiming::default().duration(FrameBits::exact(&delivered[0].frame));
    for two in delivered.windows(2) {
        assert_eq!(two[0].start + frame_time, two[1].start);
    }
    let rest = bench.run(u64::MAX - 1);
    assert_eq!(rest.last().unwrap().frame, frame());
}
