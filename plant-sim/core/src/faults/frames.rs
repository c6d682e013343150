//! Faults in the frames that a node sends.

use std::collections::VecDeque;

use oorandom::Rand64;
use protocol::frame::CanFrame;
use protocol::messages::Node;
use protocol::time::Instant;

use super::{Fault, FrameFault, What, duration};
use crate::peer::{Outbox, Peer, PeerError};
use crate::world::World;

/// A node whose frames suffer the faults of a run. Without faults it is the node itself.
#[derive(Debug)]
pub struct Faulty<P> {
    peer: P,
    node: Node,
    faults: Vec<Suffered>,
    random: Rand64,
    /// What the node has sent in the current call; empty between calls.
    sent: Outbox,
}

/// A fault of one message's frames, or the silence of the node.
#[derive(Debug)]
struct Suffered {
    fault: Fault,
    /// Of a replay: the last frames of the message, as many as it goes back; the newest last.
    history: VecDeque<CanFrame>,
}

impl<P: Peer> Faulty<P> {
    /// Wraps `peer`, which is `node`, in those faults that concern its frames.
    pub fn new(peer: P, node: Node, faults: &[Fault], seed: u64) -> Self {
        let mut faulty = Self {
            peer,
            node,
            faults: Vec::new(),
            // Each node draws from its own sequence, so that the frames of one do not change the faults of another.
            random: Rand64::new(u128::from(seed) << 8 | node as u128),
            sent: Outbox::new(),
        };
        for fault in faults {
            faulty.suffer_also(fault);
        }
        faulty
    }

    /// Adds a fault, if it concerns the frames of this node.
    pub(crate) fn suffer_also(&mut self, fault: &Fault) {
        let concerns = match fault.what {
            What::Frames(info, _) => info.sender.is_none_or(|sender| sender == self.node),
            What::Silent(silent) => silent == self.node,
            _ => false,
        };
        if concerns {
            self.faults.push(Suffered {
                fault: fault.clone(),
                history: VecDeque::new(),
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

    fn is_silent(&self, now: Instant) -> bool {
        self.faults
            .iter()
            .any(|Suffered { fault, .. }| matches!(fault.what, What::Silent(_)) && fault.acts(now))
    }

    /// What becomes of a frame that the node sends at `time`.
    fn suffer(&mut self, time: Instant, frame: CanFrame, out: &mut Outbox) {
        let first = out.len();
        out.push((time, frame));
        for Suffered { fault, history } in &mut self.faults {
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
            if !fault.acts(time) {
                continue;
            }
            match kind {
                FrameFault::Loss(share) => {
                    if self.random.rand_float() < share {
                        out.truncate(first);
                    }
                }
                FrameFault::Delay(seconds) => delay(&mut out[first..], seconds),
                FrameFault::Jitter(seconds) => {
                    delay(&mut out[first..], seconds * self.random.rand_float())
                }
                FrameFault::Duplicate => out.extend_from_within(first..),
                FrameFault::Corrupt(share) => {
                    if self.random.rand_float() < share {
                        for (_, frame) in &mut out[first..] {
                            flip(frame, &mut self.random);
                        }
                    }
                }
                FrameFault::Replay(_) => {
                    if let Some(old) = old {
                        out.truncate(first);
                        out.push((time, old));
                    }
                }
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
    let flipped = if frame.is_fd() {
        CanFrame::fd(frame.id(), &data, frame.brs())
    } else {
        CanFrame::classical(frame.id(), &data)
    };
    *frame = flipped.unwrap_or(*frame);
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
        let silent = self.is_silent(now);
        if silent && received.is_some() {
            return Ok(());
        }
        let mut sent = std::mem::take(&mut self.sent);
        self.peer.poll(now, received, world, &mut sent)?;
        for (time, frame) in sent.drain(..) {
            if !silent {
                self.suffer(time, frame, out);
            }
        }
        self.sent = sent;
        Ok(())
    }

    fn finish(&mut self) -> Result<(), PeerError> {
        self.peer.finish()
    }
}
