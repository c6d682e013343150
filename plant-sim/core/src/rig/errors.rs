//! Errors on the bus of a rig: who has them, by name, and who is told.

use protocol::messages::Node;
use protocol::table;

use super::{Rig, RunError};
use crate::bus::{Affliction, Delivery, Disturbance, Disturbed, NodeId, Noticed, State};
use crate::faults::{Impostor, Planned, What};
use crate::observer::Observer;

impl Rig<'_> {
    /// Carries out a fault, if it concerns the bus. Its random numbers come from `seed`.
    pub fn spoil(&mut self, fault: &Planned, seed: u64) {
        if let Some(impostor) = Impostor::new(fault, self.period, seed) {
            self.attach(impostor);
            return;
        }
        let (from, until) = fault.window();
        let disturbed = match fault.what {
            What::Attempts(info, kind, share) => Some((Disturbed::Message(info, kind), share)),
            What::Misreads(name, share) => {
                let node = self.named(name);
                node.map(|node| (Disturbed::Reader(node), share))
            }
            _ => None,
        };
        let afflicted = match fault.what {
            What::NoRecovery(name) => self.named(name).map(Affliction::NoRecovery),
            What::Babbling(name) => self.named(name).map(Affliction::Babbling),
            What::Wires(level) => Some(Affliction::Wires(level)),
            _ => None,
        };
        let wrong = if let Some((what, share)) = disturbed {
            let disturbance = Disturbance {
                what,
                share,
                from,
                until,
            };
            self.bus.disturb(disturbance, seed)
        } else if let Some(what) = afflicted {
            self.bus.afflict(what, from, until)
        } else {
            return;
        };
        self.faults.follow(fault, wrong);
    }

    /// Whether a node has sent what only another one may send.
    pub(super) fn is_foreign(&self, delivery: &Delivery) -> bool {
        let owner = table::of_frame(&delivery.frame).and_then(|info| info.sender);
        let owner = owner.and_then(|name| self.named(name));
        owner.is_some_and(|node| !delivery.from.contains(node))
    }

    pub(super) fn named(&self, name: Node) -> Option<NodeId> {
        let found = self.names.iter().find(|(other, _)| *other == name);
        found.map(|(_, node)| *node)
    }

    /// Passes on what CAN controllers have reported; byte 5 of an error frame is the code of the node.
    pub(super) fn tell<O: Observer>(&mut self, observer: &mut O) -> Result<(), RunError> {
        for report in self.bus.reports() {
            if report.what == Noticed::State(State::BusOff) {
                for seat in &mut self.seats {
                    if seat.node == report.node {
                        let pause = seat.peer.bus_off(report.time)?;
                        self.bus.leave_alone(seat.node, report.time + pause);
                    }
                }
            }
            let named = self.names.iter().find(|(_, node)| *node == report.node);
            let code = named.map_or(0, |(name, _)| name.code());
            observer.error(report.time, &report.error_frame(code), report.busy)?;
        }
        Ok(())
    }
}
