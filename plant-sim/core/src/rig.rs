//! Lock-step: plant, drives, bus, controller and operator on one time line.
//!
//! The only place that knows both controller and plant. Time is an integer number of nanoseconds
//! and moves from event to event: a sample, the end of a frame on the bus, the end of a node's
//! computing time. A command therefore acts as late as it would on the wire, and the same inputs
//! give the same bytes on every machine.

use std::collections::VecDeque;

use firmware::control::controller::Config;
use firmware::mechanics::arm::ArmModel;
use firmware::node::Node;
use protocol::frame::{CanFrame, FD_MAX, StandardId};
use protocol::messages::Mode;
use protocol::schema::{MessageInfo, Rate};
use protocol::table;
use protocol::wire::{BitTiming, FrameBits};

use crate::bus::{BuiltinBus, Delivery, NodeId, Overload, Statistics, Traffic};
use crate::drives::Drives;
use crate::endpoint::{COMPUTE_NS, Endpoint, EndpointError};
use crate::model::RobotModel;
use crate::operator::{Hand, Operator, OperatorError};
use crate::plant::Plant;

/// Transmit mailboxes of a node: as many as an FDCAN or M_CAN has and more than it needs.
const MAILBOXES: usize = 32;

/// One sample as it truly was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Time of the sample, s.
    pub t: f64,
    /// Joint positions of the plant.
    pub q: [f64; 4],
    /// Joint speeds of the plant.
    pub qd: [f64; 4],
    /// Reference of the controller for this sample: positions.
    pub rq: [f64; 4],
    /// Reference: speeds.
    pub rqd: [f64; 4],
    /// Efforts at the joints when the sample was taken.
    pub tau: [f64; 4],
    /// Flange: x, y, z, yaw.
    pub tool: [f64; 4],
    /// Whether a motor was at its limit.
    pub saturated: bool,
    /// State of the controller.
    pub mode: Mode,
}

/// What is shown of a run as it goes. An observer looks at what it cares for; a pair of observers is one.
pub trait Observer {
    /// A frame was delivered at `time` ns.
    ///
    /// # Errors
    /// Output failed; the run ends.
    fn frame(&mut self, time: u64, frame: &CanFrame) -> std::io::Result<()> {
        let _ = (time, frame);
        Ok(())
    }

    /// A sample has been answered.
    ///
    /// # Errors
    /// Output failed; the run ends.
    fn sample(&mut self, truth: &Truth) -> std::io::Result<()> {
        let _ = truth;
        Ok(())
    }

    /// A cycle begins or ends.
    fn hand(&mut self, hand: &Hand) {
        let _ = hand;
    }
}

impl Observer for () {}

impl<O: Observer> Observer for &mut O {
    fn frame(&mut self, time: u64, frame: &CanFrame) -> std::io::Result<()> {
        (**self).frame(time, frame)
    }

    fn sample(&mut self, truth: &Truth) -> std::io::Result<()> {
        (**self).sample(truth)
    }

    fn hand(&mut self, hand: &Hand) {
        (**self).hand(hand);
    }
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    fn frame(&mut self, time: u64, frame: &CanFrame) -> std::io::Result<()> {
        self.0.frame(time, frame)?;
        self.1.frame(time, frame)
    }

    fn sample(&mut self, truth: &Truth) -> std::io::Result<()> {
        self.0.sample(truth)?;
        self.1.sample(truth)
    }

    fn hand(&mut self, hand: &Hand) {
        self.0.hand(hand);
        self.1.hand(hand);
    }
}

/// Why a run ended before its scenario.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The operator could not go on.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// Output failed.
    #[error("cannot write results: {0}")]
    Output(#[from] std::io::Error),
    /// The controller stopped answering.
    #[error("the controller is late: no command for {0} samples")]
    Silent(u64),
    /// The controller's process or board failed.
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
}

/// What a rig is made of.
#[derive(Clone, Debug)]
pub struct RigConfig {
    /// The robot as it is.
    pub actual: RobotModel,
    /// The robot as the controller knows it.
    pub nominal: ArmModel,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// Joint positions at the start.
    pub start: [f64; 4],
    /// Bits on the bus.
    pub timing: BitTiming,
}

/// Plant, drives, bus and controller of one run.
pub struct Rig<E> {
    plant: Plant,
    drives: Drives,
    bus: BuiltinBus,
    drives_at: NodeId,
    controller_at: NodeId,
    operator_at: NodeId,
    controller: E,
    /// What the controller has just sent.
    sent: Vec<CanFrame>,
    /// Frames that the controller has computed and that enter the bus at this time.
    computed: VecDeque<(u64, CanFrame)>,
    period: u64,
    sample: u64,
    dropped: u64,
}

impl<E: Endpoint> Rig<E> {
    /// A rig at rest at time 0.
    pub fn new(config: &RigConfig, controller: E) -> Self {
        let period = (1e9 / config.rate_hz).round() as u64;
        let seconds = period as f64 * 1e-9;
        let mut bus = BuiltinBus::new(config.timing);
        Self {
            plant: Plant::new(&config.actual, config.start),
            drives: Drives::new(&config.actual, seconds),
            drives_at: bus.attach(MAILBOXES),
            controller_at: bus.attach(MAILBOXES),
            operator_at: bus.attach(MAILBOXES),
            bus,
            controller,
            sent: Vec::new(),
            computed: VecDeque::new(),
            period,
            sample: 0,
            dropped: 0,
        }
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        (self.sample * self.period) as f64 * 1e-9
    }

    /// What the bus has carried.
    pub fn bus(&self) -> &Statistics {
        self.bus.statistics()
    }

    /// The drive side, for its counters.
    pub fn drives(&self) -> &Drives {
        &self.drives
    }

    /// The controller, or its twin.
    pub fn node(&self) -> &Node {
        self.controller.node()
    }

    /// The controller's end of the rig.
    pub fn controller(&mut self) -> &mut E {
        &mut self.controller
    }

    /// Frames that found a full transmit queue.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Puts a frame of the operator's node onto the bus at the beginning of the next sample.
    pub fn inject(&mut self, frame: &CanFrame) {
        self.enqueue(self.operator_at, self.sample * self.period, frame);
    }

    /// Runs until the operator is done.
    ///
    /// # Errors
    /// The scenario could not be completed; see [`RunError`]. Everything up to then has been
    /// handed to `observer`.
    pub fn run<O: Observer>(
        &mut self,
        operator: &mut Operator,
        observer: &mut O,
    ) -> Result<(), RunError> {
        while !operator.is_done() {
            self.step(operator, observer)?;
        }
        Ok(())
    }

    /// One sample: from this sampling instant up to the next.
    ///
    /// # Errors
    /// See [`Rig::run`].
    pub fn step<O: Observer>(
        &mut self,
        operator: &mut Operator,
        observer: &mut O,
    ) -> Result<(), RunError> {
        let now = self.sample * self.period;
        let next = now + self.period;
        self.plant.advance_to(now);
        let feedback = self.drives.feedback(&mut self.plant);
        if self.drives.silent() > SILENT_LIMIT {
            return Err(RunError::Silent(self.drives.silent()));
        }
        let mut truth = self.truth(now);
        self.enqueue(self.drives_at, now, &feedback);
        let (frame, hand) = operator.step(now)?;
        if let Some(frame) = frame {
            self.enqueue(self.operator_at, now, &frame);
        }
        if let Some(hand) = hand {
            match hand {
                Hand::Attach(payload) => self.plant.attach(payload),
                Hand::Release => self.plant.release(),
                Hand::BeginCycle | Hand::EndCycle => {}
            }
            observer.hand(&hand);
        }
        self.poll_controller(now, None)?;
        while let Some(event) = self.next_event(next) {
            match event {
                Event::Computed(time, frame) => self.enqueue(self.controller_at, time, &frame),
                Event::Delivered(delivery) => self.deliver(&delivery, operator, observer)?,
            }
        }
        let controller = self.controller.node().controller();
        truth.rq = array(&controller.reference().q);
        truth.rqd = array(&controller.reference().qd);
        truth.mode = controller.mode();
        observer.sample(&truth)?;
        self.sample += 1;
        Ok(())
    }

    fn truth(&self, now: u64) -> Truth {
        let pose = self.plant.pose();
        Truth {
            t: now as f64 * 1e-9,
            q: self.plant.q(),
            qd: self.plant.qd(),
            rq: [0.0; 4],
            rqd: [0.0; 4],
            tau: self.plant.joint_effort(),
            tool: [pose.x, pose.y, pose.z, pose.yaw],
            saturated: self.drives.is_saturated(),
            mode: Mode::Boot,
        }
    }

    fn enqueue(&mut self, node: NodeId, time: u64, frame: &CanFrame) {
        if self.bus.enqueue(node, time, frame).is_err() {
            self.dropped += 1;
        }
    }

    /// The earliest thing to happen before `end`.
    fn next_event(&mut self, end: u64) -> Option<Event> {
        let computed = self.computed.front().map(|(time, _)| *time);
        let valid = self.bus.next_event();
        match (computed, valid) {
            // What enters the bus at the instant a frame ends may still win the next arbitration.
            (Some(time), valid) if time < end && valid.is_none_or(|valid| time <= valid) => {
                let (time, frame) = self.computed.pop_front()?;
                Some(Event::Computed(time, frame))
            }
            (_, Some(valid)) if valid <= end => self.bus.pop_delivery(valid).map(Event::Delivered),
            _ => None,
        }
    }

    fn deliver<O: Observer>(
        &mut self,
        delivery: &Delivery,
        operator: &mut Operator,
        observer: &mut O,
    ) -> Result<(), RunError> {
        observer.frame(delivery.time, &delivery.frame)?;
        if !delivery.from.contains(self.drives_at) {
            self.plant.advance_to(delivery.time);
            self.drives.receive(&delivery.frame, &mut self.plant);
        }
        if !delivery.from.contains(self.operator_at) {
            operator.receive(&delivery.frame);
        }
        if !delivery.from.contains(self.controller_at) {
            self.poll_controller(delivery.time, Some(&delivery.frame))?;
        }
        Ok(())
    }

    /// The controller looks at what has come; what it sends is ready after its computing time.
    fn poll_controller(
        &mut self,
        now: u64,
        received: Option<&CanFrame>,
    ) -> Result<(), EndpointError> {
        self.controller.poll(now / 1000, received, &mut self.sent)?;
        // What is sent later does not overtake.
        let last = self.computed.back().map_or(0, |(time, _)| *time);
        let time = last.max(now + self.controller.latency_ns());
        for frame in self.sent.drain(..) {
            self.computed.push_back((time, frame));
        }
        Ok(())
    }
}

enum Event {
    Computed(u64, CanFrame),
    Delivered(Delivery),
}

impl RigConfig {
    /// What the controller of this rig is told.
    pub fn controller(&self) -> Config {
        let period = (1e9 / self.rate_hz).round() * 1e-9;
        let mut config = Config::new(self.nominal, period as f32);
        config.command_delay = command_delay(&self.timing);
        config
    }
}

/// Samples without a command after which the controller counts as gone.
const SILENT_LIMIT: u64 = 1000;

fn array(v: &nalgebra::Vector4<f32>) -> [f64; 4] {
    [v.x, v.y, v.z, v.w].map(f64::from)
}

/// Time from a sample until its command acts, s: two frames and the computing time, on an
/// otherwise idle bus with the mean of the stuff bits.
fn command_delay(timing: &BitTiming) -> f32 {
    let frame = |info| timing.duration(FrameBits::exact(&specimen(info)));
    let feedback = frame(&table::FEEDBACK);
    let command = frame(&table::COMMAND);
    ((feedback + COMPUTE_NS + command) as f64 * 1e-9) as f32
}

/// A frame of this message, about half stuffed: alternating bits need no stuff bits, equal ones
/// the most.
fn specimen(info: &MessageInfo) -> CanFrame {
    let id = StandardId::new(info.id).unwrap_or(StandardId::MAX);
    let data = [0x0F; FD_MAX];
    let data = &data[..info.len];
    let frame = if info.is_fd() {
        CanFrame::fd(id, data, true)
    } else {
        CanFrame::classical(id, data)
    };
    frame.expect("the message table holds lengths that frames can have")
}

/// Worst-case load of the bus at a control rate.
///
/// # Errors
/// [`Overload`] with the number where it is more than a bus may carry.
pub fn admit(timing: &BitTiming, rate_hz: f64) -> Result<f64, Overload> {
    let traffic: Vec<Traffic> = table::TABLE
        .iter()
        .filter_map(|info| {
            let rate = match info.rate {
                Rate::EverySample => rate_hz,
                Rate::Hertz(hertz) => f64::from(hertz),
                Rate::Event => return None,
            };
            Some(Traffic {
                frame: specimen(info),
                rate,
            })
        })
        .collect();
    crate::bus::admit(timing, &traffic)
}
