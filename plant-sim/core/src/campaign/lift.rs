//! How far the lift goes down that it should not.

use crate::observer::PlantState;

const LIFT: usize = 2;

/// The lift since a fault was detected; downwards is positive. A stop on the path may go down with it: what counts is how far
/// the lift is below that.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lift {
    since: Option<Since>,
}

#[derive(Clone, Copy, Debug)]
struct Since {
    /// Lowest place that it was meant to be at: where it was at the detection, and its reference under torque.
    meant: f64,
    /// Greatest speed at the detection and under torque.
    speed: f64,
    /// How far it went below what was meant.
    drop: f64,
    /// Where torque went off, since when it has stayed off.
    off: Option<f64>,
    /// How far it went down since then.
    sunk: f64,
}

impl Lift {
    /// One sample; `reference` is where the controller wants it.
    pub(super) fn follow(&mut self, plant: &PlantState, reference: f64, is_driven: bool) {
        let (place, speed) = (plant.q[LIFT], plant.qd[LIFT]);
        let since = self.since.get_or_insert(Since {
            meant: place,
            speed,
            drop: 0.0,
            off: None,
            sunk: 0.0,
        });
        if is_driven {
            since.meant = since.meant.max(reference);
            since.speed = since.speed.max(speed);
            since.off = None;
            since.sunk = 0.0;
        } else {
            let off = *since.off.get_or_insert(place);
            since.sunk = since.sunk.max(place - off);
        }
        since.drop = since.drop.max(place - since.meant);
    }

    /// How far it went below what was meant, m.
    pub(super) fn drop(&self) -> f64 {
        self.since.map_or(0.0, |since| since.drop)
    }

    /// How far it went down since torque was off, m.
    pub(super) fn sunk(&self) -> f64 {
        self.since.map_or(0.0, |since| since.sunk)
    }

    /// Greatest speed downwards at the detection and under torque, m/s.
    pub(super) fn speed(&self) -> f64 {
        self.since.map_or(0.0, |since| since.speed)
    }
}
