//! Errors on the bus of a rig: who has them, by name, and who is told.

use std::io;

use protocol::messages::Node;

use super::Rig;
use crate::bus::{Disturbance, Disturbed, NodeId};
use crate::faults::{Fault, What};
use crate::observer::Observer;

impl Rig<'_> {
    /// Plans a fault, if it concerns the bus. Its random numbers come from `seed`.
    pub fn spoil(&mut self, fault: &Fault, seed: u64) {
        let (what, share) = match fault.what {
            What::Attempts(info, kind, share) => (Disturbed::Message(info, kind), share),
            What::Misreads(name, share) => match self.named(name) {
                Some(node) => (Disturbed::Reader(node), share),
                None => return,
            },
            What::NoRecovery(name) => {
                if let Some(node) = self.named(name) {
                    self.bus.leave_off(node, fault.from, fault.until);
                }
                return;
            }
            _ => return,
        };
        let disturbance = Disturbance {
            what,
            share,
            from: fault.from,
            until: fault.until,
        };
        self.bus.disturb(disturbance, seed);
    }

    fn named(&self, name: Node) -> Option<NodeId> {
        let found = self.names.iter().find(|(other, _)| *other == name);
        found.map(|(_, node)| *node)
    }

    /// Passes on what CAN controllers have reported; byte 5 of an error frame is the code of the node.
    pub(super) fn tell<O: Observer>(&mut self, observer: &mut O) -> io::Result<()> {
        for report in self.bus.reports() {
            let named = self.names.iter().find(|(_, node)| *node == report.node);
            let code = named.map_or(0, |(name, _)| name.code());
            observer.error(report.time, &report.error_frame(code), report.busy)?;
        }
        Ok(())
    }
}
