//! How warm the motors got.

use protocol::messages::{LimitFlags, State};
use protocol::time::Instant;
use schemars::JsonSchema;
use serde::Serialize;

use crate::metrics::Heat;
use crate::model::{AXES, RobotModel};
use crate::observer::Truth;

/// Heat of the motors: mean square of the effort over the continuous limit, over the last 30 s; 1 is what a motor may have for ever. The controller
/// begins moves more slowly from 0.9 on, and stops the arm at 1.2.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Warmth {
    /// Axis of the motor that got warmest.
    pub warmest: &'static str,
    /// How warm it got, of 1.
    pub greatest: f64,
    /// Heat of each motor at the end, of 1.
    pub at_end: [f64; 4],
    /// When the controller first reported motors so warm that it slows moves down, s; `null` if never.
    pub slowed_from_s: Option<f64>,
}

/// Gathers it.
pub(super) struct Thermometer {
    heat: Heat,
    slowed: Option<f64>,
}

impl Thermometer {
    pub(super) fn new(robot: &RobotModel) -> Self {
        Self {
            heat: Heat::new(robot),
            slowed: None,
        }
    }

    pub(super) fn sample(&mut self, truth: &Truth) {
        self.heat.sample(truth.plant.t, &truth.plant.tau);
    }

    pub(super) fn state(&mut self, time: Instant, state: &State) {
        if state.limits.contains(LimitFlags::WARM) {
            self.slowed.get_or_insert(time.seconds());
        }
    }

    pub(super) fn finish(self) -> Warmth {
        let each = self.heat.greatest().into_iter().zip(AXES);
        let (greatest, warmest) = each.fold((0.0, AXES[0]), |warmest, axis| {
            if axis.0 > warmest.0 { axis } else { warmest }
        });
        Warmth {
            warmest,
            greatest,
            at_end: self.heat.shares(),
            slowed_from_s: self.slowed,
        }
    }
}
