//! No false alarm: every scenario without what it breaks, at three rates, with the noise of sound encoders.
//!
//! Whatever is reported is wrong then: a fault, a lost frame, a late command, a sample bridged, and a warm motor where none is. Each
//! case, of other noise than the others, runs twice and has to give the same frames and the same motion, and memory has to stay where
//! it is.
//!
//! `cargo test` simulates every case for a few cycles. `tests/nightly quiet` simulates a day, to which each case counts once:
//! `QUIET_HOURS=24 cargo test --release -p tests --test quiet -- --nocapture`.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, fs, io, thread, time};

use protocol::codec::decode;
use protocol::frame::CanFrame;
use protocol::messages::{LimitFlags, Message};
use protocol::time::Instant;
use sim::metrics::Heat;
use sim::observer::{Observer, Truth};
use sim::run::in_process;
use sim::scenario::{self, Ending, Scenario, Step};
use sim::setup::RunConfig;
use sim::summary::Summary;

const RATES: [f64; 3] = [500.0, 1000.0, 2000.0];
/// What a process may take more in the end than after its first case, MiB: the results of some thousand cycles, and what the
/// allocator keeps.
const ROOM: f64 = 4.0;
/// Two counts of the encoders, rad and m: 2 pi / 131072 / gear ratio of the axis, 25 mm / 131072 for the lift.
const NOISE: [&str; 4] = [
    "encoder:shoulder:noise=0.0000012@0s",
    "encoder:elbow:noise=0.000002@0s",
    "encoder:lift:noise=0.0000004@0s",
    "encoder:wrist:noise=0.000005@0s",
];

/// Heat in truth from which a motor may be called warm, of 1: 3 % less than the controller's own limit, since it looks at the torque in
/// every tenth sample only, which is each 20 ms at 500 Hz.
const WARM: f64 = 0.87;
/// A torque at its limit is no warning: moves are planned to it.
const TORQUES: LimitFlags = LimitFlags::TORQUE_SHOULDER
    .with(LimitFlags::TORQUE_ELBOW, true)
    .with(LimitFlags::TORQUE_LIFT, true)
    .with(LimitFlags::TORQUE_WRIST, true);

/// What a run has sent and done, in one number, and what the controller has reported.
struct Seen {
    hash: DefaultHasher,
    heat: Heat,
    /// Reports that warn of something, and those that say that a motor is warm while none is.
    warned: u64,
    wrong: u64,
    rejected: u16,
}

impl Observer for Seen {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        (time, frame).hash(&mut self.hash);
        if let Ok(Message::State(state)) = decode(frame).map(|received| received.message) {
            let is_warm = state.limits.contains(LimitFlags::WARM);
            let heat = self.heat.shares().into_iter().fold(0.0, f64::max);
            self.wrong += u64::from(is_warm && heat < WARM);
            let expected = TORQUES | LimitFlags::WARM;
            self.warned += u64::from(!expected.contains(state.limits));
            self.rejected = self.rejected.max(state.rejected);
        }
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.heat.sample(truth.plant.t, &truth.plant.tau);
        truth.plant.q.map(f64::to_bits).hash(&mut self.hash);
        Ok(())
    }
}

/// The scenario with nothing that stops or breaks it, and nothing required that holds for its own number of cycles. What would be stopped
/// stands for a second.
fn sound(name: &str, rate: f64, seed: u64) -> Scenario {
    let mut scenario = Scenario::built_in(name).unwrap();
    scenario.rate_hz = rate;
    scenario.cycles = 1;
    scenario.seed = seed;
    scenario.faults = NOISE.map(|text| text.parse().unwrap()).to_vec();
    for step in &mut scenario.cycle {
        if matches!(step, Step::Estop(_)) {
            *step = Step::Dwell(1.0);
        }
    }
    scenario.ends = Ending::Completed;
    scenario.requirements.clear();
    scenario
}

fn run(scenario: &Scenario) -> (Summary, u64) {
    let config = RunConfig::new(scenario.clone());
    let mut seen = Seen {
        hash: DefaultHasher::new(),
        heat: Heat::new(&config.nominal),
        warned: 0,
        wrong: 0,
        rejected: 0,
    };
    let summary = in_process(&config, &mut seen).unwrap();
    let case = format!("{} at {} Hz", scenario.name, scenario.rate_hz);
    assert_eq!(summary.error, None, "{case}");
    assert!(summary.completed, "{case}");
    assert!(summary.faults.is_empty(), "{case}: {:?}", summary.faults);
    let alarms = [
        summary.overruns,
        summary.frames_lost,
        summary.bus_errors,
        seen.warned,
        seen.wrong,
        seen.rejected.into(),
    ];
    assert_eq!(
        alarms, [0; 6],
        "{case}: overruns, frames lost, bus errors, warnings, motors wrongly called warm, frames rejected"
    );
    (summary, seen.hash.finish())
}

/// Resident memory of this process, MiB.
fn memory() -> f64 {
    let pages = fs::read_to_string("/proc/self/statm").unwrap();
    let pages: f64 = pages.split(' ').nth(1).unwrap().parse().unwrap();
    pages * 4096.0 / f64::from(1 << 20)
}

#[test]
fn nothing_is_reported_where_nothing_is_wrong() {
    let hours: f64 = env::var("QUIET_HOURS").map_or(0.0, |hours| hours.parse().unwrap());
    let cases: Vec<(&str, f64)> = scenario::names()
        .into_iter()
        .flat_map(|name| RATES.map(|rate| (name, rate)))
        .collect();
    let each = hours * 3600.0 / cases.len() as f64;
    let begun = time::Instant::now();
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(name, rate)) = cases.get(number) else {
                break;
            };
            let mut scenario = sound(name, rate, number as u64);
            let one = run(&scenario).0.sim_time_s;
            scenario.cycles = 2;
            // The first has the start and the end besides.
            let more = run(&scenario).0.sim_time_s - one;
            scenario.cycles = (1.0 + (each - one) / more).ceil().max(2.0) as u32;
            let before = memory();
            let (summary, hash) = run(&scenario);
            let after = memory();
            let (_, again) = run(&scenario);
            assert_eq!(hash, again, "{name} at {rate} Hz differs from itself");
            println!(
                "{name:16} {rate:5} Hz  {:7} cycles  {:9.1} s  {:016x}  {:+.1} MiB",
                summary.cycles,
                summary.sim_time_s,
                hash,
                after - before
            );
            let result = (summary.sim_time_s, summary.frames, memory(), hash);
            results.lock().unwrap().push(result);
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().unwrap().get() {
            scope.spawn(work);
        }
    });
    let results = results.into_inner().unwrap();
    assert_eq!(results.len(), cases.len());
    let seconds: f64 = results.iter().map(|(seconds, ..)| seconds).sum();
    let frames: u64 = results.iter().map(|(_, frames, ..)| frames).sum();
    let different: HashSet<u64> = results.iter().map(|(.., hash)| *hash).collect();
    assert_eq!(different.len(), cases.len(), "two cases are the same");
    let (first, last) = (results[0].2, results[results.len() - 1].2);
    assert!(last - first < ROOM, "memory {first:.1} to {last:.1} MiB");
    println!(
        "{:.2} h in {} different cases, {frames} frames: no fault, no wrong warning, no frame lost or rejected, no late command; \
         every case\nthe same a second time; memory {first:.1} MiB after the first case, {last:.1} MiB after the last; {:.0} min",
        seconds / 3600.0,
        cases.len(),
        begun.elapsed().as_secs_f64() / 60.0
    );
}
