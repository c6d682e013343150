//! The end of an attempt to send: what nodes count, what state that brings them to, and what they report.

use protocol::time::{Duration, Instant};

use super::counters::{Rule, State};
use super::course::Course;
use super::disturbance::ErrorKind;
use super::foresight::{Clash, Transmission, Trouble};
use super::report::{Noticed, Report};
use super::{BuiltinBus, Field, NodeId, NodeSet};

/// Bits for which a passive transmitter lets others go first.
pub(super) const SUSPENSION: u32 = 8;
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
        let sent = [Rule::Sent];
        let rules = match &next.trouble {
            None => &sent[..],
            Some(trouble) => &trouble.course.transmitter,
        };
        for NodeId(index) in next.from.iter() {
            rules.iter().for_each(|rule| count(nodes, index, *rule));
        }
        for NodeId(index) in next.losers().iter() {
            count(nodes, index, Rule::TransmitterFlag);
        }
        let is_whole = (next.trouble.as_ref()).is_none_or(|it| it.course.destroyed.is_none());
        for index in 0..nodes.len() {
            let node = &nodes[index];
            let sends = |nodes: NodeSet| nodes.contains(NodeId(index));
            if node.off.is_some() || sends(next.from) || sends(next.losers()) {
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
        let senders = next.from.iter().map(|node| (node, flag));
        let unseen = if course.is_none_or(|course| course.destroyed.is_none()) {
            PASSIVE_FLAG
        } else {
            0
        };
        let losers = next.losers();
        let losers = losers.iter().map(|node| (node, unseen));
        for (NodeId(index), flag) in senders.chain(losers) {
            if self.nodes[index].counters.state() == State::ErrorPassive {
                self.nodes[index].ready = next.idle + self.bits(SUSPENSION + flag);
            }
        }
    }

    /// The report of the node that sees the error first: a reader of a wrong CRC, and otherwise the transmitter.
    fn report_error(&mut self, next: &Transmission) {
        let in_vain = |course: Option<&Course>| match course.and_then(|it| it.destroyed) {
            Some(_) => next.idle.since(next.start),
            None => Duration::ZERO,
        };
        if let Some(Clash { hit, losers }) = &next.clash {
            let what = Noticed::Error {
                kind: hit.kind,
                field: hit.bit.field,
                recessive: hit.bit.recessive,
                sending: true,
            };
            let busy = in_vain(next.trouble.as_ref().map(|it| &it.course));
            for NodeId(loser) in losers.iter().take(1) {
                self.report(next.end, loser, what, busy);
            }
        }
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
            let busy = in_vain(Some(&trouble.course));
            self.report(next.end, node, what, busy);
        }
    }
}
