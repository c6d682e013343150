//! Metrics of a run, computed from the truth as it streams by.
//!
//! - *Cycle time*: from the start of motion until the tool is within 1 mm and 10 mrad of the cycle's end and stays
//!   there. A move too small to leave that radius ends with its reference.
//! - *Settling time*: from the end of the commanded motion until the tool is within 0.01 mm and 0.1 mrad and stays there,
//!   the usual definition for a motion axis. An angle counts as the distance that it moves a point 100 mm from the
//!   tool's axis.
//! - *Tracking error*: true tool to commanded tool at the same instant, while the reference moves; position and yaw. Of a
//!   sample that the controller has not answered by the next one there is no reference, and no error.
//! - *Utilisation*: largest torque or speed over its limit; thermal: root mean square over what
//!   the continuous rating of the motor.
//! - *Saturation*: longest time with a motor at its limit, by axis, according to the plant.
//!
//! The target is the requested one in double precision; the controller gets it rounded.

mod cycle;
mod heat;
mod offset;

use schemars::JsonSchema;
use serde::Serialize;

use cycle::Cycle;
pub use cycle::CycleResult;
pub use heat::Heat;
pub(crate) use heat::time_constant;
pub use offset::Offset;

use crate::model::RobotModel;
use crate::observer::Truth;
use crate::plant::arm::Arm;

/// Least, mean and greatest of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Spread {
    /// Least.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Greatest.
    pub max: f64,
}

/// Mean and greatest; `null` where nothing settled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MeanMax {
    /// Mean.
    pub mean: f64,
    /// Greatest.
    pub max: f64,
}

/// Root mean square and greatest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct RmsMax {
    /// Root mean square.
    pub rms: f64,
    /// Greatest.
    pub max: f64,
}

/// All metrics computed from the truth.
pub struct Metrics {
    arm: Arm,
    limits: Limits,
    cycle: Option<Cycle>,
    /// Results of the cycles so far.
    pub cycles: Vec<CycleResult>,
    tracking_mm: Tracking,
    tracking_mrad: Tracking,
    peak_torque: [f64; 4],
    peak_speed: [f64; 4],
    torque_squares: [f64; 4],
    samples: u64,
    /// Samples for which each motor has been at its limit without a break.
    pub(crate) saturated_now: [u64; 4],
    /// Longest run of samples with the motor at its limit, by axis.
    pub longest_saturation: [u64; 4],
}

/// Errors of the tool while it follows.
#[derive(Default)]
struct Tracking {
    squares: f64,
    worst: f64,
    samples: u64,
}

impl Tracking {
    fn add(&mut self, error: f64) {
        self.squares += error * error;
        self.worst = self.worst.max(error);
        self.samples += 1;
    }

    fn spread(&self) -> RmsMax {
        RmsMax {
            rms: (self.squares / self.samples.max(1) as f64).sqrt(),
            max: self.worst,
        }
    }
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
            tracking_mm: Tracking::default(),
            tracking_mrad: Tracking::default(),
            peak_torque: [0.0; 4],
            peak_speed: [0.0; 4],
            torque_squares: [0.0; 4],
            samples: 0,
            saturated_now: [0; 4],
            longest_saturation: [0; 4],
        }
    }

    /// Begins a cycle with target `target` (x, y, z, yaw) at the next sample.
    pub fn begin_cycle(&mut self, target: Option<[f64; 4]>) {
        self.cycle = Some(Cycle::new(target));
    }

    /// Ends the cycle, dwell included.
    pub fn end_cycle(&mut self) {
        let result = self.cycle.take().and_then(|cycle| cycle.result());
        self.cycles.extend(result);
    }

    /// One sample.
    pub fn sample(&mut self, truth: &Truth) {
        let _ = self.tracked(truth);
    }

    /// One sample; returns the offset of the tool from its reference, where there is one that moves.
    pub(crate) fn tracked(&mut self, truth: &Truth) -> Option<Offset> {
        let cycle = self.cycle.as_mut()?;
        let mut tracking = None;
        if cycle.sample(truth) && truth.is_answered() {
            let commanded = self.arm.pose(&self.arm.at(&truth.mind.q.into()));
            let commanded = [commanded.x, commanded.y, commanded.z, commanded.yaw];
            let error = Offset::between(&truth.plant.tool, &commanded);
            self.tracking_mm.add(error.position * 1e3);
            self.tracking_mrad.add(error.yaw * 1e3);
            tracking = Some(error);
        }
        self.samples += 1;
        for axis in 0..4 {
            let torque = truth.plant.tau[axis].abs();
            self.peak_torque[axis] = self.peak_torque[axis].max(torque);
            self.torque_squares[axis] += torque * torque;
            self.peak_speed[axis] = self.peak_speed[axis].max(truth.plant.qd[axis].abs());
            let saturated = &mut self.saturated_now[axis];
            *saturated = if truth.plant.at_limit[axis] {
                *saturated + 1
            } else {
                0
            };
            self.longest_saturation[axis] = self.longest_saturation[axis].max(*saturated);
        }
        tracking
    }

    /// Distance of true and commanded tool while moving, mm.
    pub fn tracking_error_mm(&self) -> RmsMax {
        self.tracking_mm.spread()
    }

    /// Yaw error between true and commanded tool while moving, mrad.
    pub fn tracking_error_mrad(&self) -> RmsMax {
        self.tracking_mrad.spread()
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

    /// Cycles in which nothing moved.
    pub fn still(&self) -> usize {
        self.cycles.iter().filter(|cycle| !cycle.moved).count()
    }

    /// Least, mean and greatest cycle time; `None` where nothing moved, or where any cycle that moved did not arrive.
    pub fn cycle_time_s(&self) -> Option<Spread> {
        spread(self.moved().map(|cycle| cycle.cycle_time_s))
    }

    /// Settling time; `None` where nothing moved, or where any cycle that moved did not settle.
    pub fn settle_time_s(&self) -> Option<MeanMax> {
        let Spread { mean, max, .. } = spread(self.moved().map(|cycle| cycle.settle_time_s))?;
        Some(MeanMax { mean, max })
    }

    fn moved(&self) -> impl Iterator<Item = &CycleResult> {
        self.cycles.iter().filter(|cycle| cycle.moved)
    }

    /// Largest distance from the target at the end of a dwell, mm.
    pub fn final_error_mm(&self) -> Option<f64> {
        greatest(self.cycles.iter().map(|cycle| cycle.final_error_mm))
    }

    /// Largest yaw error from the target at the end of a dwell, mrad.
    pub fn final_error_mrad(&self) -> Option<f64> {
        greatest(self.cycles.iter().map(|cycle| cycle.final_error_mrad))
    }
}

/// The greatest of the values present.
fn greatest(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    values.flatten().reduce(f64::max)
}

/// `None` if any is missing, or there are none.
fn spread(values: impl Iterator<Item = Option<f64>>) -> Option<Spread> {
    let values: Vec<f64> = values.collect::<Option<_>>()?;
    let min = values.iter().copied().reduce(f64::min)?;
    let max = values.iter().copied().reduce(f64::max)?;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Some(Spread { min, mean, max })
}
