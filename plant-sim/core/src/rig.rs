//! Lock-step: peers, their bus and the robot on one time line.
//!
//! Time advances from event to event: a peer wakes, a frame enters a transmit buffer, a frame on the bus ends. A
//! command therefore acts as late as it would on the wire, and the same inputs give the same bytes.

mod errors;
mod schedule;
mod timing;

use std::collections::VecDeque;
use std::io;

use firmware::control::controller::Config;
use firmware::mechanics::arm::ArmModel;
use protocol::frame::CanFrame;
use protocol::messages::Node;
use protocol::time::{Duration, Instant, Period};
use protocol::wire::BitTiming;

use crate::bus::{BuiltinBus, Delivery, NodeId, Statistics};
use crate::clock::Clock;
use crate::model::RobotModel;
use crate::observer::{Observer, Pace, PlantState, Truth};
use crate::peer::{Outbox, Peer, PeerError};
use crate::plant::Plant;
use crate::world::Mind;
use crate::world::OperatorError;
use crate::world::World;
use schedule::Schedule;

pub(crate) use timing::command_delay;
pub use timing::{admit, slowest_answer};

/// Transmit mailboxes of a node: as many as an FDCAN or M_CAN has and more than it needs.
const MAILBOXES: usize = 32;

/// Longest time that a run continues after its operator has given up, for the arm to come to rest.
pub const STANDSTILL_LIMIT: Duration = Duration::from_secs(5);
/// Time for which the arm has to stay at rest.
const REST: Duration = Duration::from_millis(20);
/// Joint speed below which an axis counts as at rest, rad/s and m/s.
const STANDING: f64 = 1e-3;

/// Why a run ended before its scenario.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The operator could not go on.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// Output failed.
    #[error("cannot write results: {0}")]
    Output(#[from] io::Error),
    /// The pace ended the run.
    #[error("{0}")]
    Pace(io::Error),
    /// A process or a board failed.
    #[error(transparent)]
    Peer(#[from] PeerError),
}

/// Configuration of a rig.
#[derive(Clone, Debug)]
pub struct RigConfig {
    /// The robot as it is.
    pub actual: RobotModel,
    /// The robot as the controller knows it.
    pub nominal: ArmModel,
    /// Time between two samples.
    pub period: Period,
    /// Joint positions at the start, rad and m.
    pub start: [f64; 4],
    /// Bit timing of the bus.
    pub timing: BitTiming,
}

/// The robot, the bus, and the peers of one run.
pub struct Rig<'p> {
    world: World,
    bus: BuiltinBus,
    seats: Vec<Seat<'p>>,
    /// Node that sends injected frames, and of peers that are not on the bus.
    outside: NodeId,
    /// Nodes by name.
    names: Vec<(Node, NodeId)>,
    faults: Schedule,
    /// Frames that will enter the transmit buffer of their node later, by time.
    pending: VecDeque<(Instant, NodeId, CanFrame)>,
    /// Frames sent in the current call; empty between calls.
    out: Outbox,
    period: Period,
    sample: u64,
    /// Time of the last event.
    last: Instant,
    dropped: u64,
}

/// A peer and its CAN controller.
struct Seat<'p> {
    peer: Box<dyn Peer + 'p>,
    node: NodeId,
}

/// What happens next.
enum Event {
    /// The oldest pending frame enters its transmit buffer.
    Enqueue(NodeId, Instant, CanFrame),
    /// A frame is received, unless it is lost before that.
    Delivery(Option<Delivery>),
    /// This peer wakes.
    Wake(usize, Instant),
}

impl<'p> Rig<'p> {
    /// A robot at rest at the origin of time, and a bus without peers.
    pub fn new(config: &RigConfig) -> Self {
        let mut bus = BuiltinBus::new(config.timing);
        Self {
            world: World {
                plant: Plant::new(&config.actual, config.start),
                mind: Mind::BLANK,
                sample: None,
                clock: Clock::default(),
                cell_events: Vec::new(),
                outcome: None,
            },
            outside: bus.attach_listener(MAILBOXES),
            names: Vec::new(),
            faults: Schedule::default(),
            bus,
            seats: Vec::new(),
            pending: VecDeque::new(),
            out: Outbox::new(),
            period: config.period,
            sample: 0,
            last: Instant::ORIGIN,
            dropped: 0,
        }
    }

    /// A rig in the same state, without peers and faults: peers that are attached under the names of this one's take their places.
    pub(crate) fn fork<'q>(&self) -> Rig<'q> {
        Rig {
            world: self.world.clone(),
            bus: self.bus.clone(),
            seats: Vec::new(),
            names: self.names.clone(),
            faults: Schedule::default(),
            pending: self.pending.clone(),
            out: Outbox::new(),
            ..*self
        }
    }

    /// Adds a peer to the bus. Peers that wake at the same instant do so in the order in which they were
    /// added.
    pub fn attach(&mut self, peer: impl Peer + 'p) {
        let node = self.bus.attach(MAILBOXES);
        self.seat(peer, node);
    }

    /// Adds a peer to the bus under this name, for faults and error frames.
    pub fn attach_as(&mut self, name: Node, peer: impl Peer + 'p) {
        let node = self.named(name).unwrap_or_else(|| {
            let node = self.bus.attach(MAILBOXES);
            self.names.push((name, node));
            node
        });
        self.seat(peer, node);
    }

    /// Adds a peer that is no node of the bus: it only wakes.
    pub fn attach_aside(&mut self, peer: impl Peer + 'p) {
        self.seat(peer, self.outside);
    }

    fn seat(&mut self, peer: impl Peer + 'p, node: NodeId) {
        self.seats.push(Seat {
            peer: Box::new(peer),
            node,
        });
    }

    /// Time of the next sample.
    pub fn now(&self) -> Instant {
        self.period.sample(self.sample)
    }

    /// Statistics of the bus.
    pub fn bus(&self) -> &Statistics {
        self.bus.statistics()
    }

    /// The robot.
    pub fn plant(&self) -> &Plant {
        &self.world.plant
    }

    /// Outcome of the operator's scenario, once it has ended.
    pub fn outcome(&self) -> Option<&Result<(), OperatorError>> {
        self.world.outcome.as_ref()
    }

    /// Frames dropped because of a full transmit queue.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Whether the arm is at rest and its brake closed.
    pub fn is_at_rest(&self) -> bool {
        let plant = &self.world.plant;
        plant.brake().is_closed() && plant.qd().iter().all(|qd| qd.abs() < STANDING)
    }

    /// Puts a frame from outside onto the bus at the beginning of the next sample.
    pub fn inject(&mut self, frame: &CanFrame) {
        self.enqueue(self.outside, self.now(), frame);
    }

    /// Runs until the operator is done, or has given up and the arm is at rest with its brake closed, for which it
    /// waits no longer than [`STANDSTILL_LIMIT`].
    ///
    /// # Errors
    /// The scenario could not be completed; see [`RunError`]. Everything up to then has been
    /// passed to `observer`.
    pub fn run<O: Observer, P: Pace>(
        &mut self,
        pace: &mut P,
        observer: &mut O,
    ) -> Result<(), RunError> {
        let outcome = loop {
            if let Some(outcome) = self.world.outcome.clone() {
                break outcome;
            }
            self.step(pace, observer)?;
        };
        if outcome.is_err() {
            let limit = self.now() + STANDSTILL_LIMIT;
            let mut resting = Duration::ZERO;
            while resting < REST && self.now() < limit {
                self.step(pace, observer)?;
                resting = if self.is_at_rest() {
                    resting + self.period.duration()
                } else {
                    Duration::ZERO
                };
            }
        }
        for seat in &mut self.seats {
            seat.peer.finish()?;
        }
        outcome.map_err(RunError::from)
    }

    /// One sample: from this sampling instant to the next.
    ///
    /// # Errors
    /// See [`Rig::run`].
    pub fn step<O: Observer, P: Pace>(
        &mut self,
        pace: &mut P,
        observer: &mut O,
    ) -> Result<(), RunError> {
        let now = self.now();
        pace.sample(now).map_err(RunError::Pace)?;
        self.world.plant.advance_to(now.nanos());
        let plant = PlantState::of(&self.world.plant, now);
        self.watch(now, observer);
        self.world.sample = None;
        self.sample += 1;
        while let Some(event) = self.next_event(self.now()) {
            match event {
                Event::Enqueue(node, time, frame) => self.enqueue(node, time, &frame),
                Event::Delivery(delivery) => {
                    self.tell(observer)?;
                    if let Some(delivery) = delivery {
                        self.deliver(&delivery, observer)?;
                    }
                }
                Event::Wake(seat, time) => self.call(seat, time, None, observer)?,
            }
        }
        let World {
            mut mind, sample, ..
        } = self.world;
        mind.sample = mind.sample.filter(|answered| sample == Some(*answered));
        observer.sample(&Truth { plant, mind })?;
        Ok(())
    }

    fn enqueue(&mut self, node: NodeId, time: Instant, frame: &CanFrame) {
        if self.bus.enqueue(node, time, frame).is_err() {
            self.dropped += 1;
        }
    }

    /// The earliest event before `end`. A frame received at that very instant belongs to the ending sample.
    fn next_event(&mut self, end: Instant) -> Option<Event> {
        let pending = self.pending.front().map_or(Instant::MAX, |next| next.0);
        let valid = self.bus.next_event().unwrap_or(Instant::MAX);
        let (wake, seat) = self
            .seats
            .iter()
            .enumerate()
            // A restarted peer may wake at a time that has passed.
            .filter_map(|(index, seat)| Some((seat.peer.wake()?.max(self.last), index)))
            .min()
            .unwrap_or((Instant::MAX, 0));
        // Frames queued at the instant another one ends may still win the next arbitration.
        if pending < end && pending <= valid && pending <= wake {
            let (time, node, frame) = self.pending.pop_front()?;
            self.last = time;
            Some(Event::Enqueue(node, time, frame))
        } else if valid <= end && valid <= wake {
            self.last = valid;
            Some(Event::Delivery(self.bus.pop_delivery(valid)))
        } else if wake < end {
            self.last = wake;
            Some(Event::Wake(seat, wake))
        } else {
            None
        }
    }

    fn deliver<O: Observer>(
        &mut self,
        delivery: &Delivery,
        observer: &mut O,
    ) -> Result<(), RunError> {
        if self.is_foreign(delivery) {
            observer.foreign_frame(delivery.time, &delivery.frame)?;
        } else {
            observer.frame(delivery.time, &delivery.frame)?;
        }
        self.faults.hear(&delivery.frame);
        for seat in 0..self.seats.len() {
            if delivery.to.contains(self.seats[seat].node) {
                self.call(seat, delivery.time, Some(&delivery.frame), observer)?;
            }
        }
        Ok(())
    }

    fn call<O: Observer>(
        &mut self,
        seat: usize,
        now: Instant,
        received: Option<&CanFrame>,
        observer: &mut O,
    ) -> Result<(), PeerError> {
        let Seat { peer, node } = &mut self.seats[seat];
        peer.poll(now, received, &mut self.world, &mut self.out)?;
        debug_assert!(received.is_some() || peer.wake().is_none_or(|wake| wake > now));
        for (time, frame) in self.out.drain(..) {
            let place = self.pending.partition_point(|(other, ..)| *other <= time);
            self.pending.insert(place, (time.max(now), *node, frame));
        }
        for event in self.world.cell_events.drain(..) {
            self.faults.notice(&event);
            observer.cell_event(&event);
        }
        Ok(())
    }
}

impl RigConfig {
    /// Configuration of this rig's controller.
    pub fn controller(&self) -> Config {
        let mut config = Config::new(self.nominal, self.period);
        config.setup.command_delay = command_delay(&self.timing).seconds() as f32;
        config
    }
}

#[cfg(test)]
mod tests {
    use firmware::mechanics::arm::IRB_930;

    use super::*;

    /// A controller that is not configured for its bus assumes the default timing.
    #[test]
    fn the_controllers_own_delay_is_that_of_the_default_bus() {
        let delay = command_delay(&BitTiming::default());
        let config = Config::new(IRB_930, Period::of_rate(1000.0));
        assert_eq!(
            config.setup.command_delay,
            delay.seconds() as f32,
            "{delay:?}"
        );
    }
}
