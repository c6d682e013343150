//! The way of the arm from the beginning of its fault until it stands.

use std::collections::BTreeSet;

use protocol::time::Period;

use super::bounds::Bounds;
use super::lift::Lift;
use super::spells::Spells;
use super::verdict::Requirement;
use crate::maths::square;
use crate::observer::PlantState;

/// J that energies may differ by: a tenth of what a hand feels.
const ENERGY_TOLERANCE: f64 = 0.1;

/// The arm at the moment of a change.
#[derive(Clone, Copy, Debug)]
struct Mark {
    time: f64,
    lift: f64,
    /// Of the motion and of the springs of the end stops, J.
    energy: f64,
}

/// What is known of a fault in a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// It has been detected.
    pub(super) is_detected: bool,
    /// The controller has reported it, which is latched.
    pub(super) is_latched: bool,
}

/// The way of the arm from the beginning of its fault until it stands.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    /// The arm when the fault was detected.
    detected: Option<Mark>,
    /// The arm when torque went off, since when it has stayed off.
    off: Option<Mark>,
    /// End of the last motion, s.
    pub(super) moving: f64,
    /// Way of the tool, m.
    pub(super) distance: f64,
    /// Of it, what was travelled under torque after the detection.
    driven: f64,
    /// Greatest speed of the tool, m/s.
    fastest: f64,
    /// Greatest kinetic energy, J.
    pub(super) energy: f64,
    /// The lift since the detection.
    pub(super) lift: Lift,
}

impl Course {
    /// Whether it has been detected that something is wrong.
    pub(super) fn is_stopped(&self) -> bool {
        self.detected.is_some()
    }

    /// Judges a sample, of which `reference` is where the controller wants the lift, after the `last` one.
    pub(super) fn measure(
        &mut self,
        (last, plant): (Option<&PlantState>, &PlantState),
        reference: f64,
        period: Period,
        known: Known,
        (bounds, faults): (&Bounds, &Spells),
        missed: &mut BTreeSet<Requirement>,
    ) {
        let seconds = period.duration().seconds();
        let energy = bounds.energy(&plant.q, &plant.qd);
        let is_driven = plant.tau != [0.0; 4];
        if let Some(last) = last {
            let way = (0..3).map(|i| square(plant.tool[i] - last.tool[i]));
            let way = way.sum::<f64>().sqrt();
            self.distance += way;
            if self.detected.is_some() && is_driven {
                self.driven += way;
            }
            self.fastest = self.fastest.max(way / seconds);
        }
        self.energy = self.energy.max(energy);
        if plant.is_moving() {
            self.moving = plant.t + seconds;
        }
        if bounds.is_too_fast(&plant.q, energy) {
            missed.insert(Requirement::Energy);
        }
        if known.is_detected {
            let elastic = bounds.elastic(&plant.q);
            let now = Mark {
                time: plant.t,
                lift: plant.q[2],
                energy: energy + elastic,
            };
            let detected = *self.detected.get_or_insert(now);
            self.lift.follow(plant, reference, is_driven);
            missed.extend(if is_driven {
                self.drive(now.time - detected.time, known.is_latched, bounds, faults)
            } else {
                self.coast(now, elastic > 0.0 || faults.catch_the_tool(), bounds)
            });
        }
    }

    /// The arm has torque, so long after its fault was detected.
    fn drive(
        &mut self,
        since: f64,
        is_latched: bool,
        bounds: &Bounds,
        faults: &Spells,
    ) -> Option<Requirement> {
        let was_off = self.off.take().is_some();
        if !is_latched {
            // The drives had switched off, and nobody is told that they are on again.
            return was_off.then_some(Requirement::Latch);
        }
        let is_late = since > bounds.torque_off_s();
        if is_late && faults.leave_the_brake_open() {
            return None;
        }
        if is_late {
            return Some(Requirement::Standstill);
        }
        (self.driven > self.fastest * bounds.stop_s()).then_some(Requirement::Distance)
    }

    /// The arm has no torque, and may be on something that gives back energy.
    fn coast(&mut self, now: Mark, on_spring: bool, bounds: &Bounds) -> Option<Requirement> {
        // Torque has been off for a whole sample at the next one.
        let off = self.off.get_or_insert(now);
        if on_spring {
            // What an end stop, or what has caught the tool, gives back depends on the steps in which the plant takes the impact.
            off.energy = now.energy;
        }
        let fallen = bounds.weight_work(off.lift, now.lift);
        let is_driven = now.energy > off.energy * 1.001 + fallen + ENERGY_TOLERANCE;
        is_driven.then_some(Requirement::Energy)
    }
}
