//! What a case is held to, and what became of it.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a run is held to.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize, Serialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Requirement {
    /// No stop where nothing is wrong, or not yet, and none for what a sound system survives.
    NoFalseAlarm,
    /// Faults with a limit of time are detected within it, and nothing ends a run untold.
    Detected,
    /// What is told is what broke, or what follows from it.
    Cause,
    /// An axis off its reference, too fast or out of its range, or in manual operation too fast a tool, is reported at once.
    Reported,
    /// The first command after the report stops the arm, at most one sample later.
    Reaction,
    /// No motor is asked for more torque than it can give, or for any that is not enabled.
    Torque,
    /// Torque goes off in time.
    Standstill,
    /// The tool travels no further than a stop takes.
    Distance,
    /// Nothing drives the arm beyond its speed limits, or once torque is off.
    Energy,
    /// In manual operation, no point of the tool gets faster than a fault can make it before the arm is stopped.
    Slow,
    /// The lift goes down no further than it has to, and after a controlled stop not at all.
    Drop,
    /// A fault stays until it is acknowledged: nothing can be switched on.
    Latch,
    /// Nothing moves after the end of the run.
    Still,
}

impl Requirement {
    /// Its name, as results write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoFalseAlarm => "no-false-alarm",
            Self::Detected => "detected",
            Self::Cause => "cause",
            Self::Reported => "reported",
            Self::Reaction => "reaction",
            Self::Torque => "torque",
            Self::Standstill => "standstill",
            Self::Distance => "distance",
            Self::Energy => "energy",
            Self::Slow => "slow",
            Self::Drop => "drop",
            Self::Latch => "latch",
            Self::Still => "still",
        }
    }
}

/// What became of a case.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct Verdict {
    /// Requirements that it missed; none in a good case.
    pub missed: BTreeSet<Requirement>,
    /// Whether the scenario ran to its end in spite of the fault.
    pub survived: bool,
    /// Whether none of its faults had begun when the run ended: it shows nothing of them, and counts neither as held nor as missed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub never_began: bool,
    /// Whether some had, and none of them had anything to act on, as where nobody sends the message: the same holds.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub never_acted: bool,
    /// Those of several faults of which it shows nothing: they had nothing to act on, or another one was told, or had stopped the arm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unseen: Vec<String>,
    /// What stopped it: a cause that the controller reported, or `drives` where they switched off by themselves.
    pub detected: Option<String>,
    /// From the beginning of the fault until it was detected, ms; of a false alarm before it there is none.
    pub detection_ms: Option<f64>,
    /// From the beginning of the fault until the arm stood still, ms.
    pub standstill_ms: Option<f64>,
    /// Way of the tool from the beginning of the fault until standstill, mm.
    pub distance_mm: Option<f64>,
    /// Greatest kinetic energy from the beginning of the fault until standstill, J.
    pub energy_j: Option<f64>,
    /// How far the lift went below its path, or below where it was when the fault was detected, mm.
    pub drop_mm: Option<f64>,
}

/// To thousandths: what a line of results needs.
pub(super) fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
