//! Corners that the arm may cut: how far from them it has passed.

use schemars::JsonSchema;
use serde::Serialize;

use crate::observer::Truth;
use crate::setup::RunConfig;

/// End of a move with a zone.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Corner {
    /// Its step, `cycle[0].line`.
    pub step: String,
    /// How far the arm may pass from it, mm.
    pub zone_mm: f64,
    /// How far the true tool has passed from it, the greatest of all cycles, mm: next to 0 where it stopped there. `null` until a cycle is completed.
    pub passed_mm: Option<f64>,
    /// Zone minus that, mm.
    pub margin_mm: Option<f64>,
}

/// Gathers them.
pub(super) struct Corners {
    corners: Vec<Corner>,
    /// Each one, m.
    places: Vec<[f64; 3]>,
    /// Least distance of the tool from each one in this cycle, m.
    nearest: Vec<f64>,
}

impl Corners {
    pub(super) fn new(config: &RunConfig) -> Self {
        let (mut corners, mut places) = (Vec::new(), Vec::new());
        for (index, step) in config.scenario.cycle.iter().enumerate() {
            if let Some([x, y, z, _]) = config.target(step)
                && step.zone() > 0.0
            {
                places.push([x, y, z]);
                corners.push(Corner {
                    step: format!("cycle[{index}].{}", step.name()),
                    zone_mm: step.zone() * 1e3,
                    passed_mm: None,
                    margin_mm: None,
                });
            }
        }
        let nearest = vec![f64::INFINITY; places.len()];
        Self {
            corners,
            places,
            nearest,
        }
    }

    pub(super) fn begin_cycle(&mut self) {
        self.nearest.fill(f64::INFINITY);
    }

    pub(super) fn sample(&mut self, truth: &Truth) {
        let [x, y, z, _] = truth.plant.tool;
        for ([to_x, to_y, to_z], nearest) in self.places.iter().zip(&mut self.nearest) {
            let (x, y, z) = (x - to_x, y - to_y, z - to_z);
            *nearest = nearest.min((x * x + y * y + z * z).sqrt());
        }
    }

    pub(super) fn end_cycle(&mut self) {
        for (corner, nearest) in self.corners.iter_mut().zip(&self.nearest) {
            let passed = (nearest * 1e3).max(corner.passed_mm.unwrap_or(0.0));
            corner.passed_mm = Some(passed);
            corner.margin_mm = Some(corner.zone_mm - passed);
        }
    }

    pub(super) fn finish(self) -> Vec<Corner> {
        self.corners
    }
}
