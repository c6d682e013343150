//! Repeatability of a pose after ISO 9283, 7.2.2: how far the attained positions are from their barycentre.
//!
//! The pose is an end of the middle gate, always attained from the other one; each reading of an encoder is off by up to a step.

use std::f64::consts::TAU;
use std::io;
use std::num::NonZero;

use schemars::JsonSchema;
use serde::Serialize;
use sim::model::{AXES, RobotModel};
use sim::observer::{Observer, Truth};
use sim::scenario::Mismatch;
use sim::setup::RunConfig;

use super::gate::{Case, gates};
use super::{Controller, Extent};
use crate::parallel;
use crate::progress::Progress;

/// Times that the pose is attained.
const CYCLES: u32 = 100;
/// Place and payloads, kg.
const PLACE: &str = "mid-tan";
const PAYLOADS: [f64; 2] = [2.0, 22.0];
/// Control rates, Hz.
const RATES: [f64; 2] = [1000.0, 2000.0];

/// How well a pose is attained again and again.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Repeatability {
    /// Payload, kg.
    pub payload_kg: f64,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Times that the pose was attained.
    pub cycles: usize,
    /// Greatest error of a reading of each encoder: a step of it, at the joint, rad and m.
    pub noise: [f64; 4],
    /// Mean distance of the attained positions from their barycentre, mm; `null` where the run was not completed.
    pub mean_mm: Option<f64>,
    /// Standard deviation of these distances, mm.
    pub deviation_mm: Option<f64>,
    /// Repeatability RP_l of ISO 9283: the mean and three standard deviations, mm.
    pub repeatability_mm: Option<f64>,
    /// Distance of the barycentre from the pose, AP_p of ISO 9283, mm.
    pub accuracy_mm: Option<f64>,
    /// Why the run was not completed; `null` where it was.
    pub fault: Option<String>,
}

impl Repeatability {
    /// Which pose was not attained, and why.
    pub(super) fn failure(&self) -> Option<String> {
        let (kg, rate, fault) = (self.payload_kg, self.rate_hz, self.fault.as_ref()?);
        Some(format!(
            "the pose with {kg} kg at {rate} Hz and noise: {fault}"
        ))
    }
}

/// Payloads and rates for each extent.
pub(super) fn cases(extent: Extent) -> Vec<(f64, f64)> {
    let all = RATES
        .into_iter()
        .flat_map(|rate| PAYLOADS.map(|payload| (payload, rate)));
    match extent {
        Extent::Whole => all.collect(),
        Extent::Quick => all.take(1).collect(),
    }
}

/// Attains the pose in each case.
///
/// # Errors
/// A run that could not begin.
pub(super) fn measure(
    cases: &[(f64, f64)],
    controller: &Controller,
    jobs: NonZero<usize>,
    progress: &mut Progress,
) -> Result<Vec<Repeatability>, String> {
    let rows = parallel::map(cases, jobs, |&(payload_kg, rate_hz)| {
        run(payload_kg, rate_hz, controller)
    });
    progress.add(cases.len() as u64);
    rows.into_iter().collect()
}

/// A step of each encoder at its joint, rad and m.
fn steps(robot: &RobotModel) -> [f64; 4] {
    let step = TAU / f64::from(robot.drive.encoder_counts);
    let [shoulder, elbow, lift, wrist] = robot.drive.gear_ratio.map(|ratio| step / ratio);
    [shoulder, elbow, lift * robot.drive.screw_lead / TAU, wrist]
}

fn run(payload_kg: f64, rate_hz: f64, controller: &Controller) -> Result<Repeatability, String> {
    let is_meant = |gate: &&super::gate::Gate| gate.place == PLACE && gate.payload_kg == payload_kg;
    let gate = gates().iter().find(is_meant);
    let gate = gate
        .ok_or("a gate that is measured is in the table")?
        .clone();
    let case = Case {
        gate,
        rate_hz,
        mismatch: Mismatch::default(),
    };
    let mut config = RunConfig::new(case.scenario());
    config.scenario.cycles = CYCLES;
    let noise = steps(&config.actual);
    for (axis, step) in AXES.into_iter().zip(noise) {
        let fault = format!("encoder:{axis}:noise={step}@0s");
        config
            .scenario
            .faults
            .push(fault.parse().map_err(|error| format!("{error}"))?);
    }
    let [_, pose] = case.course().ends;
    let mut attained = Attained::default();
    let summary = controller.run(&config, &mut attained)?;
    // One rest in two is at the other end.
    let positions = attained.rests.iter().filter(|at| distance(at, &pose) < 0.1);
    let positions: Vec<[f64; 3]> = positions.copied().collect();
    let spread = match summary.error {
        None => Spread::of(&positions),
        Some(_) => None,
    };
    let mm = |length: fn(&Spread) -> f64| spread.as_ref().map(|spread| length(spread) * 1e3);
    Ok(Repeatability {
        payload_kg,
        rate_hz,
        cycles: positions.len(),
        noise,
        mean_mm: mm(|spread| spread.mean),
        deviation_mm: mm(|spread| spread.deviation),
        repeatability_mm: mm(|spread| spread.mean + 3.0 * spread.deviation),
        accuracy_mm: spread
            .as_ref()
            .map(|spread| distance(&spread.barycentre, &pose) * 1e3),
        fault: summary.error,
    })
}

/// Positions and their distances from their barycentre, m.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spread {
    barycentre: [f64; 3],
    mean: f64,
    deviation: f64,
}

impl Spread {
    /// Of two positions at least.
    fn of(positions: &[[f64; 3]]) -> Option<Self> {
        let count = positions.len() as f64;
        if count < 2.0 {
            return None;
        }
        let mean =
            |values: &dyn Fn(&[f64; 3]) -> f64| positions.iter().map(values).sum::<f64>() / count;
        let barycentre = std::array::from_fn(|axis| mean(&|at| at[axis]));
        let from = |at: &[f64; 3]| distance(at, &barycentre);
        let mean = mean(&from);
        let squares = positions
            .iter()
            .map(|at| (from(at) - mean) * (from(at) - mean));
        Some(Self {
            barycentre,
            mean,
            deviation: (squares.sum::<f64>() / (count - 1.0)).sqrt(),
        })
    }
}

/// Distance of two positions; what follows x, y and z is left out.
fn distance(a: &[f64; 3], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// Where the true tool is at the end of each rest.
#[derive(Default)]
struct Attained {
    rests: Vec<[f64; 3]>,
    /// The last sample at rest.
    rest: Option<[f64; 3]>,
}

impl Observer for Attained {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let moves = truth.mind.qd.iter().any(|qd| *qd != 0.0);
        if moves {
            self.rests.extend(self.rest.take());
        } else {
            let [x, y, z, _] = truth.plant.tool;
            self.rest = Some([x, y, z]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: distances 1, 1, 3 and 3 from the barycentre.
    #[test]
    fn the_spread_is_that_of_the_distances() {
        let positions = [
            [1.0, 0.0, 5.0],
            [-1.0, 0.0, 5.0],
            [0.0, -3.0, 5.0],
            [0.0, 3.0, 5.0],
        ];
        let spread = Spread::of(&positions).unwrap();
        assert_eq!(spread.barycentre, [0.0, 0.0, 5.0]);
        assert!((spread.mean - 2.0).abs() < 1e-12);
        assert!((spread.deviation - (4.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(Spread::of(&positions[..1]), None);
    }

    /// 17 bits behind a gear of 100 are 13 million steps a turn.
    #[test]
    fn a_step_is_that_of_the_joint() {
        let mut robot = RobotModel::irb_930_22_105();
        robot.drive.encoder_counts = 131_072;
        robot.drive.gear_ratio = [100.0, 50.0, 2.0, 1.0];
        robot.drive.screw_lead = 0.032;
        let [shoulder, elbow, lift, wrist] = steps(&robot);
        assert!((shoulder - TAU / 13_107_200.0).abs() < 1e-18);
        assert!((elbow - 2.0 * shoulder).abs() < 1e-18);
        assert!((lift - 0.016 / 131_072.0).abs() < 1e-18);
        assert!((wrist - TAU / 131_072.0).abs() < 1e-18);
    }
}
