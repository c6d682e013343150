//! Data that a page draws of a run: curves, poses and cycles, gathered during the run in bounded memory.

mod thinned;

use std::io;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use protocol::frame::CanFrame;
use protocol::messages::Mode;
use protocol::table;
use protocol::time::{Duration, Instant};
use protocol::wire::{BitTiming, FrameBits};
use serde::Serialize;
use trace::ErrorFrame;

use crate::model::RobotModel;
use crate::observer::{Observer, Truth};
use crate::plant::arm::Arm;
use crate::setup::RunConfig;
use crate::world::CellEvent;

use thinned::Thinned;

/// Names of the curves. Of joints: actual position (rad, m), reference minus actual, effort (N m, N); of the tool:
/// distance from its reference (m); of the bus: share of the time for which it was busy, and time from a sample to the
/// arrival of its command (s); and the code of the controller's state.
const CURVES: [&str; 16] = [
    "q1",
    "q2",
    "q3",
    "q4",
    "error1",
    "error2",
    "error3",
    "error4",
    "effort1",
    "effort2",
    "effort3",
    "effort4",
    "tool_error",
    "bus_load",
    "latency",
    "mode",
];

/// Most poses that are kept: those of every sample, every second, every fourth, and so on.
const MOST_POSES: usize = 4096;

/// Most cycles that are named.
const MOST_NAMED: usize = 200;

/// The observer that makes a [`Drawing`].
pub struct Curves {
    arm: Arm,
    timing: BitTiming,
    step_s: f64,
    curves: [Thinned; CURVES.len()],
    poses: Vec<[f32; 8]>,
    /// Samples from one pose to the next.
    stride: u64,
    samples: u64,
    cycles: Vec<f64>,
    /// Time for which the bus was busy since the last sample, ns.
    busy: u64,
    command: Option<Instant>,
}

/// Data that a page draws. Curves are little-endian f32 in base64.
#[derive(Clone, Debug, Serialize)]
pub struct Drawing {
    /// Time between two samples, s.
    step_s: f64,
    /// Samples in all.
    samples: u64,
    /// Samples per value of a curve; if more than one, each pair of values is the extremes of its span in their order.
    samples_per_value: u64,
    /// By name.
    curves: serde_json::Map<String, serde_json::Value>,
    /// Samples from one pose to the next.
    samples_per_pose: u64,
    /// Joint positions, four actual ones and the four of the reference for each pose.
    poses: String,
    /// Start times of cycles, s.
    cycles: Vec<f64>,
    /// Names of the controller's states by their codes.
    modes: Vec<(u8, &'static str)>,
    robot: Robot,
}

impl Drawing {
    /// As JSON, in one line: a megabyte, which is why it is written here, where code is optimised.
    #[must_use]
    pub fn json(&self) -> String {
        serde_json::to_string(self).expect("numbers and texts are JSON")
    }
}

/// Lengths and limits that are drawn; see [`crate::model`] for units.
#[derive(Clone, Debug, Serialize)]
pub struct Robot {
    a1: f64,
    a2: f64,
    d1: f64,
    d2: f64,
    d4: f64,
    lower: [f64; 4],
    upper: [f64; 4],
    effort: [f64; 4],
    effort_continuous: [f64; 4],
}

impl From<&RobotModel> for Robot {
    fn from(model: &RobotModel) -> Self {
        let (geometry, limits) = (&model.geometry, &model.limits);
        Self {
            a1: geometry.a1,
            a2: geometry.a2,
            d1: geometry.d1,
            d2: geometry.d2,
            d4: geometry.d4,
            lower: limits.lower,
            upper: limits.upper,
            effort: limits.effort,
            effort_continuous: limits.effort_continuous,
        }
    }
}

impl Curves {
    /// Empty curves for this run.
    pub fn new(config: &RunConfig) -> Self {
        Self {
            arm: Arm::new(&config.actual, None),
            timing: BitTiming::default(),
            step_s: 1.0 / config.scenario.rate_hz,
            curves: [const { Thinned::new() }; CURVES.len()],
            poses: Vec::new(),
            stride: 1,
            samples: 0,
            cycles: Vec::new(),
            busy: 0,
            command: None,
        }
    }

    /// The data to draw.
    pub fn finish(self, config: &RunConfig) -> Drawing {
        let curves = CURVES.into_iter().zip(&self.curves);
        Drawing {
            step_s: self.step_s,
            samples: self.samples,
            samples_per_value: self.curves[0].samples_per_value(),
            curves: curves
                .map(|(name, curve)| (name.to_owned(), base64(curve.values()).into()))
                .collect(),
            samples_per_pose: self.stride,
            poses: base64(self.poses.iter().flatten().copied()),
            cycles: self.cycles,
            modes: Mode::CODES.to_vec(),
            robot: Robot::from(&config.actual),
        }
    }

    fn tool(&self, q: &[f64; 4]) -> [f64; 3] {
        let pose = self.arm.pose(&self.arm.at(&(*q).into()));
        [pose.x, pose.y, pose.z]
    }
}

fn base64(values: impl Iterator<Item = f32>) -> String {
    let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
    BASE64_STANDARD.encode(bytes)
}

impl Observer for Curves {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.busy += self.timing.duration(FrameBits::exact(frame)).nanos();
        if table::COMMAND.identifies(frame) {
            self.command = Some(time);
        }
        Ok(())
    }

    fn error(&mut self, _: Instant, _: &ErrorFrame, busy: Duration) -> io::Result<()> {
        self.busy += busy.nanos();
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let (plant, mind) = (&truth.plant, &truth.mind);
        // A controller that has not seen its first sample has no reference.
        let has_reference = mind.mode != Mode::Boot;
        let set = if has_reference { mind.q } else { plant.q };
        let error = std::array::from_fn(|axis| set[axis] - plant.q[axis]);
        let [x, y, z] = self.tool(&set);
        let [dx, dy, dz] = [x - plant.tool[0], y - plant.tool[1], z - plant.tool[2]];
        let latency = match self.command.take() {
            Some(came) => came.seconds() - plant.t,
            None => f64::NAN,
        };
        let load = self.busy as f64 * 1e-9 / self.step_s;
        self.busy = 0;
        let single = [
            (dx * dx + dy * dy + dz * dz).sqrt(),
            load,
            latency,
            f64::from(mind.mode.code()),
        ];
        let groups: [[f64; 4]; 4] = [plant.q, error, plant.tau, single];
        for (curve, value) in self.curves.iter_mut().zip(groups.into_iter().flatten()) {
            curve.push(value as f32);
        }

        if self.samples.is_multiple_of(self.stride) {
            if self.poses.len() == MOST_POSES {
                let mut keep = false;
                self.poses.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.stride *= 2;
            }
            let mut pose = [0.0; 8];
            for (to, from) in pose.iter_mut().zip(plant.q.into_iter().chain(set)) {
                *to = from as f32;
            }
            self.poses.push(pose);
        }
        self.samples += 1;
        Ok(())
    }

    fn cell_event(&mut self, event: &CellEvent) {
        if *event == CellEvent::BeginCycle && self.cycles.len() < MOST_NAMED {
            self.cycles.push(self.samples as f64 * self.step_s);
        }
    }
}
