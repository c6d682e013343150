//! A foreign node that sends what only another one may send.

use oorandom::Rand64;
use protocol::codec;
use protocol::frame::{CanFrame, FD_MAX};
use protocol::schema::MessageInfo;
use protocol::time::{Instant, Period};

use super::watch::Planned;
use super::{Disguise, What};
use crate::peer::{Outbox, Peer, PeerError};
use crate::world::World;

/// A foreign node that sends a message once a sample, counted from the beginning of its fault. Whether its frames meet those of
/// the node that it imitates, on the bus at the same instant, depends on that beginning.
#[derive(Debug)]
pub struct Impostor {
    fault: Planned,
    message: &'static MessageInfo,
    disguise: Disguise,
    period: Period,
    random: Rand64,
    /// The last frame of the message, with its counter.
    last: Option<(CanFrame, u8)>,
    /// No frame goes out before.
    next: Instant,
}

impl Impostor {
    /// A foreign node for a fault that is about one.
    pub fn new(fault: &Planned, period: Period, seed: u64) -> Option<Self> {
        let What::Foreign(message, disguise) = fault.what else {
            return None;
        };
        Some(Self {
            fault: fault.clone(),
            message,
            disguise,
            period,
            // Apart from the nodes of the run, which have the same seed.
            random: Rand64::new(u128::from(seed) << 8 | u128::from(message.id) << 80),
            last: None,
            next: Instant::ORIGIN,
        })
    }

    /// The next frame that it sends; `None` as long as there is nothing to imitate.
    fn frame(&mut self) -> Option<CanFrame> {
        match self.disguise {
            Disguise::Poor => {
                let blank = self.message.specimen();
                let data = &mut [0; FD_MAX][..blank.data().len()];
                data.fill_with(|| self.random.rand_range(0..256) as u8);
                Some(like(&blank, data))
            }
            Disguise::Perfect => {
                let (frame, counter) = self.last.as_mut()?;
                *counter = counter.wrapping_add(1);
                let data = &mut [0; FD_MAX][..frame.data().len()];
                data.copy_from_slice(frame.data());
                if let Some(profile) = self.message.protection {
                    profile.protect(self.message.id, *counter, data);
                }
                Some(like(frame, data))
            }
        }
    }
}

/// A frame of the same kind with other data of the same length.
pub(super) fn like(frame: &CanFrame, data: &[u8]) -> CanFrame {
    let other = if frame.is_fd() {
        CanFrame::fd(frame.id(), data, frame.brs())
    } else {
        CanFrame::classical(frame.id(), data)
    };
    other.unwrap_or(*frame)
}

impl Peer for Impostor {
    fn wake(&self) -> Option<Instant> {
        let (from, until) = self.fault.window();
        let next = self.next.max(from);
        (next < until).then_some(next)
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        _: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        match received {
            Some(frame) if self.message.identifies(frame) => {
                if let Ok(received) = codec::decode(frame) {
                    self.last = Some((*frame, received.counter.unwrap_or(0)));
                }
            }
            Some(_) => {}
            None => {
                self.next = now + self.period.duration();
                if let Some(frame) = self.frame() {
                    self.fault.hit();
                    out.push((now, frame));
                }
            }
        }
        Ok(())
    }
}
