//! How far the lift goes down that it should not.

use super::bounds::{Bounds, STANDING};
use super::spells::Spells;
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
    /// How far it went below what was meant, and of that under torque.
    drop: f64,
    driven: f64,
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
            driven: 0.0,
            off: None,
            sunk: 0.0,
        });
        since.highest = since.highest.min(place);
        if is_driven {
            since.meant = since.meant.max(reference);
            since.speed = since.speed.max(speed);
            since.driven = since.driven.max(place - since.meant);
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

    /// Whether it went down further than these bounds have it; after a stop under control its closed brake holds it where it is. One that
    /// its brake does not hold goes down without torque, and that says nothing about the controller.
    pub(super) fn is_too_low(&self, bounds: &Bounds, is_controlled: bool, faults: &Spells) -> bool {
        let allowed = bounds.drop(self.speed()) + self.pull();
        if faults.let_the_lift_fall() {
            return self.since.is_some_and(|since| since.driven > allowed);
        }
        self.drop() > allowed || (is_controlled && self.sunk() > STANDING)
    }
}

#[cfg(test)]
mod tests {
    use protocol::time::Period;

    use super::*;
    use crate::model::RobotModel;

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

    /// What an open brake lets fall is excused, and not what goes down under torque.
    #[test]
    fn an_open_brake_excuses_what_falls_without_torque() {
        let bounds = Bounds::new(&RobotModel::irb_930_22_105(), 1e-3);
        for (is_driven, fault, too_low) in [
            (false, "brake:slow=0.1@0s", true),
            (false, "brake:stuck-open@0s", false),
            (true, "brake:slow=0.1@0s", true),
            (true, "brake:stuck-open@0s", true),
        ] {
            let mut lift = Lift::default();
            lift.follow(&at(0.1), 0.1, true);
            lift.follow(&at(0.3), 0.1, is_driven);
            let faults = Spells::new(&[fault.parse().unwrap()], Period::of_rate(1000.0));
            let is = lift.is_too_low(&bounds, false, &faults);
            assert_eq!(is, too_low, "driven {is_driven}, {fault}");
        }
    }
}
