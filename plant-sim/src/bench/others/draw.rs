//! Gates at random: anywhere the arm reaches, with either elbow.

use std::f64::consts::{PI, TAU};

use oorandom::Rand64;
use sim::model::RobotModel;
use sim::plant::kinematics::{Pose, Solution, inverse};
use sim::scenario::{Elbow, Ending, Jump, Mismatch, OperationName, PayloadSpec, Scenario, Step};
use sim::text::Source;

use super::super::gate::{DWELL, law};
use super::super::watch::Course;

/// From axis 1 to the middle of the stroke, m.
const RADIUS: [f64; 2] = [0.25, 1.02];
/// Length of the stroke, m.
const STROKE: [f64; 2] = [0.05, 0.6];
/// Greatest turn of the tool between the ends, either way.
const TURN: f64 = 350.0 / 360.0 * TAU;
/// How far the gate goes up from its higher end, m.
const RISE: [f64; 2] = [0.01, 0.05];
/// Greatest difference of the heights of both ends, m.
const STEP: f64 = 0.1;
/// Whole turns of the wrist in which a gate may begin.
const TURNS: [i8; 3] = [-1, 0, 1];
/// Payloads, kg.
const PAYLOADS: [f64; 4] = [0.0, 2.0, 12.0, 22.0];
/// Control rates, Hz.
const RATES: [f64; 2] = [1000.0, 2000.0];
/// Round trips of a run.
const CYCLES: u32 = 1;

/// A gate anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gate {
    /// Both ends: x, y, z (m), yaw (rad).
    pub(super) ends: [[f64; 4]; 2],
    /// Turns of the wrist there.
    pub(super) turns: [i8; 2],
    pub(super) elbow: Elbow,
    /// How far the tool turns from the first end to the second, rad.
    pub(super) turn: f64,
    /// Height of the top, m.
    pub(super) top: f64,
    pub(super) payload_kg: f64,
    pub(super) rate_hz: f64,
}

/// The first `count` gates of this seed that the robot can be asked for.
pub(super) fn gates(robot: &RobotModel, seed: u64, count: usize) -> Vec<Gate> {
    let mut random = Rand64::new(seed.into());
    std::iter::repeat_with(|| gate(robot, &mut random))
        .flatten()
        .take(count)
        .collect()
}

/// A gate, unless it leads out of the workspace.
fn gate(robot: &RobotModel, random: &mut Rand64) -> Option<Gate> {
    let mut between = |[low, high]: [f64; 2]| low + (high - low) * random.rand_float();
    let (radius, stroke) = (between(RADIUS), between(STROKE));
    let (place, direction) = (between([-PI, PI]), between([-PI, PI]));
    let (turn, yaw) = (between([-TURN, TURN]), between([-PI, PI]));
    let geometry = &robot.geometry;
    // The flange goes down as the lift goes up its axis.
    let height = geometry.d1 + geometry.d2 - geometry.d4;
    let [low, high] = [robot.limits.upper[2], robot.limits.lower[2]].map(|lift| height - lift);
    let z = between([low, high]);
    let other = z + between([-STEP, STEP]);
    let top = z.max(other) + between(RISE);
    let (sin, cos) = libm::sincos(place);
    let (across, along) = libm::sincos(direction);
    let end = |side: f64, z, yaw| {
        let half = side * stroke / 2.0;
        [
            radius * cos + half * along,
            radius * sin + half * across,
            z,
            yaw,
        ]
    };
    let ends = [end(-1.0, z, yaw), end(1.0, other, yaw + turn)];
    let mut one_of = |count: usize| random.rand_range(0..count as u64) as usize;
    let (side, first) = (one_of(2), TURNS[one_of(TURNS.len())]);
    let payload_kg = PAYLOADS[one_of(PAYLOADS.len())];
    let rate_hz = RATES[one_of(RATES.len())];
    if top > high || other < low {
        return None;
    }
    let solutions = ends.map(|[x, y, z, yaw]| {
        let pose = Pose { x, y, z, yaw };
        let both = inverse(geometry, &robot.limits, &pose).ok()?;
        Some(both[side])
    });
    let [Some(start), Some(end)] = solutions else {
        return None;
    };
    // The wrist turns with the arms, less the tool.
    let bend = |solution: &Solution| solution.q[0] + solution.q[1];
    let wrist = start.q[3] + TAU * f64::from(first) + bend(&end) - bend(&start) - turn;
    let second = ((wrist - end.q[3]) / TAU).round() as i8;
    let within = |solution: Solution, turn| {
        let turned = solution.in_turn(&robot.limits, Some(turn));
        turned.violation.is_none()
    };
    if !within(start, first) || !within(end, second) {
        return None;
    }
    Some(Gate {
        ends,
        turns: [first, second],
        elbow: [Elbow::Positive, Elbow::Negative][side],
        turn,
        top,
        payload_kg,
        rate_hz,
    })
}

impl Gate {
    /// What is carried.
    fn payload(&self) -> Option<PayloadSpec> {
        (self.payload_kg > 0.0).then(|| PayloadSpec::compact(self.payload_kg))
    }

    /// Length of the stroke, m.
    pub(super) fn stroke(&self) -> f64 {
        let [a, b] = self.ends;
        libm::hypot(a[0] - b[0], a[1] - b[1])
    }

    /// What a run is measured against.
    pub(super) fn course(&self) -> Course {
        Course {
            ends: self.ends,
            top: self.top,
            rate_hz: self.rate_hz,
            payload: self.payload(),
            cycles: CYCLES,
        }
    }

    /// What is run: there, rest, back, rest.
    pub(super) fn scenario(&self, number: usize) -> Scenario {
        let [start, end] = self.ends;
        let [first, second] = self.turns;
        let jump = |to, turn| {
            Step::Jump(Jump {
                to,
                elbow: None,
                turn: Some(turn),
                top: self.top,
                clearance: 0.0,
                speed: 1.0,
                zone: 0.0,
            })
        };
        Scenario {
            name: format!("gate-{number}"),
            about: None,
            cycles: CYCLES,
            rate_hz: self.rate_hz,
            operation: OperationName::default(),
            law: law(),
            gains: None,
            start,
            start_elbow: Some(self.elbow),
            start_turn: Some(first),
            payload: self.payload(),
            mismatch: Mismatch::default(),
            faults: Vec::new(),
            seed: 0,
            ends: Ending::Completed,
            cycle: vec![
                jump(end, second),
                Step::Dwell(DWELL),
                jump(start, first),
                Step::Dwell(DWELL),
            ],
            requirements: Vec::new(),
            source: Source::default(),
            changes: Vec::new(),
        }
    }
}
