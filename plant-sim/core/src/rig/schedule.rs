//! When the faults of a rig are in effect, where that depends on what happens.

use protocol::frame::CanFrame;
use protocol::time::Instant;

use super::Rig;
use crate::bus::Wrong;
use crate::faults::{Fault, Planned, Sense, Watch, What};
use crate::observer::Observer;
use crate::world::CellEvent;

/// Index of the lift among the joints.
const LIFT: usize = 2;

/// Faults that wait for something.
#[derive(Default)]
pub(super) struct Schedule {
    /// Each with its number among all faults.
    watches: Vec<(usize, Watch)>,
    /// All of them.
    planned: Vec<Planned>,
    sense: Sense,
    /// What is wrong with the bus, by fault.
    wrong: Vec<(Planned, Wrong)>,
}

impl Schedule {
    /// A frame is on the bus.
    pub(super) fn hear(&mut self, frame: &CanFrame) {
        self.sense.hear(frame);
    }

    /// Something happens in the cell.
    pub(super) fn notice(&mut self, event: &CellEvent) {
        self.sense.notice(event);
    }

    /// Keeps what a fault is on the bus, to move it with the fault.
    pub(super) fn follow(&mut self, fault: &Planned, wrong: Wrong) {
        self.wrong.push((fault.clone(), wrong));
    }
}

impl Rig<'_> {
    /// Plans a fault: from now on its window follows what happens.
    pub fn plan(&mut self, fault: &Fault) -> Planned {
        let watch = Watch::new(fault, self.period);
        let planned = watch.fault.clone();
        let schedule = &mut self.faults;
        if watch.waits() {
            schedule.watches.push((schedule.planned.len(), watch));
        }
        schedule.planned.push(planned.clone());
        planned
    }

    /// Whether each fault has acted up to now: those of frames where there was one to act on, all others since their windows opened.
    pub fn acted(&self) -> Vec<bool> {
        let Schedule { planned, wrong, .. } = &self.faults;
        let has_acted = |fault: &Planned| match fault.what {
            What::Frames(..) | What::Foreign(..) | What::Slow(_) => fault.has_hit(),
            What::Attempts(..) | What::Misreads(..) => {
                let of_this = wrong.iter().filter(|(other, _)| other.is(fault));
                of_this
                    .map(|(_, wrong)| *wrong)
                    .any(|wrong| self.bus.has_hit(wrong))
            }
            _ => fault.window().0 < self.now(),
        };
        planned.iter().map(has_acted).collect()
    }

    /// Opens and closes the windows of faults at a sample.
    pub(super) fn watch<O: Observer>(&mut self, now: Instant, observer: &mut O) {
        let Schedule {
            watches,
            sense,
            wrong,
            ..
        } = &mut self.faults;
        if watches.is_empty() {
            return;
        }
        sense.look(&self.world.mind, self.world.plant.qd()[LIFT]);
        let mut changes = false;
        for (number, watch) in watches {
            if watch.look(now, sense) {
                changes = true;
                let (from, until) = watch.fault.window();
                observer.fault(*number, from, until);
            }
        }
        if changes {
            for (fault, wrong) in wrong {
                let (from, until) = fault.window();
                self.bus.retime(*wrong, from, until);
            }
        }
    }
}
