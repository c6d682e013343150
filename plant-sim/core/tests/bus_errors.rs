//! Errors on the bus against ISO 11898-1 by hand: what nodes count, how long it takes, who goes on.

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
use protocol::table::{COMMAND, FEEDBACK};
use protocol::time::Duration;
use protocol::wire::{BitTiming, FrameBits};
use sim::bus::{Affliction, Counters, Disturbance, Disturbed, ErrorKind, Noticed, State};

/// A microsecond is a nominal bit at the default 1 Mbit/s.
const BIT: u64 = 1_000;

fn attempts(kind: ErrorKind) -> Disturbed {
    Disturbed::Message(&COMMAND, kind)
}

fn command() -> CanFrame {
    let id = Id::Standard(StandardId::new(COMMAND.id).unwrap());
    CanFrame::fd(id, &[0x55; 24], true).unwrap()
}

fn feedback() -> CanFrame {
    let id = Id::Standard(StandardId::new(FEEDBACK.id).unwrap());
    CanFrame::classical(id, &[0x55; 8]).unwrap()
}

impl Bench {
    fn disturb(&mut self, what: Disturbed, from: u64, until: u64) {
        self.disturb_by(0, what, from, until);
    }

    fn disturb_by(&mut self, seed: u64, what: Disturbed, from: u64, until: u64) {
        let (from, until) = (ns(from), ns(until));
        self.bus.disturb(
            Disturbance {
                what,
                share: 1.0,
                from,
                until,
            },
            seed,
        );
    }

    fn counters(&self) -> Vec<(u16, u16)> {
        let counters = |&node| self.bus.counters(node);
        let both = |it: Counters| (it.transmit(), it.receive());
        self.nodes.iter().map(counters).map(both).collect()
    }
}

/// Makes a node error passive by frames of its own that have errors, `from` then on.
fn wear_out(bench: &mut Bench, node: usize, frame: &CanFrame, until: u64) {
    bench.send(node, 0, frame);
    while bench.bus.counters(bench.nodes[node]).transmit() < 128 {
        let next = bench.bus.next_event().expect("the frame is repeated");
        assert!(next < ns(until));
        bench.bus.pop_delivery(next);
    }
    bench.reports.extend(bench.bus.reports());
}

/// One error, then calm: bits from the beginning of the error flag to the next start of frame, and counters of transmitter and of
/// two receivers before the frame is repeated.
#[test]
fn an_error_costs_what_the_standard_says() {
    for (kind, flags, counters) in [
        // One node sees it first: the flags of the others follow, and end a whole flag later at most.
        (ErrorKind::Bit, 12, [(8, 0), (0, 1), (0, 1)]),
        (ErrorKind::Form, 6, [(8, 0), (0, 1), (0, 1)]),
        // The transmitter's flag violates the delimiter that the others expect.
        (ErrorKind::Ack, 7, [(8, 0), (0, 1), (0, 1)]),
        (ErrorKind::Crc, 7, [(8, 0), (0, 1), (0, 1)]),
    ] {
        let mut bench = Bench::of(3);
        bench.disturb(attempts(kind), 0, 1);
        bench.send(0, 0, &command());
        let flag = bench.bus.next_event().unwrap().nanos();
        assert!(bench.run(flag).is_empty());
        assert_eq!(bench.counters(), counters, "{kind:?}");
        let Noticed::Error {
            kind: reported,
            sending,
            ..
        } = bench.reports[0].what
        else {
            panic!("{:?}", bench.reports);
        };
        assert_eq!((reported, sending), (kind, kind != ErrorKind::Crc));

        let again = bench.run(u64::MAX);
        // Delimiter and intermission.
        assert_eq!(
            again[0].start.nanos(),
            flag + (flags + 8 + 3) * BIT,
            "{kind:?}"
        );
        let repaired = [(7, 0), (0, 0), (0, 0)];
        assert_eq!(bench.counters(), repaired);
        let total = bench.bus.statistics().total;
        assert_eq!((total.frames, total.errors), (1, 1));
        // No gap: the error, then the frame.
        let frame = BitTiming::default().duration(FrameBits::exact(&command()));
        assert_eq!(total.busy, again[0].start.since(ns(0)) + frame);
        assert_eq!(total.max_wait, again[0].start.since(ns(0)));
    }
}

/// Without stuff bits an identifier of 0x240 would hold six zeros: the recessive stuff bit before its last one, in arbitration, is the
/// exception of rule c.
#[test]
fn a_stuff_error_in_arbitration_is_not_counted() {
    let mut counts = std::collections::BTreeSet::new();
    for seed in 0..40 {
        let mut bench = Bench::of(2);
        bench.disturb_by(seed, attempts(ErrorKind::Stuff), 0, 1);
        // Runs of zeros in the data as well.
        let id = Id::Standard(StandardId::new(COMMAND.id).unwrap());
        bench.send(0, 0, &CanFrame::classical(id, &[0]).unwrap());
        let flag = bench.bus.next_event().unwrap().nanos();
        bench.run(flag);
        let in_identifier = flag == 12 * BIT;
        let expected = if in_identifier { 0 } else { 8 };
        assert_eq!(
            bench.counters(),
            [(expected, 0), (0, 1)],
            "flag at {flag} ns"
        );
        counts.insert(expected);
        // All have seen it at once.
        assert_eq!(
            bench.run(u64::MAX)[0].start.nanos(),
            flag + (6 + 8 + 3) * BIT
        );
    }
    assert_eq!(counts.len(), 2);
}

/// Its bits at the data rate are a fifth as long; what follows the error is nominal.
#[test]
fn an_error_in_the_data_phase_goes_on_at_the_nominal_rate() {
    let mut ends = std::collections::BTreeSet::new();
    for seed in 0..200 {
        let mut bench = Bench::of(2);
        bench.disturb_by(seed, attempts(ErrorKind::Bit), 0, 1);
        bench.send(0, 0, &command());
        let flag = bench.bus.next_event().unwrap().nanos();
        // Up to BRS 18 bits of 1 us with the stuff bit, of which the last 3 can be wrong; then 200 ns each.
        assert!(
            (16 * BIT..=18 * BIT).contains(&flag) && flag.is_multiple_of(BIT)
                || flag > 18 * BIT && (flag - 18 * BIT).is_multiple_of(200)
        );
        ends.insert(flag);
        bench.run(flag);
        assert_eq!(
            bench.run(u64::MAX)[0].start.nanos(),
            flag + (12 + 8 + 3) * BIT
        );
    }
    assert!(ends.len() > 100, "{}", ends.len());
}

/// Nobody acknowledges: 16 attempts to error passive, then for ever without counting.
#[test]
fn a_node_alone_becomes_passive_and_never_bus_off() {
    let mut bench = Bench::of(1);
    bench.send(0, 0, &command());
    assert!(bench.run(1_000_000_000).is_empty());
    assert_eq!(bench.counters(), [(128, 0)]);
    let mut states = bench.reports.iter().filter_map(|it| match it.what {
        Noticed::State(state) => Some(state),
        _ => None,
    });
    assert_eq!(states.next(), Some(State::Warning));
    assert_eq!(states.next(), Some(State::ErrorPassive));
    assert_eq!(states.next(), None);
    // From start to start: up to the acknowledge slot, flag, delimiter, intermission, once passive 8 bits of suspension.
    let slot = BitTiming::default()
        .duration(FrameBits::exact(&command()))
        .nanos()
        - 11 * BIT;
    let errors: Vec<u64> = bench
        .reports
        .iter()
        .filter(|it| matches!(it.what, Noticed::Error { .. }))
        .map(|it| it.time.nanos())
        .collect();
    let gaps: Vec<u64> = errors.windows(2).map(|two| two[1] - two[0]).collect();
    assert!(
        gaps[..14].iter().all(|gap| *gap == slot + 17 * BIT),
        "{:?}",
        &gaps[..14]
    );
    // A passive node's whole frame is on the bus, and ends with its own flag.
    let passive = slot + 11 * BIT + (6 + 8) * BIT;
    assert!(
        gaps[16..].iter().all(|gap| *gap == passive),
        "{:?}",
        &gaps[14..20]
    );

    // A second node acknowledges, and it is active again with the next frame.
    bench.nodes.push(bench.bus.attach(64));
    assert_eq!(bench.run(1_001_000_000).len(), 1);
    assert_eq!(bench.counters(), [(127, 0), (0, 0)]);
}

/// 32 errors in a row: bus-off, 128 times 11 recessive bits, and the frame is sent after all.
#[test]
fn bus_off_ends_after_128_times_11_bits() {
    let mut bench = Bench::of(3);
    bench.disturb(attempts(ErrorKind::Bit), 0, 100_000_000);
    bench.send(0, 0, &command());
    while bench.bus.counters(bench.nodes[0]).state() != State::BusOff {
        let next = bench.bus.next_event().unwrap();
        assert!(bench.run(next.nanos()).is_empty());
    }
    assert_eq!(bench.counters(), [(256, 0), (0, 32), (0, 32)]);
    let errors = bench
        .reports
        .iter()
        .filter(|it| matches!(it.what, Noticed::Error { .. }));
    assert_eq!(errors.count(), 32);
    let off = bench.reports.last().unwrap();
    assert_eq!(off.what, Noticed::State(State::BusOff));
    let idle = off.time.nanos() + (12 + 8 + 3) * BIT;
    let back = idle + 128 * 11 * BIT;
    assert_eq!(bench.bus.next_event(), Some(ns(back)));

    // It receives nothing meanwhile; each frame on the bus counts once, however long it is.
    let frame = feedback();
    let busy = BitTiming::default()
        .duration(FrameBits::exact(&frame))
        .nanos();
    bench.send(1, idle, &frame);
    let heard = bench.run(idle + busy);
    assert!(heard[0].to.contains(bench.nodes[2]) && !heard[0].to.contains(bench.nodes[0]));
    let back = idle + busy + 127 * 11 * BIT;
    assert_eq!(bench.bus.next_event(), Some(ns(back)));
    bench.run(back);
    assert_eq!(bench.counters()[0], (0, 0));
    assert_eq!(bench.reports.last().unwrap().what, Noticed::Recovered);
}

#[test]
fn a_controller_that_nobody_tells_stays_bus_off() {
    for (until, back) in [
        (u64::MAX, None),
        (50_000_000, Some(50_000_000 + 128 * 11 * BIT)),
    ] {
        let mut bench = Bench::of(2);
        let left = Affliction::NoRecovery(bench.nodes[0]);
        bench.bus.afflict(left, ns(0), ns(until));
        bench.disturb(attempts(ErrorKind::Form), 0, 20_000_000);
        bench.send(0, 0, &command());
        assert!(bench.run(40_000_000).is_empty());
        assert_eq!(bench.bus.next_event(), back.map(ns));
        let delivered = bench.run(u64::MAX).len();
        assert_eq!(delivered, usize::from(back.is_some()));
    }
}

/// The transmitter's error flag is recessive: receivers take the frame, and take it again.
#[test]
fn a_passive_transmitter_without_acknowledgement_repeats_what_was_received() {
    let mut bench = Bench::of(2);
    bench.disturb(attempts(ErrorKind::Ack), 0, 4_000_000);
    bench.send(0, 0, &command());
    let delivered = bench.run(u64::MAX);
    assert_eq!(bench.counters(), [(127, 0), (0, 0)]);
    assert!(delivered.len() > 10, "{}", delivered.len());
    let gaps = delivered
        .windows(2)
        .map(|two| two[1].start.since(two[0].start));
    let frame = BitTiming::default().duration(FrameBits::exact(&command()));
    // Its own flag, delimiter and intermission end 6 bits after the frame that the others see; then 8 bits of suspension.
    assert!(
        gaps.collect::<Vec<_>>()
            .iter()
            .all(|gap| *gap == frame + Duration::from_nanos(14 * BIT))
    );
    assert_eq!(delivered.last().unwrap().frame, command());
}

/// Between two frames a passive transmitter waits 8 bits, in which a frame of lower priority may start.
#[test]
fn a_passive_transmitter_lets_others_go_first() {
    let mut bench = Bench::of(2);
    bench.disturb(attempts(ErrorKind::Form), 0, 20_000_000);
    wear_out(&mut bench, 0, &command(), 20_000_000);
    let bus = &mut bench.bus;
    let low = CanFrame::classical(Id::Standard(StandardId::new(0x7FF).unwrap()), &[]).unwrap();
    // During the error frame both have something to send; the first has priority, the second need not wait.
    let flag = bench.reports.last().unwrap().time;
    bus.enqueue(bench.nodes[1], flag, &low).unwrap();
    let idle = flag.nanos() + (6 + 8 + 3) * BIT;
    let delivered = bench.run(idle + 100 * BIT);
    assert_eq!((delivered[0].frame, delivered[0].start), (low, ns(idle)));
}

/// A node that reads wrong what others read right destroys it while it is active: 9 for it, 1 for the others. Once it is passive it
/// leaves the others in peace, and misses frames.
#[test]
fn a_bad_reader_becomes_passive_and_then_misses_frames_alone() {
    let mut bench = Bench::of(3);
    let bad = bench.nodes[2];
    bench.disturb(Disturbed::Reader(bad), 0, u64::MAX);
    bench.send(0, 0, &command());
    let first = bench.bus.next_event().unwrap();
    bench.run(first.nanos());
    assert_eq!(bench.counters(), [(8, 0), (0, 1), (0, 9)]);
    let delivered = bench.run(u64::MAX);
    // 15 times 9 is 135; in the 16th attempt it is passive.
    assert_eq!(bench.counters(), [(119, 0), (0, 14), (0, 136)]);
    assert_eq!(delivered.len(), 1);
    assert!(delivered[0].to.contains(bench.nodes[1]) && !delivered[0].to.contains(bad));
    assert_eq!(bench.bus.statistics().total.errors, 16);
}

/// What a listener does not acknowledge is not acknowledged; it hears what is not destroyed.
#[test]
fn a_listener_takes_no_part() {
    let mut bench = Bench::of(1);
    let listener = bench.bus.attach_listener(1);
    bench.send(0, 0, &command());
    let delivered = bench.run(10_000_000);
    assert_eq!(bench.counters(), [(128, 0)]);
    assert!(delivered.iter().all(|it| it.to.iter().eq([listener])));
    assert_eq!(bench.bus.counters(listener), Counters::default());
}

/// Error frames, with codes of `linux/can/error.h` written out by hand.
#[test]
fn error_frames_are_those_of_socketcan() {
    let mut bench = Bench::of(2);
    bench.disturb(attempts(ErrorKind::Ack), 0, 1);
    bench.disturb(attempts(ErrorKind::Form), 1, 20_000_000);
    bench.send(0, 0, &command());
    bench.run(20_000_000);
    let frames: Vec<String> = bench
        .reports
        .iter()
        .map(|it| it.error_frame(7).to_string())
        .collect();
    let tx = |text: &str, count: u32| format!("{text}, error-counter-tx-rx (tx {count}, rx 0)");
    assert_eq!(
        frames[0],
        tx(
            "protocol-violation (error-on-tx, at acknowledge-slot), no-acknowledgement-on-tx, bus-error",
            8
        )
    );
    assert!(
        frames[1].starts_with("protocol-violation (frame-format-error, error-on-tx, at "),
        "{}",
        frames[1]
    );
    assert!(frames.contains(&tx("controller-problem (tx-error-warning)", 96)));
    assert!(frames.contains(&tx("controller-problem (tx-error-passive)", 128)));
    assert!(frames.contains(&"bus-off".to_owned()));
    assert!(frames.contains(&"restarted-after-bus-off".to_owned()));
    let bytes = bench.reports[0].error_frame(7);
    assert_eq!(
        (bytes.class, bytes.data()),
        (0x0A8, [0, 0, 0x80, 0x19, 0, 7, 8, 0].as_slice())
    );
}
