//! Real time: samples at absolute deadlines, commands when they arrive.

use std::collections::VecDeque;
use std::time::Duration;

use firmware::control::controller::Config;
use link::LinkAddress;
use link::realtime::{claim, monotonic};
use protocol::bus::Bus;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Node as Name};
use protocol::time::{self, Instant, Period};
use sim::peer::{Outbox, Peer, PeerError};
use sim::world::World;
use trace::difference::Difference;

use super::peers::{self, sender};
use super::{Remote, WallClock};
use crate::say;
use crate::twin::Twin;

/// Commands of the twin that are kept for comparison; later commands are not compared.
const MEMORY: usize = 64;

/// A controller behind a link, in real time.
pub struct RealTime {
    remote: Remote,
    twin: Twin,
    /// Commands of the twin, by sample.
    expected: VecDeque<(u32, CanFrame)>,
    period: Period,
    clock: WallClock,
    /// Time of the run's next sample.
    next: Instant,
    /// Time at which the last frame entered the bus.
    last: Instant,
    /// Frames received; empty between calls.
    sent: Vec<CanFrame>,
    /// Commands that were not those of the twin.
    different: u64,
}

impl RealTime {
    /// Waits for a controller on the bus, resets it, and requests real-time scheduling. The run has to use `clock` as
    /// its pace.
    ///
    /// # Errors
    /// The bus cannot be used, another plant is on it, or no controller answers within a minute.
    pub fn connect(
        address: &LinkAddress,
        config: Config,
        clock: &WallClock,
    ) -> Result<Self, PeerError> {
        let remote = peers::meet(address)?;
        for refused in claim() {
            say!("plant-sim: {refused}");
        }
        Ok(Self {
            remote,
            twin: Twin::new(config),
            expected: VecDeque::new(),
            period: config.period,
            clock: clock.clone(),
            next: Instant::ORIGIN,
            last: Instant::ORIGIN,
            sent: Vec::new(),
            different: 0,
        })
    }

    /// Commands that were not those of the twin.
    pub fn different(&self) -> u64 {
        self.different
    }

    /// Takes the frames that have arrived; `true` once the command of the current sample is there.
    fn take(&mut self, now: Instant) -> Result<bool, PeerError> {
        let mut answered = false;
        while let Some(frame) = self.remote.link.receive() {
            match sender(&frame) {
                Some(Name::Controller) => {
                    self.remote.refuse_restart(&frame, self.twin.node())?;
                    self.sent.push(frame);
                    if let Some(sample) = sample_of(&frame) {
                        answered |= sample == self.clock.sample();
                        self.compare(sample, &frame);
                    }
                }
                Some(Name::Drives | Name::Operator) => {
                    return Err(self.remote.second_plant(&frame));
                }
                // The controller has heard it, too.
                None => self.ask_twin(now, Some(&frame)),
            }
        }
        if self.remote.link.take_bus_off() {
            self.twin.bus_off(now);
        }
        Ok(answered)
    }

    /// Compares a command with the twin's. Frames lost on the way are a legitimate cause of differences: the first one
    /// is reported, and the run continues.
    fn compare(&mut self, sample: u32, frame: &CanFrame) {
        let due = self.expected.iter().find(|(due, _)| *due == sample);
        if let Some((_, due)) = due
            && let Some(difference) = Difference::between(Some(due), Some(frame))
        {
            if self.different == 0 {
                say!(
                    "plant-sim: a command differs from that of the twin in this process: {difference}"
                );
            }
            self.different += 1;
        }
    }

    fn ask_twin(&mut self, now: Instant, received: Option<&CanFrame>) {
        self.twin.call(now, received);
        let commands = self.twin.due().drain(..);
        self.expected
            .extend(commands.filter_map(|frame| Some((sample_of(&frame)?, frame))));
        while self.expected.len() > MEMORY {
            self.expected.pop_front();
        }
    }

    /// Sends a frame; for feedback, waits for the answer or the next sample. Returns how long the answer took in the time of the run.
    fn exchange(&mut self, now: Instant, frame: &CanFrame) -> Result<time::Duration, PeerError> {
        let out = monotonic();
        self.remote.send(frame);
        self.ask_twin(now, Some(frame));
        if sender(frame) != Some(Name::Drives) {
            return Ok(time::Duration::ZERO);
        }
        loop {
            if self.take(now)? {
                let latency = monotonic().saturating_sub(out);
                return Ok(self.clock.answered(latency));
            }
            let left = self.clock.deadline().saturating_sub(monotonic());
            if left.is_zero() || self.remote.lost.is_some() {
                self.clock.missed();
                return Ok(time::Duration::ZERO);
            }
            self.remote.wait(left);
        }
    }
}

impl Peer for RealTime {
    fn wake(&self) -> Option<Instant> {
        Some(self.next)
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let latency = match received {
            Some(frame) => self.exchange(now, frame)?,
            None => {
                if self.twin.controller().is_new() {
                    self.ask_twin(now, None);
                }
                self.next = now + self.period.duration();
                self.remote.wait(Duration::ZERO);
                self.take(now)?;
                time::Duration::ZERO
            }
        };
        // Later frames must not overtake earlier ones.
        self.last = self.last.max(now + latency);
        out.extend(self.sent.drain(..).map(|frame| (self.last, frame)));
        world.mind = self.twin.controller().mind();
        Ok(())
    }
}

/// The sample that a command answers; `None` for other frames.
fn sample_of(frame: &CanFrame) -> Option<u32> {
    match codec::decode(frame).map(|received| received.message) {
        Ok(Message::Command(command)) => Some(command.sample),
        _ => None,
    }
}
