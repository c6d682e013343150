//! The drawn data agree with the run.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::Value;
use sim::curves::Curves;
use sim::observer::{Observer, Truth};
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

#[derive(Default)]
struct Truths(Vec<Truth>);

impl Observer for Truths {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.0.push(*truth);
        Ok(())
    }
}

fn gate(cycles: u32, rate_hz: f64) -> RunConfig {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = cycles;
    scenario.rate_hz = rate_hz;
    RunConfig::new(scenario)
}

/// The data drawn of a run, and its truth.
fn run(config: &RunConfig) -> (Value, Vec<Truth>, f64) {
    let mut observers = (Curves::new(config), Truths::default());
    let summary = in_process(config, &mut observers).unwrap();
    let (curves, truths) = observers;
    let drawing = serde_json::to_value(curves.finish(config)).unwrap();
    (drawing, truths.0, summary.bus_load)
}

fn floats(base64: &Value) -> Vec<f32> {
    let bytes = BASE64_STANDARD.decode(base64.as_str().unwrap()).unwrap();
    let four = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    bytes.chunks_exact(4).map(four).collect()
}

#[test]
fn a_short_run_is_drawn_sample_by_sample() {
    let (drawing, truths, bus_load) = run(&gate(1, 1000.0));
    assert_eq!(drawing["samples"], truths.len());
    assert_eq!(drawing["samples_per_value"], 1);
    let curve = |name: &str| {
        let mut values = floats(&drawing["curves"][name]);
        values.truncate(truths.len());
        values
    };
    let lift = curve("q3");
    let error = curve("error1");
    let effort = curve("effort4");
    for (index, truth) in truths.iter().enumerate() {
        assert_eq!(lift[index], truth.plant.q[2] as f32);
        assert_eq!(effort[index], truth.plant.tau[3] as f32);
        if truth.plant.t > 0.1 {
            assert_eq!(error[index], (truth.mind.q[0] - truth.plant.q[0]) as f32);
        }
    }
    // The closed form of a SCARA's pose, with the arm lengths of the data sheet.
    let place = |[t1, t2, d3, _]: [f64; 4]| {
        let (a, b) = (0.56, 0.49);
        [
            a * t1.cos() + b * (t1 + t2).cos(),
            a * t1.sin() + b * (t1 + t2).sin(),
            -d3 - 0.1213,
        ]
    };
    let distances = truths.iter().map(|truth| {
        let [one, other] = [truth.plant.q, truth.mind.q].map(place);
        let squares: f64 = (0..3).map(|axis| (one[axis] - other[axis]).powi(2)).sum();
        squares.sqrt()
    });
    let drawn = curve("tool_error");
    for (index, distance) in distances.enumerate().skip(100) {
        assert!((f64::from(drawn[index]) - distance).abs() < 1e-9, "{index}");
    }
    // Shares of the samples add up to the share of the run.
    let loads = curve("bus_load");
    let mean = loads.iter().copied().map(f64::from).sum::<f64>() / loads.len() as f64;
    assert!(
        (mean - bus_load).abs() < 1e-4 * bus_load.max(1.0),
        "{mean} {bus_load}"
    );
    // Two frames of 48 and 24 bytes at 1 and 5 Mbit/s and 40 us of computing take a quarter of a millisecond and more where
    // something else has the bus; a command never comes after the next sample here.
    let latency = curve("latency");
    let came = latency.iter().filter(|latency| !latency.is_nan());
    assert!(came.clone().count() > truths.len() - 10);
    assert!(came.clone().all(|latency| (2e-4..1e-3).contains(latency)));
}

#[test]
fn a_long_run_takes_no_more_room_and_keeps_its_peaks() {
    let (drawing, truths, _) = run(&gate(11, 2000.0));
    let length = drawing.to_string().len();
    assert!(length < 1_300_000, "{length} bytes");
    let per_value = drawing["samples_per_value"].as_u64().unwrap();
    assert!(per_value > 1);
    let greatest = |values: &mut dyn Iterator<Item = f32>| values.fold(f32::MIN, f32::max);
    for axis in 0..4 {
        let drawn = floats(&drawing["curves"][format!("effort{}", axis + 1)]);
        let found = greatest(&mut drawn.into_iter());
        let true_one = greatest(&mut truths.iter().map(|truth| truth.plant.tau[axis] as f32));
        assert_eq!(found, true_one);
    }
    // Poses are those of one instant.
    let every = drawing["samples_per_pose"].as_u64().unwrap() as usize;
    let poses = floats(&drawing["poses"]);
    assert!(every > 1 && poses.len() / 8 > 2000 && poses.len() / 8 <= 4096);
    for (pose, truth) in poses.chunks_exact(8).zip(truths.iter().step_by(every)) {
        assert_eq!(pose[..4], truth.plant.q.map(|q| q as f32));
    }
}
