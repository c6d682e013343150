//! How far the lift goes down that it should not.

use super::bounds::{Bounds, STANDING};
use crate::observer::PlantState;

const LIFT: usize = 2;

/// The lift since a fault was detected; downwards is positive. A stop on the path may go down with it: what counts is how far
/// the lift is below that.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lift {
    since: Option<Since>,
    /// Where a spring has caught the tool.
    caught: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Since {
    /// Lowest place that it was meant to be at: where it was at the detection, and its reference under torque.
    meant: f64,
    /// The highest place since then.
    highest: f64,
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
            highest: place,
            speed,
            drop: 0.0,
            off: None,
            sunk: 0.0,
        });
        since.highest = since.highest.min(place);
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

    /// A spring holds the tool from now on, where that is so.
    pub(super) fn catch(&mut self, plant: &PlantState, is_caught: bool) {
        if is_caught {
            self.caught.get_or_insert(plant.q[LIFT]);
        }
    }

    /// How far a spring may pull it down, m: from above to where it caught the tool, and as far beyond.
    fn pull(&self) -> f64 {
        let (Some(since), Some(caught)) = (self.since, self.caught) else {
            return 0.0;
        };
        2.0 * (caught - since.highest).max(0.0)
    }

    /// How far it went below what was meant, m.
    pub(super) fn drop(&self) -> f64 {
        self.since.map_or(0.0, |since| since.drop)
    }

    /// How far it went down since torque was off, m.
    fn sunk(&self) -> f64 {
        self.since.map_or(0.0, |since| since.sunk)
    }

    /// Greatest speed downwards at the detection and under torque, m/s.
    fn speed(&self) -> f64 {
        self.since.map_or(0.0, |since| since.speed)
    }

    /// Whether it went down further than these bounds have it; after a stop under control its closed brake holds it where it is.
    pub(super) fn is_too_low(&self, bounds: &Bounds, is_controlled: bool) -> bool {
        let allowed = bounds.drop(self.speed()) + self.pull();
        self.drop() > allowed || (is_controlled && self.sunk() > STANDING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(place: f64) -> PlantState {
        PlantState {
            t: 0.0,
            q: [0.0, 0.0, place, 0.0],
            qd: [0.0; 4],
            tau: [0.0; 4],
            tool: [0.0; 4],
            at_limit: [false; 4],
        }
    }

    /// A spring pulls down only what is above the place where it has caught the tool: an arm that has gone down since then gets no more room
    /// than without it.
    #[test]
    fn a_spring_excuses_what_it_pulls_and_no_more() {
        for (caught, detected, room) in [(0.20, 0.12, 0.16), (0.20, 0.20, 0.0), (0.10, 0.25, 0.0)] {
            let mut lift = Lift::default();
            lift.catch(&at(0.5), false);
            lift.catch(&at(caught), true);
            lift.catch(&at(detected), true);
            lift.follow(&at(detected), detected, true);
            lift.follow(&at(detected + 0.01), detected, false);
            assert!((lift.pull() - room).abs() < 1e-12, "{caught} {detected}");
            assert!((lift.drop() - 0.01).abs() < 1e-12);
        }
        assert_eq!(Lift::default().pull(), 0.0);
    }
}
