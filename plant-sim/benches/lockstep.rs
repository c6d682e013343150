//! Speed of the whole loop in lock-step relative to real time, on one core.
//!
//! `cargo bench -p plant-sim` reports samples per second; at 1 kHz, 1000 is real time.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use plant_sim::run::execute;
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

fn lockstep(criterion: &mut Criterion) {
    let mut scenario = Scenario::built_in("gate").expect("the gate is built in");
    scenario.cycles = 2;
    let config = RunConfig::new(scenario);
    let directory = std::env::temp_dir().join(format!("lockstep-bench-{}", std::process::id()));
    let samples = |sim_time_s: f64| (sim_time_s * config.scenario.rate_hz) as u64;
    let sim = in_process(&config, &mut ())
        .expect("the gate runs")
        .sim_time_s;
    let mut group = criterion.benchmark_group("lockstep, 1 kHz");
    group.throughput(Throughput::Elements(samples(sim)));
    group.bench_function("gate, nothing written", |bench| {
        bench.iter(|| in_process(&config, &mut ()).expect("the gate runs"));
    });
    group.bench_function("gate, trace and truth written", |bench| {
        bench.iter(|| execute(&config, &directory).expect("the gate runs"));
    });
    group.finish();
    let _ = std::fs::remove_dir_all(directory);
}

criterion_group!(benches, lockstep);
criterion_main!(benches);
