//! A case of a campaign takes no memory for a sample: what it allocates for twice as many is as much.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use sim::campaign::trial;
use sim::controller::InProcess;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

/// The system's memory, with a count of what is taken from it.
struct Counting;

static TAKEN: AtomicU64 = AtomicU64::new(0);

// SAFETY: everything is left to the system; counting touches no memory of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        TAKEN.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are those of the system.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        TAKEN.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are those of the system.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are those of the system.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static MEMORY: Counting = Counting;

/// What a longer run may take besides: lists of cycles, moves and frames under way grow to twice their size now and then.
const EACH_CYCLE: u64 = 5;

/// Faults that a sound system survives, of every part of a run that has something to do in every sample. Not among them: errors on
/// the bus, of which each takes some twenty pieces of memory while it is worked out.
const FAULTS: [Option<&str>; 12] = [
    None,
    Some("feedback:loss=0.01@0.1s"),
    Some("feedback:delay=0.001@0.1s"),
    Some("feedback:duplicate@0.1s"),
    Some("feedback:reorder@0.1s"),
    Some("command:replay@0.1s"),
    Some("command:masquerade@0.1s"),
    Some("feedback:forged@0.1001s"),
    Some("clock:drift=0.0001@0.1s"),
    Some("encoder:shoulder:noise=0.000001@0.1s"),
    Some("motor:lift:weak=0.9@0.1s"),
    Some("payload:heavier=2@0.1s"),
];

/// Allocations and samples of a case.
fn run(cycles: u32, fault: Option<&str>) -> (u64, u64) {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = cycles;
    scenario.faults = fault
        .into_iter()
        .map(|text| text.parse().unwrap())
        .collect();
    let config = RunConfig::new(scenario);
    let connect = |config| Ok(InProcess::new(config));
    let before = TAKEN.load(Ordering::Relaxed);
    let (verdict, rig, end) = trial::run(&config, connect, &mut ()).unwrap();
    let taken = TAKEN.load(Ordering::Relaxed) - before;
    assert!(verdict.survived && end.is_ok(), "{fault:?}: {verdict:?}");
    (taken, (rig.now().seconds() * 1e3) as u64)
}

/// One test, so that nothing else counts meanwhile.
#[test]
fn a_case_allocates_nothing_per_sample() {
    for fault in FAULTS {
        let ((two, short), (four, long)) = (run(2, fault), run(4, fault));
        println!("{fault:?}: {two} in {short} samples, {four} in {long}");
        assert!(long - short > 1000, "{fault:?}");
        assert!(
            four - two <= 2 * EACH_CYCLE,
            "{fault:?}: {two}, then {four}"
        );
    }
}
