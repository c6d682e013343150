//! What a run is judged by, computed from the truth as it streams by.
//!
//! - *Cycle time*: from the start of motion until the tool is back within 1 mm of where the cycle
//!   ends and stays there.
//! - *Settling time*: from the end of the commanded motion until the tool is within 0.01 mm and
//!   stays there, the usual definition for a motion axis.
//! - *Tracking error*: true tool to commanded tool at the same instant, while the reference moves.
//! - *Utilisation*: largest torque or speed over its limit; thermal: root mean square over what
//!   the continuous rating of the motor.

use serde::Serialize;

use crate::maths::square;
use crate::model::RobotModel;
use crate::observer::Truth;
use crate::plant::arm::Arm;

/// Radius within which a cycle counts as ended, m.
const COARSE: f64 = 1e-3;
/// Radius within which the tool counts as settled, m.
const FINE: f64 = 1e-5;

/// Least, mean and greatest of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Least.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Greatest.
    pub max: f64,
}

/// Mean and greatest; `null` where nothing settled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeanMax {
    /// Mean.
    pub mean: f64,
    /// Greatest.
    pub max: f64,
}

/// Root mean square and greatest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RmsMax {
    /// Root mean square.
    pub rms: f64,
    /// Greatest.
    pub max: f64,
}

/// One cycle while it runs.
#[derive(Clone, Debug)]
struct Cycle {
    /// Last sample at which the reference stood before it first moved.
    started: Option<f64>,
    previous: Option<f64>,
    /// First sample at which it stood again.
    commanded_end: f64,
    moving: bool,
    /// First sample from which on the tool stayed within the radius of the target.
    coarse_since: Option<f64>,
    fine_since: Option<f64>,
    /// Distance at the last sample.
    distance: f64,
    target: [f64; 3],
}

/// Result of one cycle, s and m; `None` where the tool did not come that close.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CycleResult {
    /// Start of motion, s of simulated time.
    pub start_s: f64,
    /// Cycle time.
    pub cycle_time_s: Option<f64>,
    /// Settling time.
    pub settle_time_s: Option<f64>,
    /// Length of the commanded motion.
    pub commanded_s: f64,
    /// Distance from the target at the end of the dwell, mm.
    pub final_error_mm: f64,
}

/// Everything that is computed from the truth.
pub struct Metrics {
    arm: Arm,
    limits: Limits,
    cycle: Option<Cycle>,
    /// Results of the cycles so far.
    pub cycles: Vec<CycleResult>,
    squares: f64,
    worst: f64,
    tracked: u64,
    peak_torque: [f64; 4],
    peak_speed: [f64; 4],
    torque_squares: [f64; 4],
    samples: u64,
    saturated_now: u64,
    /// Longest run of samples with a motor at its limit.
    pub longest_saturation: u64,
}

struct Limits {
    effort: [f64; 4],
    continuous: [f64; 4],
    velocity: [f64; 4],
}

impl Metrics {
    /// Metrics of a run with the robot `model`.
    pub fn new(model: &RobotModel) -> Self {
        Self {
            arm: Arm::new(model, None),
            limits: Limits {
                effort: model.limits.effort,
                continuous: model.limits.effort_continuous,
                velocity: model.limits.velocity,
            },
            cycle: None,
            cycles: Vec::new(),
            squares: 0.0,
            worst: 0.0,
            tracked: 0,
            peak_torque: [0.0; 4],
            peak_speed: [0.0; 4],
            torque_squares: [0.0; 4],
            samples: 0,
            saturated_now: 0,
            longest_saturation: 0,
        }
    }

    /// A cycle that ends at `target` (x, y, z) begins with the next sample.
    pub fn begin_cycle(&mut self, target: [f64; 3]) {
        self.cycle = Some(Cycle {
            started: None,
            previous: None,
            commanded_end: 0.0,
            moving: false,
            coarse_since: None,
            fine_since: None,
            distance: 0.0,
            target,
        });
    }

    /// The cycle has ended, dwell included.
    pub fn end_cycle(&mut self) {
        let Some(cycle) = self.cycle.take() else {
            return;
        };
        let Some(started) = cycle.started else { return };
        self.cycles.push(CycleResult {
            start_s: started,
            cycle_time_s: cycle.coarse_since.map(|t| t.max(started) - started),
            settle_time_s: cycle.fine_since.map(|t| (t - cycle.commanded_end).max(0.0)),
            commanded_s: cycle.commanded_end - started,
            final_error_mm: cycle.distance * 1e3,
        });
    }

    /// One sample.
    pub fn sample(&mut self, truth: &Truth) {
        let Some(cycle) = &mut self.cycle else { return };
        let commanded = self.arm.pose(&self.arm.at(&truth.mind.q.into()));
        let error = distance(&truth.plant.tool, &[commanded.x, commanded.y, commanded.z]);
        let moving = truth.mind.qd.iter().any(|qd| *qd != 0.0);
        if moving {
            if cycle.started.is_none() {
                cycle.started = Some(cycle.previous.unwrap_or(truth.plant.t));
            }
            self.squares += error * error;
            self.worst = self.worst.max(error);
            self.tracked += 1;
        } else if cycle.moving {
            cycle.commanded_end = truth.plant.t;
        }
        cycle.moving = moving;
        cycle.previous = Some(truth.plant.t);

        self.samples += 1;
        for axis in 0..4 {
            let torque = truth.plant.tau[axis].abs();
            self.peak_torque[axis] = self.peak_torque[axis].max(torque);
            self.torque_squares[axis] += torque * torque;
            self.peak_speed[axis] = self.peak_speed[axis].max(truth.plant.qd[axis].abs());
        }
        self.saturated_now = if truth.plant.saturated {
            self.saturated_now + 1
        } else {
            0
        };
        self.longest_saturation = self.longest_saturation.max(self.saturated_now);
        cycle.near(truth);
    }

    /// Distance of true and commanded tool while moving, mm.
    pub fn tracking_error_mm(&self) -> RmsMax {
        RmsMax {
            rms: (self.squares / self.tracked.max(1) as f64).sqrt() * 1e3,
            max: self.worst * 1e3,
        }
    }

    /// Peak effort over its limit, by joint.
    pub fn torque_utilisation(&self) -> [f64; 4] {
        std::array::from_fn(|axis| self.peak_torque[axis] / self.limits.effort[axis])
    }

    /// Root-mean-square effort over the continuous limit, by joint.
    pub fn thermal_utilisation(&self) -> [f64; 4] {
        let samples = self.samples.max(1) as f64;
        std::array::from_fn(|axis| {
            (self.torque_squares[axis] / samples).sqrt() / self.limits.continuous[axis]
        })
    }

    /// Peak speed over its limit, by joint.
    pub fn speed_utilisation(&self) -> [f64; 4] {
        std::array::from_fn(|axis| self.peak_speed[axis] / self.limits.velocity[axis])
    }

    /// Least, mean and greatest cycle time; `None` without a completed cycle.
    pub fn cycle_time_s(&self) -> Option<Spread> {
        let times: Option<Vec<f64>> = self.cycles.iter().map(|c| c.cycle_time_s).collect();
        spread(&times?)
    }

    /// Settling time; `None` if any cycle did not settle.
    pub fn settle_time_s(&self) -> Option<MeanMax> {
        let times: Option<Vec<f64>> = self.cycles.iter().map(|c| c.settle_time_s).collect();
        let Spread { mean, max, .. } = spread(&times?)?;
        Some(MeanMax { mean, max })
    }

    /// Largest distance from the target at the end of a dwell, mm.
    pub fn final_error_mm(&self) -> Option<f64> {
        self.cycles
            .iter()
            .map(|cycle| cycle.final_error_mm)
            .reduce(f64::max)
    }
}

impl Cycle {
    /// Keeps the first instant from which on the tool stayed near the target.
    fn near(&mut self, truth: &Truth) {
        self.distance = distance(&truth.plant.tool, &self.target);
        for (radius, since) in [
            (COARSE, &mut self.coarse_since),
            (FINE, &mut self.fine_since),
        ] {
            if self.distance > radius {
                *since = None;
            } else if since.is_none() {
                *since = Some(truth.plant.t);
            }
        }
    }
}

fn distance(tool: &[f64; 4], to: &[f64; 3]) -> f64 {
    let [x, y, z, _] = tool;
    (square(x - to[0]) + square(y - to[1]) + square(z - to[2])).sqrt()
}

fn spread(values: &[f64]) -> Option<Spread> {
    let min = values.iter().copied().reduce(f64::min)?;
    let max = values.iter().copied().reduce(f64::max)?;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Some(Spread { min, mean, max })
}
