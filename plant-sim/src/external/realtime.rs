//! Real time: samples at absolute deadlines, commands when they come.

use std::collections::VecDeque;
use std::time::Duration;

use firmware::control::controller::Config;
use firmware::node::Node;
use link::LinkAddress;
use link::realtime::{claim, monotonic, sleep_until};
use protocol::bus::Bus;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Node as Name};

use super::peers::{self, sender};
use super::timing::Timing;
use super::{Remote, Sent, first_difference, twin};
use sim::endpoint::{Endpoint, EndpointError};

/// Time between the end of the preparations and the first sample.
const RUN_UP: Duration = Duration::from_millis(5);
/// Commands of the twin that are kept for comparison: a command later than this is history.
const MEMORY: usize = 64;

/// A controller behind a link, in real time.
pub struct RealTime {
    remote: Remote,
    twin: Node,
    /// Commands of the twin, by sample.
    expected: VecDeque<(u32, CanFrame)>,
    period: Duration,
    /// Time of sample 0 on the machine's clock, and the number of the present sample.
    origin: Option<Duration>,
    sample: u32,
    /// Time from the last frame out to its answer in.
    latency: Duration,
    timing: Timing,
    /// Commands that were not those of the twin.
    different: u64,
}

impl RealTime {
    /// Waits for a controller on the bus, makes it start afresh, and asks the system for real-time scheduling.
    ///
    /// # Errors
    /// The bus cannot be used, another plant is on it, or no controller answers within a minute.
    pub fn connect(address: &LinkAddress, config: Config) -> Result<Self, EndpointError> {
        let remote = peers::meet(address)?;
        for refused in claim() {
            eprintln!("plant-sim: {refused}");
        }
        let period = Duration::from_nanos((f64::from(config.period) * 1e9).round() as u64);
        Ok(Self {
            remote,
            twin: twin(&config),
            expected: VecDeque::new(),
            period,
            origin: None,
            sample: 0,
            latency: Duration::ZERO,
            timing: Timing::new(period),
            different: 0,
        })
    }

    /// What was measured so far.
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    /// Commands that were not those of the twin.
    pub fn different(&self) -> u64 {
        self.different
    }

    /// Sleeps until the next sample is due.
    fn pace(&mut self) {
        let origin = match self.origin {
            Some(origin) => {
                self.sample += 1;
                origin
            }
            None => *self.origin.insert(monotonic() + RUN_UP),
        };
        let deadline = origin + self.period * self.sample;
        sleep_until(deadline);
        let now = monotonic();
        self.timing.woke(deadline, now);
        if now >= deadline + self.period {
            // Samples that were missed are not made up for in a burst: time slips, and the controller gets its share.
            self.origin = Some(now.saturating_sub(self.period * self.sample));
        }
    }

    fn deadline(&self) -> Duration {
        self.origin.unwrap_or_default() + self.period * (self.sample + 1)
    }

    /// Takes what has come; `true` when the command of the present sample is there.
    fn take(&mut self, sent: &mut Vec<CanFrame>) -> Result<bool, EndpointError> {
        let mut answered = false;
        while let Some(frame) = self.remote.link.receive() {
            match sender(&frame) {
                Some(Name::Controller) => {
                    self.remote.refuse_restart(&frame, &self.twin)?;
                    sent.push(frame);
                    if let Ok(received) = codec::decode(&frame)
                        && let Message::Command(command) = received.message
                    {
                        answered |= command.sample == self.sample;
                        self.compare(command.sample, &frame);
                    }
                }
                Some(Name::Drives | Name::Operator) => {
                    return Err(self.remote.error(format!(
                        "has a second plant: {frame} was not sent by this one"
                    )));
                }
                None => {}
            }
        }
        Ok(answered)
    }

    /// Holds a command against the twin's. Frames that got lost on the way make the two differ for good reason: the
    /// first difference is told, and the run goes on.
    fn compare(&mut self, sample: u32, frame: &CanFrame) {
        let due = self.expected.iter().find(|(due, _)| *due == sample);
        if let Some((_, due)) = due
            && due != frame
        {
            if self.different == 0 {
                eprintln!(
                    "plant-sim: sample {sample}: the command differs from that of the twin in this process: {}",
                    first_difference(Some(due), frame)
                );
            }
            self.different += 1;
        }
    }

    fn ask_twin(&mut self, now: u64, frame: &CanFrame) {
        let mut out = VecDeque::new();
        self.twin.poll(now, &mut Sent(Some(*frame), &mut out));
        for frame in out {
            if let Ok(received) = codec::decode(&frame)
                && let Message::Command(command) = received.message
            {
                self.expected.push_back((command.sample, frame));
            }
        }
        while self.expected.len() > MEMORY {
            self.expected.pop_front();
        }
    }
}

impl Endpoint for RealTime {
    fn poll(
        &mut self,
        now: u64,
        received: Option<&CanFrame>,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError> {
        self.latency = Duration::ZERO;
        let Some(frame) = received else {
            self.pace();
            self.remote.wait(Duration::ZERO)?;
            self.take(sent)?;
            return Ok(());
        };
        let out = monotonic();
        self.remote.send(frame)?;
        self.ask_twin(now, frame);
        if sender(frame) != Some(Name::Drives) {
            return Ok(());
        }
        loop {
            if self.take(sent)? {
                self.latency = monotonic().saturating_sub(out);
                self.timing.answered(self.latency);
                return Ok(());
            }
            let left = self.deadline().saturating_sub(monotonic());
            if left.is_zero() {
                self.timing.missed();
                return Ok(());
            }
            self.remote.wait(left)?;
        }
    }

    fn node(&self) -> &Node {
        &self.twin
    }

    fn latency_ns(&self) -> u64 {
        self.latency.as_nanos() as u64
    }
}
