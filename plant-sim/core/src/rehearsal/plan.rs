//! What a rehearsal comes to.

use schemars::JsonSchema;
use serde::Serialize;

use crate::world::OperatorError;

/// What a scenario comes to as planned.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Plan {
    /// Scenario.
    pub scenario: String,
    /// Robot that the controller believes in.
    pub robot: String,
    /// Cycles.
    pub cycles: u32,
    /// All of it as planned, from switching on to switching off, without the time until an operator hears of each arrival, s.
    pub duration_s: f64,
    /// Moves of the cycles that were planned: those after them are the same as in the last.
    pub moves: Vec<Move>,
    /// Greatest effort over its limit, by joint.
    pub torque_utilisation: [f64; 4],
    /// Greatest speed over its limit, by joint.
    pub speed_utilisation: [f64; 4],
    /// Heat of each motor if the cycle went on for ever as planned, by joint: mean square of the effort over the continuous limit, of 1. Above 0.9
    /// the controller slows moves down.
    pub heat: [f64; 4],
    /// What can be run, and will not go as well as one may think.
    pub warnings: Vec<String>,
    /// What keeps it from running; empty where nothing does. With anything here, the numbers are those of what could be planned.
    pub refused: Vec<Refused>,
}

/// A move as planned.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Move {
    /// Cycle of the run, counted from 1.
    pub cycle: u32,
    /// Key in the scenario, such as `cycle[2].line`.
    pub step: String,
    /// How long it takes, s.
    pub duration_s: f64,
    /// Greatest effort over its limit, by joint.
    pub torque_utilisation: [f64; 4],
}

/// A step that would end the run, or what else would.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Refused {
    /// Cycle of the run, counted from 1; `null` where it is no single step.
    pub cycle: Option<u32>,
    /// Key in the scenario, such as `cycle[2].line`; `null` as above.
    pub step: Option<String>,
    /// What is refused and why, in the words of the run.
    pub reason: String,
}

impl From<OperatorError> for Refused {
    fn from(error: OperatorError) -> Self {
        let spot = match error {
            OperatorError::Refused { spot, .. }
            | OperatorError::Unfinished { spot, .. }
            | OperatorError::Held { spot, .. } => spot,
            _ => None,
        };
        Self {
            cycle: spot.map(|spot| spot.cycle.saturating_add(1)),
            step: spot.map(|spot| spot.key()),
            reason: error.to_string(),
        }
    }
}
