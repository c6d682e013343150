//! The end of an attempt to send: what nodes count, what state that brings them to, and what they report.

use protocol::time::{Duration, Instant};

use super::counters::{Rule, State};
use super::disturbance::ErrorKind;
use super::foresight::{Transmission, Trouble};
use super::report::{Noticed, Report};
use super::statistics::Collision;
use super::{BuiltinBus, Field, NodeId, NodeSet};

/// Bits for which a passive transmitter lets others go first.
const SUSPENSION: u32 = 8;
/// Bits of a passive error flag.
const PASSIVE_FLAG: u32 = 6;

impl BuiltinBus {
    /// Counts and reports what becomes of an attempt; returns who receives the frame.
    pub(super) fn settle(&mut self, next: &Transmission) -> NodeSet {
        let mut to = NodeSet::default();
        let mut changed = Vec::new();
        let mut count = |nodes: &mut [super::Node], index: usize, rule: Rule| {
            let counters = &mut nodes[index].counters;
            let before = counters.state();
            counters.count(rule);
            if counters.state() != before {
                changed.push(index);
            }
        };
        let nodes = &mut self.nodes;
        for NodeId(index) in next.from.iter() {
            let rule = match &next.trouble {
                None => Some(Rule::Sent),
                Some(trouble) => trouble.course.transmitter,
            };
            if let Some(rule) = rule {
                count(nodes, index, rule);
            }
        }
        let is_whole = (next.trouble.as_ref()).is_none_or(|it| it.course.destroyed.is_none());
        for index in 0..nodes.len() {
            let node = &nodes[index];
            if node.off.is_some() || next.from.contains(NodeId(index)) {
                continue;
            }
            if node.listens {
                if is_whole {
                    to.insert(index);
                }
            } else if next.trouble.is_none() {
                count(nodes, index, Rule::Received);
                to.insert(index);
            }
        }
        if let Some(Trouble {
            readers, course, ..
        }) = next.trouble.as_deref()
        {
            for ((index, _), (rules, received)) in readers.iter().zip(&course.readers) {
                for rule in rules {
                    count(nodes, *index, *rule);
                }
                if *received {
                    to.insert(*index);
                }
            }
        }
        self.suspend(next);
        self.report_error(next);
        changed.dedup();
        for index in changed {
            let state = self.nodes[index].counters.state();
            self.report(next.end, index, Noticed::State(state), Duration::ZERO);
        }
        self.interference.draw();
        to
    }

    /// Both frames are lost, and nobody counts: see [`Collision`].
    pub(super) fn collide(&mut self, next: &Transmission) {
        self.statistics.collisions += 1;
        self.statistics.first_collision.get_or_insert(Collision {
            start: next.start,
            id: next.frame.id(),
            nodes: next.from,
        });
    }

    pub(super) fn report(&mut self, time: Instant, node: usize, what: Noticed, busy: Duration) {
        self.reports.push(Report {
            time,
            node: NodeId(node),
            what,
            counters: self.nodes[node].counters,
            busy,
        });
    }

    /// A passive transmitter lets others go first, after its own error flag if nobody has seen that.
    fn suspend(&mut self, next: &Transmission) {
        let course = next.trouble.as_ref().map(|it| &it.course);
        let flag = match course {
            Some(course) if course.passive_flag => PASSIVE_FLAG,
            _ => 0,
        };
        for NodeId(index) in next.from.iter() {
            if self.nodes[index].counters.state() == State::ErrorPassive {
                self.nodes[index].ready = next.idle + self.bits(SUSPENSION + flag);
            }
        }
    }

    /// The report of the node that sees the error first: a reader of a wrong CRC, and otherwise the transmitter.
    fn report_error(&mut self, next: &Transmission) {
        let Some(trouble) = &next.trouble else {
            return;
        };
        let Some(kind) = trouble.course.error else {
            return;
        };
        let mut misread = trouble.readers.iter().filter(|(_, it)| it.misreads);
        let reader = misread.next().filter(|_| kind == ErrorKind::Crc);
        let sender = next.from.iter().next().map(|node| node.0);
        let (field, recessive) = match (kind, trouble.hit) {
            (ErrorKind::Crc, _) => (Field::Crc, None),
            (ErrorKind::Ack, _) => (Field::AckSlot, None),
            (_, Some(hit)) => (hit.bit.field, hit.bit.recessive),
            (_, None) => return,
        };
        let what = Noticed::Error {
            kind,
            field,
            recessive,
            sending: reader.is_none(),
        };
        if let Some(node) = reader.map(|(index, _)| *index).or(sender) {
            let busy = match trouble.course.destroyed {
                Some(_) => next.idle.since(next.start),
                None => Duration::ZERO,
            };
            self.report(next.end, node, what, busy);
        }
    }
}
