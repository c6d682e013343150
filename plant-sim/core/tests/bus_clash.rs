//! Two nodes with one identifier: what each counts, who goes on, and who ends bus-off.

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
use sim::bus::{Noticed, State};

/// A microsecond is a nominal bit at the default 1 Mbit/s.
const BIT: u64 = 1_000;

fn id() -> Id {
    Id::Standard(StandardId::new(0x1C0).unwrap())
}

fn classical(data: &[u8]) -> CanFrame {
    CanFrame::classical(id(), data).unwrap()
}

fn counters(bench: &Bench) -> Vec<(u16, u16)> {
    let both = |&node| {
        let counters = bench.bus.counters(node);
        (counters.transmit(), counters.receive())
    };
    bench.nodes.iter().map(both).collect()
}

/// The attack of Cho and Shin (Error Handling of In-vehicle Networks Makes Them Vulnerable, CCS 2016), worked out from the rules:
/// 16 attempts that both lose take both to 128. From then on the recessive one loses alone: its flag is passive. Each time it counts 8
/// and takes 1 back when it has sent its frame after all; the other one takes 1 back. 128 + 8 - 1 + 7 n + 8 is above 255 from
/// n = 17 on.
#[test]
fn the_one_that_sends_recessive_ends_bus_off() {
    let mut bench = Bench::of(3);
    let (winner, loser) = (classical(&[0x01]), classical(&[0x02]));
    // The first difference is the seventh bit of the data, which the second sends recessive.
    bench.send(0, 0, &winner);
    bench.send(1, 0, &loser);
    let mut attempts = 0;
    while attempts < 16 {
        let flag = bench.bus.next_event().unwrap().nanos();
        assert!(bench.run(flag).is_empty());
        attempts += 1;
        let each = 8 * attempts;
        assert_eq!(counters(&bench), [(each, 0), (each, 0), (0, attempts)]);
    }
    let delivered = bench.run(u64::MAX - 1);
    let frames: Vec<_> = delivered.iter().map(|it| it.frame).collect();
    assert_eq!(frames, [winner, loser]);
    assert!(!delivered[0].to.contains(bench.nodes[1]), "it was sending");
    assert_eq!(counters(&bench)[..2], [(127, 0), (128 + 8 - 1, 0)]);
    let mut now = delivered[1].time.nanos();
    let mut periods = 0;
    while bench.bus.counters(bench.nodes[1]).state() != State::BusOff {
        assert_eq!(counters(&bench)[1].0, 135 + 7 * periods);
        periods += 1;
        now += 1_000_000;
        bench.send(0, now, &winner);
        bench.send(1, now, &loser);
        let delivered = bench.run(now + 900_000);
        assert_eq!(delivered[0].frame, winner);
    }
    assert_eq!(periods, 18);
    assert_eq!(bench.bus.statistics().collisions, 16 + 1 + 18);
}

/// SOF, 11 bits of identifier, RTR, IDE, r0, four bits of length, of which two runs of five zeros have a stuff bit each: 21 bits, and
/// the data up to the bit that differs.
/// The flags take up to 12 bits, the delimiter 8, the intermission 3.
#[test]
fn an_attempt_costs_what_is_sent_until_the_difference() {
    let mut bench = Bench::of(3);
    bench.send(0, 0, &classical(&[0x55]));
    bench.send(1, 0, &classical(&[0x5D]));
    let flag = bench.bus.next_event().unwrap();
    // 0101 0 differs from 0101 1 in the fifth bit.
    assert_eq!(flag, ns((21 + 5) * BIT));
    bench.run(flag.nanos());
    let Noticed::Error { sending, .. } = bench.reports[0].what else {
        panic!("{:?}", bench.reports);
    };
    assert!(sending && bench.reports[0].node == bench.nodes[1]);
    assert_eq!(
        bench.bus.statistics().total.busy.nanos(),
        (26 + 12 + 8 + 3) * BIT
    );
}

/// FDF follows the arbitration field, so a classical and an FD frame of one identifier collide too: in the bit that is recessive in
/// the FD frame, the sixteenth with the stuff bit.
#[test]
fn a_classical_and_an_fd_frame_of_one_identifier_clash() {
    let mut bench = Bench::of(3);
    bench.send(0, 0, &classical(&[]));
    let fd = CanFrame::fd(id(), &[], true).unwrap();
    bench.send(1, 0, &fd);
    assert_eq!(bench.bus.next_event(), Some(ns(16 * BIT)));
    let delivered = bench.run(u64::MAX - 1);
    assert_eq!(delivered.len(), 2);
    let statistics = bench.bus.statistics();
    assert_eq!((statistics.collisions, statistics.total.frames), (17, 2));
    let timing = BitTiming::default();
    let frames = [classical(&[]), fd].map(|frame| timing.duration(FrameBits::exact(&frame)));
    assert!(statistics.total.busy > frames[0] + frames[1]);
}
