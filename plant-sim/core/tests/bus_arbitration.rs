//! The bus as a discrete-event system: which frame wins, when, and that the statistics add up.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::{BTreeMap, HashMap};

use proptest::prelude::*;
use protocol::time::{Duration, Instant};
use protocol::wire::{BitTiming, FrameBits};
use protocol::{
    bus::TransmitError,
    frame::{CanFrame, ExtendedId, Id, StandardId},
};
use sim::bus::{BuiltinBus, Delivery, MAX_LOAD, NodeId, Traffic, admit, worst_case_load};

/// From the frame being valid to the end of the intermission at 1 Mbit/s, sample point 80 %: the rest of the last but
/// one bit of end of frame, its last bit, three bits of intermission.
const AFTER_VALID: Duration = Duration::from_nanos(200 + 1000 + 3000);

fn standard(id: u16) -> Id {
    Id::Standard(StandardId::new(id).unwrap())
}

fn extended(id: u32) -> Id {
    Id::Extended(ExtendedId::new(id).unwrap())
}

fn classical(id: Id, data: &[u8]) -> CanFrame {
    CanFrame::classical(id, data).unwrap()
}

fn ns(ns: u64) -> Instant {
    Instant::from_nanos(ns)
}

fn duration(frame: &CanFrame) -> Duration {
    BitTiming::default().duration(FrameBits::exact(frame))
}

fn bus_of(nodes: usize) -> (BuiltinBus, Vec<NodeId>) {
    let mut bus = BuiltinBus::new(BitTiming::default());
    let nodes = (0..nodes).map(|_| bus.attach(64)).collect();
    (bus, nodes)
}

fn drain(bus: &mut BuiltinBus) -> Vec<Delivery> {
    std::iter::from_fn(|| bus.pop_delivery(Instant::MAX)).collect()
}

#[test]
fn a_lone_frame_starts_at_once_and_is_valid_before_its_last_bit() {
    let (mut bus, nodes) = bus_of(2);
    let frame = classical(standard(0x123), &[1, 2, 3]);
    bus.enqueue(nodes[0], ns(5_000), &frame).unwrap();
    let valid = ns(5_000) + duration(&frame).saturating_sub(AFTER_VALID);
    assert_eq!(bus.next_event(), Some(valid));
    assert_eq!(bus.pop_delivery(ns(valid.nanos() - 1)), None);
    let delivery = bus.pop_delivery(valid).unwrap();
    assert_eq!((delivery.start, delivery.time), (ns(5_000), valid));
    assert_eq!(delivery.frame, frame);
    assert!(delivery.from.contains(nodes[0]) && !delivery.from.contains(nodes[1]));
    assert_eq!(bus.next_event(), None);
}

/// ISO 11898-1: lowest identifier first; with equal base identifier a standard frame before an extended one, a data
/// frame before its remote frame, and a standard remote frame before an extended frame (RTR and SRR recessive alike,
/// IDE decides).
#[test]
fn arbitration_follows_the_bits_of_the_field() {
    let by_priority = [
        classical(standard(0x000), &[]),
        classical(extended(0x0000_0000), &[]),
        classical(standard(0x122), &[0xFF; 8]),
        classical(extended(0x122 << 18 | 0x3_FFFF), &[]),
        CanFrame::fd(standard(0x123), &[0; 64], true).unwrap(),
        CanFrame::remote(standard(0x123), 0).unwrap(),
        classical(extended(0x123 << 18), &[]),
        CanFrame::remote(extended(0x123 << 18), 8).unwrap(),
        classical(extended(0x123 << 18 | 1), &[]),
        classical(standard(0x7FF), &[]),
        CanFrame::fd(extended(0x1FFF_FFFF), &[], true).unwrap(),
    ];
    let (mut bus, nodes) = bus_of(by_priority.len());
    for (node, frame) in nodes.iter().zip(by_priority.iter().rev()) {
        bus.enqueue(*node, ns(0), frame).unwrap();
    }
    let order: Vec<CanFrame> = drain(&mut bus).iter().map(|d| d.frame).collect();
    assert_eq!(order, by_priority);
}

#[test]
fn a_frame_under_way_is_not_preempted_and_the_next_starts_after_the_intermission() {
    let (mut bus, nodes) = bus_of(3);
    let low = classical(standard(0x700), &[0; 8]);
    let high = classical(standard(0x001), &[]);
    let middle = classical(standard(0x240), &[1]);
    bus.enqueue(nodes[0], ns(0), &low).unwrap();
    bus.enqueue(nodes[1], ns(1), &middle).unwrap();
    bus.enqueue(nodes[2], ns(2), &high).unwrap();
    let starts: Vec<_> = drain(&mut bus).iter().map(|d| (d.frame, d.start)).collect();
    let after_low = ns(0) + duration(&low);
    let after_high = after_low + duration(&high);
    assert_eq!(
        starts,
        [(low, ns(0)), (high, after_low), (middle, after_high)]
    );
}

#[test]
fn a_frame_put_in_at_the_instant_of_a_start_takes_part() {
    let (mut bus, nodes) = bus_of(2);
    let low = classical(standard(0x700), &[]);
    let high = classical(standard(0x001), &[]);
    bus.enqueue(nodes[0], ns(7), &low).unwrap();
    bus.enqueue(nodes[1], ns(7), &high).unwrap();
    assert_eq!(bus.pop_delivery(Instant::MAX).unwrap().frame, high);

    // The end of the intermission is also such an instant.
    let again = ns(7) + duration(&high);
    bus.enqueue(nodes[1], again, &high).unwrap();
    assert_eq!(bus.pop_delivery(Instant::MAX).unwrap().frame, high);
    assert_eq!(bus.pop_delivery(Instant::MAX).unwrap().frame, low);
}

#[test]
fn a_full_controller_refuses_and_counts_until_its_frame_is_sent() {
    let mut bus = BuiltinBus::new(BitTiming::default());
    let node = bus.attach(2);
    // Somebody has to acknowledge.
    bus.attach(2);
    let frame = classical(standard(0x123), &[]);
    assert_eq!(bus.enqueue(node, ns(0), &frame), Ok(()));
    assert_eq!(bus.enqueue(node, ns(0), &frame), Ok(()));
    assert_eq!(
        bus.enqueue(node, ns(0), &frame),
        Err(TransmitError::QueueFull)
    );
    assert_eq!(bus.statistics().refused, 1);
    let first = bus.pop_delivery(Instant::MAX).unwrap();
    assert_eq!(bus.enqueue(node, first.time, &frame), Ok(()));
    assert_eq!(drain(&mut bus).len(), 2);
}

/// No bit differs, so no node notices: CAN carries the frame once. An e-stop raised by two nodes does this.
#[test]
fn the_same_frame_from_two_nodes_is_carried_once() {
    let (mut bus, nodes) = bus_of(3);
    let stop = classical(standard(0x001), &[1, 0]);
    bus.enqueue(nodes[0], ns(0), &stop).unwrap();
    bus.enqueue(nodes[1], ns(0), &stop).unwrap();
    let delivered = drain(&mut bus);
    assert_eq!(delivered.len(), 1);
    assert_eq!(
        delivered[0].from.iter().collect::<Vec<_>>(),
        [nodes[0], nodes[1]]
    );
    assert_eq!(bus.statistics().collisions, 0);
    assert_eq!(bus.statistics().total.busy, duration(&stop));
}

#[test]
fn a_link_profile_is_refused_above_80_percent_with_the_number() {
    let timing = BitTiming::default();
    // 135 us worst case.
    let profile = |rate| {
        [Traffic {
            frame: classical(standard(0x123), &[0; 8]),
            rate,
        }]
    };
    // 0.8 / 135 us = 5925.9 Hz.
    assert!(admit(&timing, &profile(5925.0)).is_ok());
    let refused = admit(&timing, &profile(7000.0)).unwrap_err();
    // 0.945 up to the rounding of four products.
    assert!((refused.load - 0.945).abs() < 1e-12);
    assert_eq!(
        refused.to_string(),
        "link profile loads the bus to 94.5 % in the worst case; at most 80 % is allowed"
    );
    assert!(admit(&timing, &profile(f64::NAN)).is_err());

    // Known for this pair at 1 kHz: 24 B in 89 us and 48 B in 137 us at worst.
    let pair = [24, 48].map(|len| Traffic {
        frame: CanFrame::fd(standard(0x240), &vec![0; len], true).unwrap(),
        rate: 1000.0,
    });
    let load = worst_case_load(&timing, &pair);
    assert!((load - 0.226).abs() < 0.001 && load < MAX_LOAD);
}

/// One frame of random traffic: node, gap since the previous one, frame. Every node has its own identifiers, so nothing
/// collides; gaps between zero and more than a frame mix contention with an idle bus.
fn any_traffic() -> impl Strategy<Value = Vec<(usize, u64, CanFrame)>> {
    let item = (
        0_usize..4,
        prop_oneof![Just(0_u64), 0_u64..400_000],
        0_u16..8,
        any::<bool>(),
        any::<bool>(),
    );
    proptest::collection::vec(item, 1..60).prop_map(|items| {
        items
            .into_iter()
            .enumerate()
            .map(|(serial, (node, gap, id, fd, ext))| {
                let raw = id << 2 | node as u16;
                let id = if ext {
                    extended(u32::from(raw) << 18)
                } else {
                    standard(raw)
                };
                let serial = [serial as u8];
                let frame = if fd {
                    CanFrame::fd(id, &serial, true).unwrap()
                } else {
                    classical(id, &serial)
                };
                (node, gap, frame)
            })
            .collect()
    })
}

/// Feeds the traffic in order of time, taking deliveries either as they come or only at the end.
fn run(traffic: &[(usize, u64, CanFrame)], eager: bool) -> (Vec<Delivery>, BuiltinBus) {
    let (mut bus, nodes) = bus_of(4);
    let mut now = ns(0);
    let mut delivered = Vec::new();
    for (node, gap, frame) in traffic {
        now += Duration::from_nanos(*gap);
        if eager {
            delivered.extend(std::iter::from_fn(|| bus.pop_delivery(now)));
        }
        bus.enqueue(nodes[*node], now, frame).unwrap();
    }
    delivered.extend(drain(&mut bus));
    (delivered, bus)
}

fn queued_at(traffic: &[(usize, u64, CanFrame)]) -> HashMap<CanFrame, Instant> {
    let mut now = ns(0);
    traffic
        .iter()
        .map(|(_, gap, frame)| {
            now += Duration::from_nanos(*gap);
            (*frame, now)
        })
        .collect()
}

proptest! {
    #[test]
    fn every_frame_is_delivered_once(traffic in any_traffic()) {
        let (delivered, bus) = run(&traffic, true);
        let key = |frame: &CanFrame| frame.to_string();
        let mut sent: Vec<_> = traffic.iter().map(|(_, _, f)| key(f)).collect();
        let mut got: Vec<_> = delivered.iter().map(|d| key(&d.frame)).collect();
        sent.sort();
        got.sort();
        prop_assert_eq!(sent, got);
        prop_assert_eq!(bus.statistics().refused, 0);
    }

    #[test]
    fn at_every_start_the_highest_priority_waiting_wins(traffic in any_traffic()) {
        let (delivered, _) = run(&traffic, true);
        let queued = queued_at(&traffic);
        for (at, winner) in delivered.iter().enumerate() {
            for loser in &delivered[at + 1..] {
                // `Ord` of identifiers is the order of arbitration. Equal ones were queued earlier by the same node.
                if queued[&loser.frame] <= winner.start {
                    prop_assert!(winner.frame.id() <= loser.frame.id());
                }
                if winner.frame.id() == loser.frame.id() {
                    prop_assert!(queued[&winner.frame] <= queued[&loser.frame]);
                    prop_assert!(winner.frame.data()[0] < loser.frame.data()[0]);
                }
            }
        }
    }

    /// Work-conserving: a frame starts when it is queued or when the bus is free again; never earlier, never later.
    #[test]
    fn the_bus_is_never_idle_while_a_frame_waits(traffic in any_traffic()) {
        let (delivered, _) = run(&traffic, true);
        let queued = queued_at(&traffic);
        let mut idle = ns(0);
        for (at, delivery) in delivered.iter().enumerate() {
            let oldest = delivered[at..].iter().map(|d| queued[&d.frame]).min().unwrap();
            prop_assert_eq!(delivery.start, oldest.max(idle));
            idle = delivery.start + duration(&delivery.frame);
            prop_assert_eq!(delivery.time + AFTER_VALID, idle);
        }
    }

    #[test]
    fn the_books_add_up(traffic in any_traffic()) {
        let (delivered, bus) = run(&traffic, true);
        let queued = queued_at(&traffic);
        let statistics = bus.statistics();
        let busy: Duration = delivered.iter().map(|d| duration(&d.frame)).sum();
        let wait = delivered.iter().map(|d| d.start.since(queued[&d.frame])).max().unwrap();
        prop_assert_eq!(statistics.total.frames, delivered.len() as u64);
        prop_assert_eq!(statistics.total.busy, busy);
        prop_assert_eq!(statistics.total.max_wait, wait);
        let mut by_id = BTreeMap::<Id, (u64, Duration)>::new();
        for delivery in &delivered {
            let entry = by_id.entry(delivery.frame.id()).or_default();
            entry.0 += 1;
            entry.1 += duration(&delivery.frame);
        }
        let got: BTreeMap<_, _> = statistics.by_id.iter().map(|(id, c)| (*id, (c.frames, c.busy))).collect();
        prop_assert_eq!(got, by_id);
        // The bus is never more than full, up to the end of the last intermission.
        let end = delivered.last().unwrap().time + AFTER_VALID;
        prop_assert!(statistics.total.load(end.since(ns(0))) <= 1.0);
    }

    /// The times of the caller's polling change nothing, and the same traffic gives the same run.
    #[test]
    fn the_run_does_not_depend_on_when_deliveries_are_taken(traffic in any_traffic()) {
        let (eager, bus) = run(&traffic, true);
        let (late, again) = run(&traffic, false);
        prop_assert_eq!(eager, late);
        prop_assert_eq!(bus.statistics(), again.statistics());
    }
}
