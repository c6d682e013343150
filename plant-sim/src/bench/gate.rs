//! The gates, and the scenario of each.

use std::sync::LazyLock;

use serde::Deserialize;
use sim::scenario::{Ending, Jump, Mismatch, OperationName, PayloadSpec, Scenario, Step};
use sim::selection::LawChoice;
use sim::text::Source;

use super::Extent;
use super::watch::Course;

/// Half of the stroke, m.
const HALF_STROKE: f64 = 0.15;
/// Height of the flange at both ends, m.
const Z: f64 = -0.25;
/// How far the gate goes up, m.
const RISE: f64 = 0.025;
/// Round trips of a run.
const CYCLES: u32 = 2;
/// Rest at each end, in which the tool has to settle, s.
pub(super) const DWELL: f64 = 0.25;
/// Control rates, Hz.
const RATES: [f64; 2] = [1000.0, 2000.0];
/// True friction over the one believed.
const FRICTION: [f64; 2] = [0.7, 1.3];
/// True payload over the announced one.
const PAYLOAD: [f64; 2] = [0.8, 1.2];

/// A place with a payload, and what is the least there.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Gate {
    /// Name of the place.
    pub place: String,
    /// From axis 1 to the middle of the stroke, m.
    pub radius_m: f64,
    /// Angle between the stroke and the radius, degrees.
    pub stroke_deg: f64,
    /// Payload, kg.
    pub payload_kg: f64,
    /// Round trip at the optimum, s.
    pub optimum_s: f64,
}

/// A gate under one control rate, with one mismatch.
#[derive(Clone, Debug)]
pub struct Case {
    /// Which gate.
    pub gate: Gate,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// How the robot differs from what the controller believes.
    pub mismatch: Mismatch,
}

/// Every gate.
pub fn gates() -> &'static [Gate] {
    static GATES: LazyLock<Vec<Gate>> = LazyLock::new(|| {
        let text = include_str!("../../gates/optima.csv");
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let gates: Result<_, _> = reader.deserialize().collect();
        gates.expect("the table that comes with the program is valid")
    });
    &GATES
}

/// The law that is measured.
pub(super) fn law() -> LawChoice {
    let law = "computed-torque:observer".parse();
    law.expect("a law's name")
}

/// The cases of a benchmark: first those without mismatch.
pub(super) fn cases(extent: Extent) -> Vec<Case> {
    let gates = gates().iter().filter(|gate| match extent {
        Extent::Whole => true,
        Extent::Quick => gate.place == "mid-tan" && [2.0, 22.0].contains(&gate.payload_kg),
    });
    let rates: &[f64] = match extent {
        Extent::Whole => &RATES,
        Extent::Quick => &RATES[..1],
    };
    let mut right = Vec::new();
    let mut wrong = Vec::new();
    for rate_hz in rates {
        for gate in gates.clone() {
            let case = |friction, payload| Case {
                gate: gate.clone(),
                rate_hz: *rate_hz,
                mismatch: Mismatch { friction, payload },
            };
            right.push(case(1.0, 1.0));
            for friction in FRICTION {
                // Nothing is as heavy whatever it is multiplied by.
                let payloads: &[f64] = if gate.payload_kg > 0.0 {
                    &PAYLOAD
                } else {
                    &[1.0]
                };
                wrong.extend(payloads.iter().map(|payload| case(friction, *payload)));
            }
        }
    }
    right.extend(wrong);
    right
}

impl Case {
    /// What a run is measured against.
    pub(super) fn course(&self) -> Course {
        let Self {
            rate_hz, mismatch, ..
        } = *self;
        let payload = self.scenario().payload;
        Course {
            ends: self.ends(),
            top: Z + RISE,
            rate_hz,
            payload: payload.map(|payload| payload.scaled(mismatch.payload)),
            cycles: CYCLES,
        }
    }

    /// Both ends of the stroke: x, y, z, yaw.
    fn ends(&self) -> [[f64; 4]; 2] {
        let Gate {
            radius_m,
            stroke_deg,
            ..
        } = self.gate;
        let (sin, cos) = libm::sincos(stroke_deg.to_radians());
        [-HALF_STROKE, HALF_STROKE].map(|half| [radius_m + half * cos, half * sin, Z, 0.0])
    }

    /// What is run: there, rest, back, rest.
    pub fn scenario(&self) -> Scenario {
        let [start, end] = self.ends();
        let jump = |to| {
            Step::Jump(Jump {
                to,
                elbow: None,
                turn: None,
                top: Z + RISE,
                clearance: 0.0,
                speed: 1.0,
                zone: 0.0,
            })
        };
        let Gate {
            place, payload_kg, ..
        } = &self.gate;
        Scenario {
            name: format!("gate-{place}-{payload_kg}kg"),
            about: None,
            cycles: CYCLES,
            rate_hz: self.rate_hz,
            law: law(),
            operation: OperationName::Automatic,
            gains: None,
            start,
            start_elbow: None,
            start_turn: None,
            payload: (*payload_kg > 0.0).then(|| PayloadSpec::compact(*payload_kg)),
            mismatch: self.mismatch,
            faults: Vec::new(),
            seed: 0,
            ends: Ending::Completed,
            cycle: vec![
                jump(end),
                Step::Dwell(DWELL),
                jump(start),
                Step::Dwell(DWELL),
            ],
            requirements: Vec::new(),
            source: Source::default(),
            changes: Vec::new(),
        }
    }
}
