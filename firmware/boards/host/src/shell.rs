//! The loop around the node: waits for frames, passes the time, reports changes.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use firmware::control::controller::Config;
use firmware::node::Node;
use link::{Link, LinkAddress, LinkError, Stamped};
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Mode, Node as Name, ResetReason};
use protocol::table;
use terminal::say;

use crate::clock::{Clock, is_feedback};

/// Time to listen on a bus before taking part: three heartbeats.
const LISTEN: Duration = Duration::from_millis(300);
/// Longest wait for a frame: resolution of watchdogs and of Ctrl-C.
const TICK: Duration = Duration::from_millis(5);
/// Silence after which the drives are reported as gone.
const SILENCE: Duration = Duration::from_secs(1);

/// Why the controller ended.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ShellError {
    /// Another controller uses the same identifiers. One that comes later is a fault, which stops the arm.
    #[error(
        "another controller is on {bus}: {name} (identifier {id:#05x}) was heard, which only a controller sends; \
         stop one of the two"
    )]
    Duplicate {
        /// Bus.
        bus: String,
        /// Message.
        name: &'static str,
        /// Its identifier.
        id: u16,
    },
    /// The bus failed.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// Counts for the final report.
#[derive(Default)]
struct Counts {
    feedback: u64,
    late: u64,
}

pub(crate) struct Shell {
    link: Link,
    bus: LinkAddress,
    /// Why the interface of the bus is waited for, where it has gone.
    away: Option<String>,
    config: Config,
    node: Node,
    clock: Clock,
    /// Sampling period, in real time only.
    deadline: Option<Duration>,
    mode: Mode,
    /// Time of the last feedback.
    heard: Option<Instant>,
    counts: Counts,
}

impl Shell {
    pub(crate) fn new(link: Link, bus: LinkAddress, config: Config, clock: Clock) -> Self {
        let deadline =
            matches!(clock, Clock::RealTime { .. }).then(|| config.period.duration().into());
        Self {
            node: Node::new(config, ResetReason::PowerOn),
            link,
            bus,
            away: None,
            config,
            clock,
            deadline,
            mode: Mode::Boot,
            heard: None,
            counts: Counts::default(),
        }
    }

    /// Controls until `stop` is set.
    pub(crate) fn run(&mut self, stop: &AtomicBool) -> Result<(), ShellError> {
        self.listen(stop)?;
        self.poll(None);
        say!("controller: waiting for the drives on {}", self.bus);
        while !stop.load(Ordering::Relaxed) {
            self.wait()?;
            while let Some(stamped) = self.link.take() {
                self.take(&stamped);
            }
            if self.link.take_bus_off() {
                say!(
                    "controller: the interface of {} has gone bus-off; if it does not come back by itself: ip link set IFACE type can restart-ms 100",
                    self.bus
                );
                self.node.bus_off();
                self.poll(None);
            }
            if self.clock.idle() {
                self.poll(None);
            }
            self.report_silence();
        }
        say!(
            "controller: stopped in {} after {} samples, {} answered late; frames not used: {}; not sent: {}",
            self.mode,
            self.counts.feedback,
            self.counts.late,
            self.node.received(),
            self.node.unsent(),
        );
        Ok(())
    }

    /// Listens on the bus before sending anything.
    fn listen(&mut self, stop: &AtomicBool) -> Result<(), ShellError> {
        let end = Instant::now() + LISTEN;
        while !stop.load(Ordering::Relaxed) {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            self.link.wait(left.min(TICK))?;
            while let Some(stamped) = self.link.take() {
                self.refuse_duplicate(&stamped.frame)?;
            }
        }
        Ok(())
    }

    /// Goes on without the interface, and says why, once for each reason: one that is back may have to be set up first.
    fn go_without(&mut self, error: &LinkError) {
        let reason = error.to_string();
        if self.away.as_ref() != Some(&reason) {
            say!("controller: {reason}; waiting for it");
            self.away = Some(reason);
        }
    }

    /// Waits for a frame. An interface that has gone may come back: until then the node goes on without frames, and its
    /// watchdogs take the torque away.
    fn wait(&mut self) -> Result<(), ShellError> {
        if self.away.is_some() {
            thread::sleep(TICK);
            match Link::open(&self.bus) {
                Ok(link) => {
                    (self.link, self.away) = (link, None);
                    say!("controller: {} is back", self.bus);
                }
                Err(error) => self.go_without(&error),
            }
            return Ok(());
        }
        match self.link.wait(TICK) {
            Err(error) if error.may_pass() => self.go_without(&error),
            result => {
                result?;
            }
        }
        Ok(())
    }

    fn take(&mut self, stamped: &Stamped) {
        let frame = &stamped.frame;
        if self.clock.observe(frame) {
            self.poll(None);
        }
        self.poll(Some(frame));
        if self.node.reset_asked() {
            say!("controller: reset by network management");
            self.node = Node::new(self.config, ResetReason::Software);
            self.clock.restart();
            self.poll(None);
        }
        if is_feedback(frame) {
            self.answered(stamped.at);
        }
    }

    /// Polls the node with one frame or with the time alone.
    fn poll(&mut self, received: Option<&CanFrame>) {
        self.node.poll(self.clock.now(), received, &mut self.link);
        let controller = self.node.controller();
        if controller.mode() != self.mode {
            self.mode = controller.mode();
            match self.mode {
                Mode::FaultReaction | Mode::Fault | Mode::EStop => {
                    say!("controller: {}: {}", self.mode, controller.fault());
                }
                mode => say!("controller: {mode}"),
            }
        }
    }

    /// Counts a sample, and whether it was answered within its period.
    fn answered(&mut self, at: SystemTime) {
        if self.heard.is_none() {
            say!("controller: the drives are present");
        }
        self.heard = Some(Instant::now());
        self.counts.feedback += 1;
        // If the clock was set in between, the age is unknown.
        let age = at.elapsed().unwrap_or_default();
        if self.deadline.is_some_and(|period| age > period) {
            self.counts.late += 1;
            self.node.count_overrun();
        }
    }

    fn report_silence(&mut self) {
        if self.heard.is_some_and(|heard| heard.elapsed() > SILENCE) {
            self.heard = None;
            say!(
                "controller: the drives are silent; waiting for them on {}",
                self.bus
            );
        }
    }

    fn refuse_duplicate(&self, frame: &CanFrame) -> Result<(), ShellError> {
        match table::of_frame(frame) {
            // A frame that only looks like one of a controller is bad input, like any other.
            Some(info) if info.sender == Some(Name::Controller) && codec::decode(frame).is_ok() => {
                Err(ShellError::Duplicate {
                    bus: self.bus.to_string(),
                    name: info.name,
                    id: info.id,
                })
            }
            _ => Ok(()),
        }
    }
}
