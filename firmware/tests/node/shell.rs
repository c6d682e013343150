//! What the shell around the node reports: its CAN controller, and its time.

use protocol::messages::{Cause, Mode, MotionRequest, Outcome};

use crate::bench::Bench;
use crate::faults::states;

/// Bus-off stops the arm at once, whatever has been received since, and every time; without torque it is no fault.
#[test]
fn bus_off_stops_the_arm() {
    let mut bench = Bench::moving();
    bench.node.bus_off();
    assert_eq!(bench.mode(), Mode::FaultReaction);
    bench.run(1000);
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Fault, Cause::BusOff)
    );
    assert_eq!(
        bench.request(MotionRequest::FaultReset),
        Some(Outcome::Accepted)
    );
    bench.run(2);
    bench.node.bus_off();
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Ready, Cause::None)
    );
}

/// A row of late samples ends with one in time; every one of them is counted.
#[test]
fn samples_that_take_too_long_stop_the_arm_at_the_fifth_in_a_row() {
    let mut bench = Bench::enabled();
    for _ in 0..10 {
        for _ in 0..4 {
            bench.step();
            bench.node.count_overrun();
        }
        bench.step();
    }
    assert_eq!(bench.mode(), Mode::Enabled);
    for late in 1..=5 {
        bench.step();
        bench.node.count_overrun();
        let expected = if late < 5 {
            Mode::Enabled
        } else {
            Mode::FaultReaction
        };
        assert_eq!(bench.mode(), expected, "{late}");
    }
    let sent = bench.run(40);
    let last = states(&sent)
        .last()
        .map(|state| (state.overruns, state.cause));
    assert_eq!(last, Some((45, Cause::Overrun)));
}

/// Several late calls within a sample are one late sample, whatever the number of samples is.
#[test]
fn late_calls_of_one_sample_count_once() {
    let mut bench = Bench::enabled();
    (0..100).for_each(|_| bench.node.count_overrun());
    assert_eq!(bench.mode(), Mode::Enabled);
    for _ in 0..3 {
        bench.step();
        (0..2).for_each(|_| bench.node.count_overrun());
    }
    assert_eq!(bench.mode(), Mode::Enabled);
    bench.step();
    bench.node.count_overrun();
    assert_eq!(bench.mode(), Mode::FaultReaction);
}
