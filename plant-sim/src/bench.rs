//! Gates in closed loop beside the optimum.
//!
//! Seven places of the workspace, four payloads, two control rates: a gate of 25, 300, 25 mm with free corners, there and
//! back, with the controller, its delays and the bit-timed bus, encoder steps and friction. The optimum of each is from another
//! program (see `gates/optima.csv`): torques and speeds up to the limits of the model, without any time to build them up, with no
//! tracking and no settling. No robot can be faster; how much slower this one is, and how exact and how warm, is measured here.
//!
//! ```text
//! gate      the gates, and the scenario of each
//! watch     the observer that measures a run
//! load      torques over a cycle: what is left of it at a lower speed or with a pause
//! group     means and worst of many rows
//! others    gates at random, beside what the planner of before made of them
//! limits    the observer that holds plans to the limits of the robot
//! repeatability  a pose that is attained again and again
//! text      tables for people, CSV
//! picture   the same as SVG
//! ```

pub mod gate;
mod group;
mod limits;
mod load;
mod others;
mod picture;
mod repeatability;
mod text;
mod watch;

use std::num::NonZero;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;
use sim::model::RobotModel;
use sim::observer::Observer;
use sim::run::{in_process, with_controller};
use sim::setup::RunConfig;
use sim::summary::Summary;

use crate::parallel;
use crate::progress::Progress;
use crate::qemu::{self, Qemu};
use gate::Case;
pub use group::Group;
pub use limits::Peaks;
pub use others::{Other, Others, Saving, Time};
pub use picture::picture;
pub use repeatability::Repeatability;
pub use text::{csv, other_csv, repeatability_csv, text};
use watch::Watch;

/// Rows for each thread between two signs of progress.
const BATCH: usize = 4;

/// What the benchmark has come to. Times in s unless a key says otherwise, shares of 1.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "MotionBench")]
pub struct Report {
    /// Robot.
    pub robot: String,
    /// Control law.
    pub law: String,
    /// Every gate, with a robot that is as the controller believes.
    pub rows: Vec<Row>,
    /// The same by payload and rate, over the places.
    pub groups: Vec<Group>,
    /// Every gate with another friction and payload than the controller believes.
    pub mismatched: Vec<Row>,
    /// The same by payload, rate and mismatch, over the places.
    pub mismatched_groups: Vec<Group>,
    /// Gates at random, beside what the planner of before made of them.
    pub others: Others,
    /// How well a pose is attained again and again, with noise of the encoders.
    pub repeatability: Vec<Repeatability>,
}

/// One gate, there and back.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Row {
    /// Name of the place.
    pub place: String,
    /// From axis 1 to the middle of the stroke, m.
    pub radius_m: f64,
    /// Angle between the stroke and the radius, degrees.
    pub stroke_deg: f64,
    /// Payload as announced to the controller, kg.
    pub payload_kg: f64,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// True friction over the one that the controller believes in.
    pub friction_factor: f64,
    /// True payload over the announced one.
    pub payload_factor: f64,
    /// Round trip at the optimum, s.
    pub optimum_s: f64,
    /// Why the run was not completed; `null` where it was.
    pub fault: Option<String>,
    /// What was measured.
    #[serde(flatten)]
    pub figures: Figures,
}

/// What is measured of a gate; all of it is `null` where the run was not completed. Round trips are sums of both ways, without
/// what the arm rests between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Figures {
    /// Round trip as planned: the time for which the reference moves, s.
    pub planned_s: Option<f64>,
    /// Round trip until the true tool is within 1 mm and 10 mrad of each end and stays, s; `null` where it does not.
    pub to_1_mm_s: Option<f64>,
    /// The same for 0.1 mm and 1 mrad, s.
    pub to_0_1_mm_s: Option<f64>,
    /// The same for 0.01 mm and 0.1 mrad, s.
    pub to_0_01_mm_s: Option<f64>,
    /// `planned_s` over the optimum.
    pub planned_ratio: Option<f64>,
    /// `to_1_mm_s` over the optimum.
    pub to_1_mm_ratio: Option<f64>,
    /// `to_0_1_mm_s` over the optimum.
    pub to_0_1_mm_ratio: Option<f64>,
    /// `to_0_01_mm_s` over the optimum.
    pub to_0_01_mm_ratio: Option<f64>,
    /// Greatest distance of the true tool from the commanded one while the reference moves, mm.
    pub tracking_max_mm: Option<f64>,
    /// Root mean square of that distance, mm.
    pub tracking_rms_mm: Option<f64>,
    /// Longest time from the end of the reference until within 0.01 mm and 0.1 mrad, ms; `null` where it never is.
    pub settling_ms: Option<f64>,
    /// Farthest that the tool goes past an end, along the stroke or downwards, mm.
    pub overshoot_mm: Option<f64>,
    /// Least height of the true tool above the chamfer, mm: below 0 it cuts the corner. At the ends the chamfer is where the tool
    /// is to be, so that this is 0 for a tool without error.
    pub gate_margin_mm: Option<f64>,
    /// Greatest effort over its limit, of any axis.
    pub torque_share: Option<f64>,
    /// Greatest change of an effort from sample to sample over the one that `effort_rise_time_s` of the model allows, of any axis;
    /// dry friction aside, which is there at once.
    pub torque_rate_share: Option<f64>,
    /// Greatest speed over its limit, of any axis.
    pub speed_share: Option<f64>,
    /// Root mean square of the effort over its continuous rating, of the worst axis, in cycles that follow each other without a
    /// pause.
    pub rms_share: Option<f64>,
    /// Share of full speed at which such cycles can go on for ever, with every axis at its continuous rating at the most; `null`
    /// where not even holding the payload can.
    pub continuous_speed: Option<f64>,
    /// Round trip at that speed, s.
    pub continuous_cycle_s: Option<f64>,
    /// Pause for each round trip at full speed that keeps every axis at its continuous rating, s; `null` as above.
    pub pause_s: Option<f64>,
    /// Longest time with a motor at its limit, ms.
    pub saturation_ms: Option<f64>,
}

/// How much of the benchmark is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Every place, payload and rate.
    Whole,
    /// One place, the payloads 2 and 22 kg, at 1 kHz.
    Quick,
}

/// Where the controller is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Controller {
    /// In this process.
    InProcess,
    /// This image on the emulated board; every frame is compared with that of a controller in this process.
    Qemu(PathBuf),
}

impl Controller {
    /// Runs a scenario.
    fn run(&self, config: &RunConfig, observer: &mut impl Observer) -> Result<Summary, String> {
        let summary = match self {
            Self::InProcess => in_process(config, observer),
            Self::Qemu(image) => {
                let options = qemu::Options {
                    image: Some(image.clone()),
                    ..qemu::Options::default()
                };
                let connect = |config| Qemu::start(config, &options);
                with_controller(config, connect, &mut (), observer)
            }
        };
        summary.map_err(|error| named(config, &error))
    }
}

fn named(config: &RunConfig, error: &dyn std::fmt::Display) -> String {
    format!("{}: {error}", config.scenario.name)
}

/// Runs the benchmark on `jobs` threads; the result does not depend on their number.
///
/// # Errors
/// A run that could not begin.
pub fn motion(
    extent: Extent,
    controller: &Controller,
    jobs: NonZero<usize>,
) -> Result<Report, String> {
    let cases = gate::cases(extent);
    let others = others::count(extent);
    let poses = repeatability::cases(extent);
    let mut progress = Progress::of_rows((cases.len() + others + poses.len()) as u64);
    let mut rows = Vec::new();
    for batch in cases.chunks(BATCH * jobs.get()) {
        for row in parallel::map(batch, jobs, |case| measure(case, controller)) {
            rows.push(row?);
        }
        progress.add(batch.len() as u64);
    }
    let (rows, mismatched): (Vec<Row>, Vec<Row>) = rows
        .into_iter()
        .partition(|row| row.friction_factor == 1.0 && row.payload_factor == 1.0);
    Ok(Report {
        robot: RobotModel::irb_930_22_105().name,
        law: gate::law().to_string(),
        groups: group::groups(&rows),
        mismatched_groups: group::groups(&mismatched),
        others: others::others(others, controller, jobs, &mut progress)?,
        repeatability: repeatability::measure(&poses, controller, jobs, &mut progress)?,
        rows,
        mismatched,
    })
}

impl Report {
    /// Why the benchmark has failed, if it has: gates that should have been completed and were not.
    pub fn failure(&self) -> Option<String> {
        let gates = self.rows.iter().chain(&self.mismatched);
        let gates = gates.filter(|row| row.has_failed()).map(Row::ending);
        let others = self.others.rows.iter().filter_map(Other::failure);
        let poses = self.repeatability.iter().filter_map(Repeatability::failure);
        let faults: Vec<String> = gates.chain(others).chain(poses).collect();
        let first = faults.first()?;
        let all = [
            self.rows.len(),
            self.mismatched.len(),
            self.others.gates,
            self.repeatability.len(),
        ];
        Some(format!(
            "{} of {} gates were not completed that should have been; the first is {first}",
            faults.len(),
            all.iter().sum::<usize>(),
        ))
    }
}

impl Row {
    /// Whether it has ended in a fault that it should not have ended in. Plans keep 5 % of the torque for what the controller does
    /// not know: enough for another friction and a lighter payload, not for one that is a fifth heavier.
    fn has_failed(&self) -> bool {
        self.fault.is_some() && self.payload_factor <= 1.0
    }

    /// Which gate it is, and how it has ended.
    fn ending(&self) -> String {
        format!(
            "{} with {} kg at {} Hz, friction x {}, payload x {}: {}",
            self.place,
            self.payload_kg,
            self.rate_hz,
            self.friction_factor,
            self.payload_factor,
            self.fault.as_deref().unwrap_or("completed")
        )
    }
}

/// Runs one case.
fn measure(case: &Case, controller: &Controller) -> Result<Row, String> {
    let config = RunConfig::new(case.scenario());
    let rig = config.rig().map_err(|error| named(&config, &error))?;
    let mut watch = Watch::new(case.course(), &rig.actual);
    let summary = controller.run(&config, &mut watch)?;
    let figures = match summary.error {
        None => watch.figures(case.gate.optimum_s, &summary),
        Some(_) => Figures::default(),
    };
    Ok(Row {
        place: case.gate.place.clone(),
        radius_m: case.gate.radius_m,
        stroke_deg: case.gate.stroke_deg,
        payload_kg: case.gate.payload_kg,
        rate_hz: case.rate_hz,
        friction_factor: case.mismatch.friction,
        payload_factor: case.mismatch.payload,
        optimum_s: case.gate.optimum_s,
        fault: summary.error,
        figures,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_fails_unless_the_payload_is_heavier_than_announced() {
        let row = |payload_factor, fault: Option<&str>| Row {
            place: "best".into(),
            radius_m: 0.6,
            stroke_deg: 135.0,
            payload_kg: 2.0,
            rate_hz: 1000.0,
            friction_factor: 1.0,
            payload_factor,
            optimum_s: 0.254,
            fault: fault.map(str::to_owned),
            figures: Figures::default(),
        };
        let report = |fault| Report {
            robot: String::new(),
            law: String::new(),
            rows: vec![row(1.0, fault)],
            groups: Vec::new(),
            mismatched: vec![row(1.2, Some("too heavy"))],
            mismatched_groups: Vec::new(),
            others: Others::of(Vec::new()),
            repeatability: Vec::new(),
        };
        assert_eq!(report(None).failure(), None);
        let why = report(Some("it broke")).failure().unwrap();
        assert!(
            why.starts_with("1 of 2 gates ") && why.ends_with(": it broke"),
            "{why}"
        );
    }
}
