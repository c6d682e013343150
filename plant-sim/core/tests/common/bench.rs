//! A bus of some nodes, and what is sent on it.

use protocol::frame::CanFrame;
use protocol::time::Instant;
use protocol::wire::BitTiming;
use sim::bus::{BuiltinBus, Delivery, NodeId, Report};

pub(crate) fn ns(ns: u64) -> Instant {
    Instant::from_nanos(ns)
}

/// A bus of some nodes, and frames that are sent on it.
pub(crate) struct Bench {
    pub(crate) bus: BuiltinBus,
    pub(crate) nodes: Vec<NodeId>,
    pub(crate) reports: Vec<Report>,
}

impl Bench {
    pub(crate) fn of(nodes: usize) -> Self {
        let mut bus = BuiltinBus::new(BitTiming::default());
        let nodes = (0..nodes).map(|_| bus.attach(64)).collect();
        Self {
            bus,
            nodes,
            reports: Vec::new(),
        }
    }

    pub(crate) fn send(&mut self, node: usize, at: u64, frame: &CanFrame) {
        self.bus.enqueue(self.nodes[node], ns(at), frame).unwrap();
    }

    pub(crate) fn run(&mut self, until: u64) -> Vec<Delivery> {
        let delivered = std::iter::from_fn(|| self.bus.pop_delivery(ns(until))).collect();
        self.reports.extend(self.bus.reports());
        delivered
    }
}
