//! The table of docs/motion.md: every control law on the gate, with the right and a wrong model.
//!
//! Arguments are control rates in Hz; default 1000.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

const LAWS: [&str; 10] = [
    "kinematic-joint",
    "kinematic-task",
    "pid",
    "pd-gravity",
    "computed-torque:none",
    "computed-torque:integral",
    "computed-torque:observer",
    "computed-torque-task:none",
    "computed-torque-task:integral",
    "computed-torque-task:observer",
];

fn main() {
    let mut rates: Vec<f64> = std::env::args()
        .skip(1)
        .map(|rate| rate.parse().expect("a rate in Hz"))
        .collect();
    if rates.is_empty() {
        rates.push(1000.0);
    }
    println!(
        "| law | model | rate Hz | cycle s | error max mm | error rms mm | settling ms | final error mm |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for rate in rates {
        for name in ["gate", "gate-mismatch"] {
            for law in LAWS {
                row(name, law, rate);
            }
        }
    }
}

fn row(name: &str, law: &str, rate: f64) {
    let mut scenario = Scenario::built_in(name).expect("built in");
    scenario.law = law.parse().expect("a law's name");
    scenario.rate_hz = rate;
    let config = RunConfig::new(scenario);
    let summary = match in_process(&config, &mut ()) {
        Ok(summary) => summary,
        Err(error) => return println!("| {law} | {name} | {rate} | {error} |"),
    };
    let model = if name == "gate" { "right" } else { "wrong" };
    let cycle = summary
        .cycle_time_s
        .map_or("-".into(), |time| format!("{:.3}", time.mean));
    let settling = summary
        .settle_time_s
        .map_or("> dwell".into(), |time| format!("{:.1}", time.max * 1e3));
    let last = summary
        .final_error_mm
        .max
        .map_or("-".into(), |error| format!("{error:.4}"));
    let error = summary.tracking_error_mm;
    println!(
        "| {law} | {model} | {rate} | {cycle} | {:.3} | {:.3} | {settling} | {last} |",
        error.max, error.rms
    );
}
