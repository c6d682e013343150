//! The controller as a part of this process.

use firmware::cabinet::rejoin::Rejoin;
use firmware::cabinet::sample_clock::SampleClock;
use firmware::control::controller::Config;
use firmware::node::Node;
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;
use protocol::table;
use protocol::time::{Duration, Instant};

use crate::peer::{Outbox, Peer, PeerError};
use crate::world::Mind;
use crate::world::World;

/// Time of a controller from frame in to frames out: 4000 instructions, the budget of a call, at 100 MHz.
pub const COMPUTE: Duration = Duration::from_micros(40);

/// Samples without feedback after which the controller is called without a frame, to run its watchdogs.
const GUARD_SAMPLES: u32 = 2;

/// The controller as a part of this process.
///
/// It counts time in samples like every controller in lock-step ([`SampleClock`]): the same frames then lead to the
/// same answers, in this process, in another and on a board. Without feedback, its time follows the caller's.
#[derive(Clone, Debug)]
pub struct InProcess {
    config: Config,
    node: Node,
    clock: SampleClock,
    rejoin: Rejoin,
    /// Time of the last new feedback, or of the last call without one.
    last: Option<Instant>,
    /// Frames sent in the current call; empty between calls.
    sent: Vec<CanFrame>,
    /// Number of the sample that the last command answers.
    answered: Option<u32>,
}

impl InProcess {
    /// A controller just reset by network management: every run begins like this, wherever the controller is.
    pub fn new(config: Config) -> Self {
        Self::started(config, ResetReason::Software)
    }

    fn started(config: Config, reason: ResetReason) -> Self {
        Self {
            config,
            node: Node::new(config, reason),
            clock: SampleClock::new(config.period),
            rejoin: Rejoin::default(),
            last: None,
            sent: Vec::new(),
            answered: None,
        }
    }

    /// Restarts the controller for this reason.
    pub fn restart(&mut self, reason: ResetReason) {
        *self = Self::started(self.config, reason);
    }

    /// The node.
    pub fn node(&self) -> &Node {
        &self.node
    }

    /// Its intention.
    pub fn mind(&self) -> Mind {
        Mind::of(&self.node, self.answered)
    }

    /// Present time of the node.
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Whether it has not been called since its start.
    pub fn is_new(&self) -> bool {
        self.last.is_none()
    }

    /// When to call it without a frame, on the caller's time line.
    pub fn due(&self) -> Instant {
        match self.last {
            None => Instant::ORIGIN,
            Some(last) => last + self.config.period.duration() * GUARD_SAMPLES,
        }
    }

    /// Tells the node that its CAN controller has gone bus-off; returns how long that is then left alone.
    pub fn bus_off(&mut self, now: Instant) -> Duration {
        self.node.bus_off();
        self.rejoin.after_bus_off(now)
    }

    /// Tells the node how long its answer to the last call has taken: the next sample was due meanwhile, or not.
    pub fn took(&mut self, time: Duration) {
        if time > self.config.period.duration() {
            self.node.count_overrun();
        }
    }

    /// Calls the node at the caller's time `now`; appends the frames that it sends. A node that has to reset is
    /// replaced by a new one.
    pub fn call(&mut self, now: Instant, received: Option<&CanFrame>, sent: &mut Vec<CanFrame>) {
        // Never full: the caller takes everything at once.
        let answered = &mut self.answered;
        let mut send = |frame: &CanFrame| {
            // A command begins with the number of its sample, and no own one needs to be checked.
            if table::COMMAND.identifies(frame)
                && let Some(sample) = frame.data().first_chunk()
            {
                *answered = Some(u32::from_le_bytes(*sample));
            }
            sent.push(*frame);
            Ok(())
        };
        match received {
            None => {
                let last = self.last.replace(now);
                self.clock.elapse(now.since(last.unwrap_or(now)));
            }
            Some(frame) => {
                let advances = self.clock.observe(frame);
                // What cannot be read or is old is no reason to let its time stand still.
                if advances {
                    self.last = Some(now);
                    self.node.poll(self.clock.now(), None, &mut send);
                }
            }
        }
        self.node.poll(self.clock.now(), received, &mut send);
        if self.node.reset_asked() {
            self.restart(ResetReason::Software);
        }
    }
}

impl Peer for InProcess {
    fn wake(&self) -> Option<Instant> {
        Some(self.due())
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let mut sent = std::mem::take(&mut self.sent);
        self.call(now, received, &mut sent);
        out.extend(sent.drain(..).map(|frame| (now + COMPUTE, frame)));
        self.sent = sent;
        world.mind = self.mind();
        Ok(())
    }

    fn bus_off(&mut self, now: Instant) -> Result<Duration, PeerError> {
        Ok(Self::bus_off(self, now))
    }

    fn took(&mut self, time: Duration) -> Result<(), PeerError> {
        Self::took(self, time);
        Ok(())
    }
}
