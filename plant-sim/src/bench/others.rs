//! Gates at random, beside what the planner of before made of them.
//!
//! Each is run three times in closed loop. As the robot is: its torques and their rates are the limit, and the corners are free.
//! With a controller that believes in caps on acceleration and jerk as well, as a model file may still say: those of the models up to
//! the commit "Limit moves by torque and the time in which it builds up", constants that had to suit the worst place. And with
//! these caps and the strictly vertical ends that gates had until then.

mod draw;

use std::num::NonZero;

use schemars::JsonSchema;
use serde::Serialize;
use sim::model::RobotModel;
use sim::scenario::{Elbow, Step};
use sim::setup::RunConfig;

use super::limits::{Limits, Peaks};
use super::watch::Watch;
use super::{Controller, Extent, Figures};
use crate::parallel;
use crate::progress::Progress;
use draw::Gate;

/// Seed of the gates.
const SEED: u64 = 10;
/// Caps of before: rad/s2 and m/s2, rad/s3 and m/s3.
const ACCELERATION: [f64; 4] = [60.0, 120.0, 60.0, 600.0];
const JERK: [f64; 4] = [2500.0, 7500.0, 10_000.0, 40_000.0];
/// Vertical ends of before, m.
const CLEARANCE: f64 = 0.005;
/// How far the true tool may be below the chamfer, mm: what it may be off its path.
const BELOW: f64 = 0.03;

/// Gates at random. Times are round trips until the true tool is within 0.01 mm and 0.1 mrad of each end and stays.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "OtherGates")]
pub struct Others {
    /// Seed that they were drawn with.
    pub seed: u64,
    /// Gates.
    pub gates: usize,
    /// How many were not completed; they are in none of the following.
    pub faults: usize,
    /// How many plans pass a limit of torque, torque rate, speed or position, or ask a motor for more than it has.
    pub outside: usize,
    /// How many tools are below the chamfer of the nearer end by more than 0.03 mm.
    pub missed: usize,
    /// Beside the same gates under caps on acceleration and jerk.
    pub capped: Saving,
    /// Beside gates under these caps with 5 mm strictly vertical at both ends.
    pub before: Saving,
    /// Every gate.
    pub rows: Vec<Other>,
}

/// What gates save beside others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Saving {
    /// How many take longer, by more than the sample by which the time of each way is rounded.
    pub slower: usize,
    /// Median of the time saved, of 1; `null` where none was completed.
    pub median: Option<f64>,
    /// Least time saved, of 1; likewise.
    pub least: Option<f64>,
}

/// A gate anywhere, there and back.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "OtherGate")]
pub struct Other {
    /// Number, counted from 1.
    pub number: usize,
    /// One end: x, y, z (m), yaw (rad).
    pub start: [f64; 4],
    /// The other.
    pub end: [f64; 4],
    /// Turns of the wrist there, as in a scenario.
    pub turns: [i8; 2],
    /// Side of the elbow.
    pub elbow: Elbow,
    /// Length of the stroke, m.
    pub stroke_m: f64,
    /// How far the tool turns from start to end, degrees.
    pub turn_deg: f64,
    /// Height of the top, m.
    pub top_m: f64,
    /// Payload, kg.
    pub payload_kg: f64,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Why a run was not completed; `null` where all were.
    pub fault: Option<String>,
    /// Its time.
    pub now: Time,
    /// Its time under caps.
    pub capped: Time,
    /// Its time under caps with vertical ends.
    pub before: Time,
    /// Limits as planned.
    pub peaks: Peaks,
    /// Least height of the true tool above the chamfer of the nearer end, mm.
    pub gate_margin_mm: Option<f64>,
    /// Longest time with a motor at its limit, ms.
    pub saturation_ms: Option<f64>,
}

/// A round trip, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "OtherTime")]
pub struct Time {
    /// As planned; `null` where it was not completed.
    pub planned_s: Option<f64>,
    /// Until the true tool is within 0.01 mm and 0.1 mrad and stays; `null` where it does not.
    pub to_0_01_mm_s: Option<f64>,
}

impl Time {
    fn of(figures: &Figures) -> Self {
        Self {
            planned_s: figures.planned_s,
            to_0_01_mm_s: figures.to_0_01_mm_s,
        }
    }
}

/// Gates for each extent.
pub(super) fn count(extent: Extent) -> usize {
    match extent {
        Extent::Whole => 200,
        Extent::Quick => 6,
    }
}

/// Draws and runs so many gates.
///
/// # Errors
/// A run that could not begin.
pub(super) fn others(
    count: usize,
    controller: &Controller,
    jobs: NonZero<usize>,
    progress: &mut Progress,
) -> Result<Others, String> {
    let robot = RobotModel::irb_930_22_105();
    let gates: Vec<(usize, Gate)> = (1..).zip(draw::gates(&robot, SEED, count)).collect();
    let mut rows = Vec::new();
    for batch in gates.chunks(super::BATCH * jobs.get()) {
        let measured = parallel::map(batch, jobs, |(number, gate)| {
            measure(*number, gate, controller)
        });
        for row in measured {
            rows.push(row?);
        }
        progress.add(batch.len() as u64);
    }
    Ok(Others::of(rows))
}

impl Others {
    pub(super) fn of(rows: Vec<Other>) -> Self {
        let complete: Vec<&Other> = rows.iter().filter(|row| row.fault.is_none()).collect();
        let count = |is: fn(&Other) -> bool| complete.iter().filter(|row| is(row)).count();
        Self {
            seed: SEED,
            gates: rows.len(),
            faults: rows.len() - complete.len(),
            outside: count(Other::is_outside),
            missed: count(Other::has_missed),
            capped: Saving::of(&complete, Other::capped),
            before: Saving::of(&complete, Other::before),
            rows,
        }
    }
}

impl Saving {
    fn of(rows: &[&Other], beside: fn(&Other) -> Time) -> Self {
        let mut saved: Vec<f64> = rows
            .iter()
            .filter_map(|row| row.saved(beside(row)))
            .collect();
        saved.sort_by(f64::total_cmp);
        Self {
            slower: rows.iter().filter(|row| row.is_slower(beside(row))).count(),
            median: median(&saved),
            least: saved.first().copied(),
        }
    }
}

impl Other {
    /// Which gate was not completed, and why.
    pub(super) fn failure(&self) -> Option<String> {
        let fault = self.fault.as_ref()?;
        Some(format!(
            "number {} of those at random: {fault}",
            self.number
        ))
    }

    pub(super) fn capped(&self) -> Time {
        self.capped
    }

    pub(super) fn before(&self) -> Time {
        self.before
    }

    /// Share of the time that is saved beside another; none where a tool does not arrive.
    pub(super) fn saved(&self, beside: Time) -> Option<f64> {
        let both = self.now.to_0_01_mm_s.zip(beside.to_0_01_mm_s);
        both.map(|(now, beside)| 1.0 - now / beside)
    }

    /// Whether it takes longer than another by more than a sample each way, or does not arrive where that does.
    pub(super) fn is_slower(&self, beside: Time) -> bool {
        let Some(beside) = beside.to_0_01_mm_s else {
            return false;
        };
        let rounding = 2.5 / self.rate_hz;
        self.now
            .to_0_01_mm_s
            .is_none_or(|now| now > beside + rounding)
    }

    /// Whether its plan passes a limit, or its motors are asked for more than they have.
    pub(super) fn is_outside(&self) -> bool {
        self.peaks.is_outside() || self.saturation_ms.is_none_or(|time| time > 0.0)
    }

    /// Whether its tool cuts a corner.
    pub(super) fn has_missed(&self) -> bool {
        self.gate_margin_mm.is_none_or(|margin| margin < -BELOW)
    }
}

/// Middle of what is in order.
fn median(sorted: &[f64]) -> Option<f64> {
    let (low, high) = (sorted.len().checked_sub(1)? / 2, sorted.len() / 2);
    Some((sorted[low] + sorted[high]) / 2.0)
}

/// How a gate is run.
#[derive(Clone, Copy, PartialEq)]
enum Manner {
    Now,
    Capped,
    Before,
}

/// What is measured of a run, or why it was not completed.
type Outcome = Result<(Figures, Peaks), String>;

/// Runs a gate in every manner.
fn measure(number: usize, gate: &Gate, controller: &Controller) -> Result<Other, String> {
    let run = |manner| run(number, gate, manner, controller);
    let runs = [
        run(Manner::Now)?,
        run(Manner::Capped)?,
        run(Manner::Before)?,
    ];
    let fault = runs.iter().find_map(|run| run.as_ref().err()).cloned();
    let [(now, peaks), (capped, _), (before, _)] = runs.map(Result::unwrap_or_default);
    let [start, end] = gate.ends;
    Ok(Other {
        number,
        start,
        end,
        turns: gate.turns,
        elbow: gate.elbow,
        stroke_m: gate.stroke(),
        turn_deg: gate.turn.to_degrees(),
        top_m: gate.top,
        payload_kg: gate.payload_kg,
        rate_hz: gate.rate_hz,
        fault,
        now: Time::of(&now),
        capped: Time::of(&capped),
        before: Time::of(&before),
        peaks,
        gate_margin_mm: now.gate_margin_mm,
        saturation_ms: now.saturation_ms,
    })
}

fn run(
    number: usize,
    gate: &Gate,
    manner: Manner,
    controller: &Controller,
) -> Result<Outcome, String> {
    let mut config = RunConfig::new(gate.scenario(number));
    if manner != Manner::Now {
        let limits = &mut config.nominal.limits;
        limits.acceleration = Some(ACCELERATION);
        limits.jerk = Some(JERK);
    }
    if manner == Manner::Before {
        for step in &mut config.scenario.cycle {
            if let Step::Jump(jump) = step {
                jump.clearance = CLEARANCE;
            }
        }
    }
    let course = gate.course();
    let mut observers = (
        Watch::new(course, &config.actual),
        Limits::new(&course, &config.actual),
    );
    let summary = controller.run(&config, &mut observers)?;
    let (watch, limits) = observers;
    Ok(match summary.error {
        Some(error) => Err(error),
        None => Ok((watch.figures(f64::NAN, &summary), limits.peaks())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(rate_hz: f64, now: Option<f64>, before: Option<f64>) -> Other {
        let time = |to_0_01_mm_s| Time {
            planned_s: to_0_01_mm_s,
            to_0_01_mm_s,
        };
        Other {
            number: 1,
            start: [0.0; 4],
            end: [0.0; 4],
            turns: [0; 2],
            elbow: Elbow::Positive,
            stroke_m: 0.3,
            turn_deg: 0.0,
            top_m: 0.0,
            payload_kg: 2.0,
            rate_hz,
            fault: None,
            now: time(now),
            capped: time(before),
            before: time(before),
            peaks: Peaks::default(),
            gate_margin_mm: Some(0.0),
            saturation_ms: Some(0.0),
        }
    }

    /// By hand.
    #[test]
    fn what_is_saved_is_counted_without_what_is_rounded() {
        let mut rows = vec![
            row(1000.0, Some(0.30), Some(0.40)),
            row(1000.0, Some(0.38), Some(0.40)),
            row(1000.0, Some(0.402), Some(0.400)),
            row(2000.0, Some(0.402), Some(0.400)),
            row(1000.0, None, Some(0.400)),
            row(1000.0, Some(9.9), Some(0.1)),
        ];
        rows[0].gate_margin_mm = Some(-0.031);
        rows[1].peaks.torque_rate = 1.01;
        rows[2].saturation_ms = Some(0.5);
        rows[5].fault = Some("over".into());
        let all = Others::of(rows);
        assert_eq!((all.gates, all.faults), (6, 1));
        assert_eq!((all.missed, all.outside), (1, 2));
        assert_eq!(all.before.slower, 2);
        // 25, 5, -0.5 and -0.5 %: the middle of the second and the third.
        assert!((all.before.median.unwrap() - 0.0225).abs() < 1e-12);
        assert!((all.before.least.unwrap() + 0.005).abs() < 1e-12);
        assert_eq!(Others::of(Vec::new()).before.median, None);
    }
}
