//! One cycle: when it moved, when the tool arrived, and how far off it ended.

use schemars::JsonSchema;
use serde::Serialize;

use super::offset::Offset;
use crate::observer::Truth;

/// Offset within which a cycle counts as ended.
const COARSE: Offset = Offset::new(1e-3, 1e-2);
/// Offset within which the tool counts as settled.
const FINE: Offset = Offset::new(1e-5, 1e-4);

/// Result of one cycle. Times are `null` where nothing moved, where the tool never got that close, and, like the final
/// error, where the cycle ends in a stop on the path and so has no target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CycleResult {
    /// Start of motion, s of simulated time; where nothing moved, start of the cycle.
    pub start_s: f64,
    /// Whether the reference moved at all.
    pub moved: bool,
    /// From the start of motion until the tool is back within 1 mm and 10 mrad of the target and stays.
    pub cycle_time_s: Option<f64>,
    /// From the end of the commanded motion until the tool is within 0.01 mm and 0.1 mrad and stays.
    pub settle_time_s: Option<f64>,
    /// Length of the commanded motion, s.
    pub commanded_s: f64,
    /// Distance from the target at the end of the dwell, mm.
    pub final_error_mm: Option<f64>,
    /// Yaw error from the target at the end of the dwell, mrad.
    pub final_error_mrad: Option<f64>,
}

/// One cycle while it runs.
#[derive(Clone, Debug)]
pub(super) struct Cycle {
    /// Target of the tool: x, y, z, yaw.
    target: Option<[f64; 4]>,
    /// First sample.
    begun: Option<f64>,
    /// The previous sample.
    previous: Option<f64>,
    /// Last sample at rest before the reference first moved.
    started: Option<f64>,
    /// Whether the reference moved at the last sample.
    moving: bool,
    /// First sample at rest again.
    commanded_end: f64,
    /// First sample since which the tool has stayed within the radius of the target.
    coarse_since: Option<f64>,
    fine_since: Option<f64>,
    /// Offset from the target at the last sample.
    offset: Option<Offset>,
}

impl Cycle {
    pub(super) fn new(target: Option<[f64; 4]>) -> Self {
        Self {
            target,
            begun: None,
            previous: None,
            started: None,
            moving: false,
            commanded_end: 0.0,
            coarse_since: None,
            fine_since: None,
            offset: None,
        }
    }

    /// One sample; returns whether the reference moves.
    pub(super) fn sample(&mut self, truth: &Truth) -> bool {
        let now = truth.plant.t;
        self.begun.get_or_insert(now);
        let moving = truth.mind.qd.iter().any(|qd| *qd != 0.0);
        if moving {
            self.started.get_or_insert(self.previous.unwrap_or(now));
        } else if self.moving {
            self.commanded_end = now;
        }
        self.moving = moving;
        self.previous = Some(now);
        self.offset = self
            .target
            .map(|target| Offset::between(&truth.plant.tool, &target));
        for (radius, since) in [
            (COARSE, &mut self.coarse_since),
            (FINE, &mut self.fine_since),
        ] {
            if self.offset.is_some_and(|offset| offset.is_within(radius)) {
                since.get_or_insert(now);
            } else {
                *since = None;
            }
        }
        moving
    }

    /// The result; `None` without a sample.
    pub(super) fn result(&self) -> Option<CycleResult> {
        let begun = self.begun?;
        let error = |part: fn(Offset) -> f64| self.offset.map(|offset| part(offset) * 1e3);
        let still = CycleResult {
            start_s: begun,
            moved: false,
            cycle_time_s: None,
            settle_time_s: None,
            commanded_s: 0.0,
            final_error_mm: error(|offset| offset.position),
            final_error_mrad: error(|offset| offset.yaw),
        };
        let Some(started) = self.started else {
            return Some(still);
        };
        // A move too small to leave the radius ends with its reference.
        let arrived = |since: f64| {
            if since > started {
                since
            } else {
                self.commanded_end
            }
        };
        Some(CycleResult {
            start_s: started,
            moved: true,
            cycle_time_s: self.coarse_since.map(|since| arrived(since) - started),
            settle_time_s: self
                .fine_since
                .map(|since| (since - self.commanded_end).max(0.0)),
            commanded_s: self.commanded_end - started,
            ..still
        })
    }
}
