//! Errors on the bus at random: frames arrive in the end, counters stay in their ranges, times add up.

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
use proptest::prelude::*;
use protocol::frame::{CanFrame, Id, StandardId};
use protocol::table::COMMAND;
use protocol::time::Duration;
use protocol::wire::{BitTiming, FrameBits};
use sim::bus::{BuiltinBus, Delivery, Disturbance, Disturbed, ErrorKind, NodeId, Noticed, Report};

fn attempts(kind: ErrorKind) -> Disturbed {
    Disturbed::Message(&COMMAND, kind)
}

/// Node and gap of each frame; kind, beginning, length and share of each disturbance; seed.
type Run = (Vec<(usize, u64)>, Vec<(usize, u64, u64, f64)>, u64);

/// Errors, rates and gaps of random traffic from three nodes.
fn any_run() -> impl Strategy<Value = Run> {
    let sends = prop::collection::vec((0_usize..3, 0_u64..500_000), 1..40);
    let errors = prop::collection::vec(
        (0_usize..6, 0_u64..5_000_000, 0_u64..3_000_000, 0.0..=1.0),
        0..4,
    );
    (sends, errors, any::<u64>())
}

type Outcome = (Vec<Delivery>, Vec<Report>, BuiltinBus, Vec<NodeId>);

/// Command frames of one node and others of two; deliveries are taken as they come or at the end of each gap.
fn play((sends, errors, seed): &Run, eager: bool) -> Outcome {
    let mut bench = Bench::of(3);
    for (kind, from, lasts, share) in errors {
        let kinds = [
            ErrorKind::Bit,
            ErrorKind::Stuff,
            ErrorKind::Form,
            ErrorKind::Crc,
            ErrorKind::Ack,
        ];
        let what = kinds
            .get(*kind)
            .map_or(Disturbed::Reader(bench.nodes[1]), |kind| attempts(*kind));
        let (from, until, share) = (ns(*from), ns(from + lasts), *share);
        bench.bus.disturb(
            Disturbance {
                what,
                share,
                from,
                until,
            },
            *seed,
        );
    }
    let (mut now, mut delivered) = (0, Vec::new());
    for (serial, (node, gap)) in sends.iter().enumerate() {
        now += gap;
        while eager
            && let Some(next) = bench.bus.next_event()
            && next < ns(now)
        {
            delivered.extend(bench.run(next.nanos()));
        }
        delivered.extend(bench.run(now - 1.min(now)));
        let raw = if *node == 0 {
            COMMAND.id
        } else {
            0x500 + *node as u16
        };
        let id = Id::Standard(StandardId::new(raw).unwrap());
        bench.send(
            *node,
            now,
            &CanFrame::fd(id, &[serial as u8; 12], true).unwrap(),
        );
    }
    delivered.extend(bench.run(now + 1_000_000_000));
    (delivered, bench.reports, bench.bus, bench.nodes)
}

proptest! {
    /// Whatever goes wrong, once it is over every frame has arrived, at least once at every node that did not misread it.
    #[test]
    fn frames_arrive_in_the_end(run in any_run()) {
        let (delivered, _, bus, nodes) = play(&run, true);
        let serials: std::collections::BTreeSet<u8> = delivered.iter().map(|it| it.frame.data()[0]).collect();
        prop_assert_eq!(serials.len(), run.0.len());
        prop_assert_eq!(bus.next_event(), None);
        // Counters stay in their ranges.
        for node in nodes {
            let counters = bus.counters(node);
            prop_assert!(counters.transmit() < 256 && counters.receive() < 256);
        }
    }

    /// Attempts follow each other without overlap, and the time of the bus is the sum of theirs.
    #[test]
    fn time_on_the_bus_adds_up(run in any_run()) {
        let (delivered, reports, bus, _) = play(&run, true);
        let statistics = bus.statistics();
        let by_id: Duration = statistics.by_id.values().map(|it| it.busy).sum();
        prop_assert_eq!(statistics.total.busy, by_id);
        prop_assert_eq!(statistics.total.frames, delivered.len() as u64);
        let frames: Duration = delivered.iter().map(|it| BitTiming::default().duration(FrameBits::exact(&it.frame))).sum();
        let errors = reports.iter().filter(|it| matches!(it.what, Noticed::Error { .. })).count() as u64;
        prop_assert_eq!(statistics.total.errors, errors);
        // An error costs at most the frame of 12 bytes, 12 bits of flags, 8 of delimiter, 3 of intermission.
        let frame = CanFrame::fd(StandardId::new(0).unwrap(), &[0; 12], true).unwrap();
        let most = BitTiming::default().duration(FrameBits::worst_case(&frame)) + Duration::from_micros(23);
        prop_assert!(statistics.total.busy >= frames);
        prop_assert!(statistics.total.busy.nanos() <= frames.nanos() + errors * most.nanos());
        for two in delivered.windows(2) {
            prop_assert!(two[0].time < two[1].start);
        }
        prop_assert!(reports.windows(2).all(|two| two[0].time <= two[1].time));
    }

    /// Looking ahead and taking deliveries late change nothing.
    #[test]
    fn the_run_does_not_depend_on_polling(run in any_run()) {
        let (eager, told, bus, _) = play(&run, true);
        let (late, told_late, other, _) = play(&run, false);
        prop_assert_eq!(eager, late);
        prop_assert_eq!(told, told_late);
        prop_assert_eq!(bus.statistics(), other.statistics());
    }
}
