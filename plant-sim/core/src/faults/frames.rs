//! Faults in the frames that a node sends.

use std::collections::VecDeque;

use oorandom::Rand64;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Nmt, Node};
use protocol::schema::{Kind, MessageInfo, Signal};
use protocol::table;
use protocol::time::{Duration, Instant};

use super::impostor::like;
use super::watch::Planned;
use super::{FrameFault, What, duration};
use crate::peer::{Outbox, Peer, PeerError};
use crate::world::World;

/// A node whose frames suffer the faults of a run. Without faults it is the node itself.
#[derive(Debug)]
pub struct Faulty<P> {
    peer: P,
    node: Node,
    faults: Vec<Suffered>,
    random: Rand64,
    /// Whether it had no power at the last call.
    was_dead: bool,
    /// Until then it works on the samples that it has received, if it is slow.
    busy: Instant,
    /// What the node has sent in the current call; empty between calls.
    sent: Outbox,
}

/// A fault of one message's frames, or of the node.
#[derive(Debug)]
struct Suffered {
    fault: Planned,
    /// Of a replay: the last frames of the message, as many as it goes back; the newest last. Of reordering: the frame that is
    /// held back.
    history: VecDeque<CanFrame>,
    /// Of losses in bursts: whether one is going on.
    in_burst: bool,
}

impl<P: Peer> Faulty<P> {
    /// Wraps `peer`, which is `node`, in those faults that concern its frames.
    pub fn new(peer: P, node: Node, faults: &[Planned], seed: u64) -> Self {
        let mut faulty = Self {
            peer,
            node,
            faults: Vec::new(),
            // Each node draws from its own sequence, so that the frames of one do not change the faults of another.
            random: Rand64::new(u128::from(seed) << 8 | node as u128),
            was_dead: false,
            busy: Instant::ORIGIN,
            sent: Outbox::new(),
        };
        for fault in faults {
            faulty.suffer_also(fault);
        }
        faulty
    }

    /// Adds a fault, if it concerns the frames of this node.
    pub(crate) fn suffer_also(&mut self, fault: &Planned) {
        let concerns = match fault.what {
            What::Frames(info, _) => info.sender.is_none_or(|sender| sender == self.node),
            What::Silent(node) | What::Dead(node) => node == self.node,
            What::Slow(_) => self.node == Node::Controller,
            _ => false,
        };
        if concerns {
            self.faults.push(Suffered {
                fault: fault.clone(),
                history: VecDeque::new(),
                in_burst: false,
            });
        }
    }

    /// The node itself.
    pub(crate) fn peer(&self) -> &P {
        &self.peer
    }

    /// The node itself.
    pub(crate) fn peer_mut(&mut self) -> &mut P {
        &mut self.peer
    }

    fn is(&self, what: What, now: Instant) -> bool {
        self.faults
            .iter()
            .any(|Suffered { fault, .. }| fault.what == what && fault.acts(now))
    }

    /// Starts the node anew, as network management does.
    fn restart(&mut self, now: Instant, world: &mut World) -> Result<(), PeerError> {
        let reset = Message::Nmt(Nmt::reset(self.node));
        let Ok(reset) = codec::encode(&reset, 0) else {
            return Ok(());
        };
        self.peer.poll(now, Some(&reset), world, &mut Outbox::new())
    }

    /// How late the node answers what it has received `now`: it works on one sample after the other.
    fn lateness(&mut self, now: Instant, received: Option<&CanFrame>) -> Duration {
        if received.is_some_and(|frame| table::FEEDBACK.identifies(frame)) {
            for Suffered { fault, .. } in &self.faults {
                if let What::Slow(seconds) = fault.what
                    && fault.acts(now)
                {
                    self.busy = self.busy.max(now) + duration(seconds);
                    fault.hit();
                }
            }
        }
        self.busy.since(now)
    }

    /// What becomes of a frame that the node sends at `time`.
    fn suffer(&mut self, time: Instant, frame: CanFrame, out: &mut Outbox) {
        let first = out.len();
        out.push((time, frame));
        for Suffered {
            fault,
            history,
            in_burst,
        } in &mut self.faults
        {
            let What::Frames(info, kind) = fault.what else {
                continue;
            };
            if !info.identifies(&frame) {
                continue;
            }
            // A replay needs frames from before it, too.
            let mut old = None;
            if let FrameFault::Replay(back) = kind {
                history.push_back(frame);
                if history.len() > back {
                    old = history.pop_front();
                }
            }
            if matches!(kind, FrameFault::Reorder(_))
                && let Some(held) = history.pop_front()
            {
                out.push((time, held));
                continue;
            }
            if !fault.acts(time) {
                continue;
            }
            let was_there = out.len() > first;
            let hits = match kind {
                FrameFault::Burst(share, length) => {
                    // The chain of Gilbert: a burst ends after `length` frames on average, and `share` of all are in one.
                    let ends = 1.0 / length;
                    let changes = if *in_burst {
                        ends
                    } else {
                        ends * share / (1.0 - share)
                    };
                    *in_burst ^= self.random.rand_float() < changes;
                    if *in_burst {
                        out.truncate(first);
                    }
                    *in_burst
                }
                FrameFault::Reorder(share) => {
                    let hits = self.random.rand_float() < share;
                    if hits {
                        history.extend(out.drain(first..).map(|(_, frame)| frame));
                    }
                    hits
                }
                FrameFault::Loss(share) => {
                    let hits = self.random.rand_float() < share;
                    if hits {
                        out.truncate(first);
                    }
                    hits
                }
                FrameFault::Delay(seconds) => {
                    delay(&mut out[first..], seconds);
                    true
                }
                FrameFault::Jitter(seconds) => {
                    delay(&mut out[first..], seconds * self.random.rand_float());
                    true
                }
                FrameFault::Duplicate => {
                    out.extend_from_within(first..);
                    true
                }
                FrameFault::Corrupt(share) => {
                    let hits = self.random.rand_float() < share;
                    if hits {
                        for (_, frame) in &mut out[first..] {
                            flip(frame, &mut self.random);
                        }
                    }
                    hits
                }
                FrameFault::BadValue(share) => {
                    let hits = self.random.rand_float() < share;
                    if hits {
                        for (_, frame) in &mut out[first..] {
                            spoil(frame, info);
                        }
                    }
                    hits
                }
                FrameFault::Replay(_) => {
                    if let Some(old) = old {
                        out.truncate(first);
                        out.push((time, old));
                    }
                    old.is_some()
                }
            };
            // What another fault has taken already is not hit.
            if hits && was_there {
                fault.hit();
            }
        }
    }
}

fn delay(sent: &mut [(Instant, CanFrame)], seconds: f64) {
    for (time, _) in sent {
        *time += duration(seconds);
    }
}

/// Inverts one bit of the data.
fn flip(frame: &mut CanFrame, random: &mut Rand64) {
    let bits = 8 * frame.data().len() as u64;
    if bits == 0 {
        return;
    }
    let bit = random.rand_range(0..bits) as usize;
    let mut data = frame.data().to_vec();
    data[bit / 8] ^= 1 << (bit % 8);
    *frame = like(frame, &data);
}

/// A real number that the message always carries.
pub(super) fn real_number(info: &MessageInfo) -> Option<&Signal> {
    let mut signals = info.signals.iter();
    signals.find(|signal| signal.when.is_none() && matches!(signal.kind, Kind::F32 { .. }))
}

/// Puts what is no number in its place.
fn spoil(frame: &mut CanFrame, info: &MessageInfo) {
    let (Ok(received), Some(signal)) = (codec::decode(frame), real_number(info)) else {
        return;
    };
    let mut data = frame.data().to_vec();
    data[signal.offset..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    if let Some(profile) = info.protection {
        profile.protect(info.id, received.counter.unwrap_or(0), &mut data);
    }
    *frame = like(frame, &data);
}

impl<P: Peer> Peer for Faulty<P> {
    fn wake(&self) -> Option<Instant> {
        self.peer.wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        if self.faults.is_empty() {
            return self.peer.poll(now, received, world, out);
        }
        let dead = self.is(What::Dead(self.node), now);
        if dead != self.was_dead {
            self.was_dead = dead;
            self.restart(now, world)?;
        }
        let silent = dead || self.is(What::Silent(self.node), now);
        if silent && received.is_some() {
            return Ok(());
        }
        let mut sent = std::mem::take(&mut self.sent);
        self.peer.poll(now, received, world, &mut sent)?;
        let late = self.lateness(now, received);
        if late > Duration::ZERO
            && let Some((time, _)) = sent.first()
        {
            self.peer.took((*time + late).since(now))?;
        }
        for (time, frame) in sent.drain(..) {
            if !silent {
                self.suffer(time + late, frame, out);
            }
        }
        self.sent = sent;
        Ok(())
    }

    fn bus_off(&mut self, now: Instant) -> Result<Duration, PeerError> {
        self.peer.bus_off(now)
    }

    fn took(&mut self, time: Duration) -> Result<(), PeerError> {
        self.peer.took(time)
    }

    fn finish(&mut self) -> Result<(), PeerError> {
        self.peer.finish()
    }
}
