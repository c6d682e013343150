//! A node on a simulated bus.

use std::collections::VecDeque;

use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use firmware::mechanics::dynamics::drive::Drive;
use firmware::node::{Node, PEER_TIMEOUT};
use firmware::trajectory::Reference;
use nalgebra::Vector4;
use protocol::bus::{Transmit, TransmitError};
use protocol::codec::{decode, encode};
use protocol::frame::{CanFrame, StandardId};
use protocol::messages::{
    Cause, Command, Compensation, ControlWord, DriveStatus, EStop, EStopReason, Feedback,
    Heartbeat, Hello, Message, Mode, Motion, MotionRequest, Node as Name, Outcome,
    ParameterRequest, RefusalReason, ResetReason, Server,
};
use protocol::table;
use protocol::time::{Duration, Instant, Period};

pub(crate) const PERIOD: Period = Period::of_rate(1000.0);
/// Longer than any watchdog of the drives.
pub(crate) const SILENCE: Duration = Duration::from_nanos(PEER_TIMEOUT.nanos() + 1_000);

#[derive(Clone, Default)]
pub(crate) struct Wire {
    pub to_node: VecDeque<CanFrame>,
    pub from_node: Vec<CanFrame>,
    pub full: bool,
}

impl Transmit for Wire {
    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        if self.full {
            return Err(TransmitError::QueueFull);
        }
        self.from_node.push(*frame);
        Ok(())
    }
}

/// A node and an arm that stays still whatever the command, unless it `follows`: then it is at the node's reference, or `off` it.
#[derive(Clone)]
pub(crate) struct Bench {
    pub node: Node,
    pub wire: Wire,
    pub now: Instant,
    pub sample: u32,
    pub feedback_counter: u8,
    pub motion_counter: u8,
    pub sequence: u8,
    pub position: [i32; 4],
    pub velocity: [f32; 4],
    /// Thousandths of the rated torques.
    pub torque: [i16; 4],
    /// What the drives report besides whether torque is on and the brake open.
    pub status: DriveStatus,
    /// Whether the drives do what the control word says.
    pub obeys: bool,
    /// Whether the encoders are between two counts, and show now this one and now that: no reading stands for ever.
    pub flickers: bool,
    /// Whether the brake opens when it is told to; at once.
    pub opens: bool,
    pub follows: bool,
    pub off: Vector4<f32>,
    period: Duration,
    drive: Drive,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with(Config::new(IRB_930, PERIOD))
    }

    pub(crate) fn with(config: Config) -> Self {
        let mut bench = Self {
            node: Node::new(config, ResetReason::Watchdog),
            wire: Wire::default(),
            now: Instant::ORIGIN,
            sample: 0,
            feedback_counter: 0,
            motion_counter: 0,
            sequence: 0,
            position: [0; 4],
            velocity: [0.0; 4],
            torque: [0; 4],
            status: DriveStatus::READY | DriveStatus::ENCODER_VALID,
            obeys: true,
            flickers: true,
            opens: true,
            follows: false,
            off: Vector4::zeros(),
            period: config.period.duration(),
            drive: Drive::new(&IRB_930.drive),
        };
        bench.put(&Vector4::new(0.2, 1.5, 0.15, 0.3));
        bench
    }

    /// Puts the arm at this joint position.
    pub(crate) fn put(&mut self, q: &Vector4<f32>) {
        let angle = self.drive.motor_angle(q);
        self.position = self.drive.counts_of_motor_angle(&angle);
    }

    /// Moves the elbow away from where it is; by more than 27 mrad at once is more than it can.
    pub(crate) fn shove(&mut self, by: f64) {
        self.position[1] += (by * 50.0 / std::f64::consts::TAU * 131_072.0) as i32;
    }

    /// Moves the lift 9 mm away, below the limit of the following error and more than its motor can correct with its greatest torque, of which it
    /// has most; 25 mm per turn.
    pub(crate) fn strain(&mut self) {
        self.position[2] += (0.009 / 0.025 * 131_072.0) as i32;
        self.torque[2] = -2400;
    }

    /// Moves the elbow 75 mrad away, as fast as it can, and is in the first sample beyond its following error; then another 25 mrad.
    pub(crate) fn shove_away(&mut self) {
        for by in [0.025, 0.024, 0.026] {
            self.shove(by);
            self.step();
        }
        self.shove(0.025);
    }

    /// A bench with torque on.
    pub(crate) fn enabled() -> Self {
        let mut bench = Self::new();
        bench.enable();
        assert_eq!(bench.mode(), Mode::Enabled);
        bench
    }

    /// A bench with a request to switch on on its way, and that request.
    pub(crate) fn asked_to_enable() -> (Self, CanFrame) {
        let mut bench = Self::new();
        bench.hello(table::HASH);
        bench.run(2);
        bench.request(MotionRequest::Stop);
        let enable = bench.motion(MotionRequest::Enable);
        bench.wire.to_node.push_back(enable);
        (bench, enable)
    }

    pub(crate) fn enable(&mut self) {
        self.hello(table::HASH);
        self.run(2);
        assert_eq!(self.request(MotionRequest::Stop), Some(Outcome::Accepted));
        assert_eq!(self.request(MotionRequest::Enable), Some(Outcome::Accepted));
        self.run(100);
    }

    /// A bench in the middle of a fast move.
    pub(crate) fn moving() -> Self {
        Self::moving_with(by_itself())
    }

    pub(crate) fn moving_with(config: Config) -> Self {
        let mut bench = Self::with(config);
        bench.enable();
        bench.follows = true;
        let target = [-1.0, 0.5, 0.05, -2.0];
        let frame = bench.motion(MotionRequest::MoveJoint {
            target,
            speed: 1.0,
            zone: 0.0,
        });
        bench.wire.to_node.push_back(frame);
        let fast = |bench: &Self| bench.node.controller().reference().qd.x < -3.0;
        for _ in 0..500 {
            if fast(&bench) {
                break;
            }
            bench.step();
        }
        assert!(fast(&bench) && bench.mode() == Mode::Moving);
        bench
    }

    pub(crate) fn mode(&self) -> Mode {
        self.node.controller().mode()
    }

    pub(crate) fn next_feedback(&mut self) -> CanFrame {
        if self.follows {
            // Where the reference will be at this sample, by its last velocity and acceleration.
            let Reference { q, qd, qdd } = *self.node.controller().reference();
            let period = self.period.seconds() as f32;
            let mean = qd + qdd * (0.5 * period);
            self.put(&(q + mean * period + self.off));
            self.velocity = self.drive.motor_angle(&mean).into();
        }
        let word = self.node.controller().control_word();
        let is_on = self.obeys && word.contains(ControlWord::TORQUE_ENABLE);
        let status = if self.opens && word.contains(ControlWord::BRAKE_RELEASE) {
            self.status | DriveStatus::BRAKE_RELEASED
        } else {
            self.status
        };
        let other = i32::from(self.flickers && self.sample / 10 % 2 == 1);
        let feedback = Feedback {
            sample: self.sample,
            status: status.with(DriveStatus::TORQUE_ON, is_on),
            position: self.position.map(|count| count + other),
            velocity: self.velocity,
            torque: self.torque,
        };
        let frame = encode(&Message::Feedback(feedback), self.feedback_counter).unwrap();
        self.sample += 1;
        self.feedback_counter = self.feedback_counter.wrapping_add(1);
        frame
    }

    /// Hands the pending frames to the node one by one, or only the time if there are none.
    pub(crate) fn poll(&mut self) -> Vec<Message> {
        let mut received = self.wire.to_node.pop_front();
        loop {
            self.node.poll(self.now, received.as_ref(), &mut self.wire);
            received = self.wire.to_node.pop_front();
            if received.is_none() {
                break;
            }
        }
        let sent = self.wire.from_node.drain(..);
        let sent = sent.map(|frame| decode(&frame).expect("a node sends valid frames").message);
        sent.inspect(|message| {
            if let Message::Command(Command {
                control, torque, ..
            }) = message
                && !control.contains(ControlWord::TORQUE_ENABLE)
            {
                assert_eq!(
                    *torque, [0.0; 4],
                    "whatever is not enabled is not asked for"
                );
            }
        })
        .collect()
    }

    /// One sample with the pending frames; returns what the node sent.
    pub(crate) fn step(&mut self) -> Vec<Message> {
        self.now += self.period;
        let frame = self.next_feedback();
        self.wire.to_node.push_back(frame);
        self.poll()
    }

    pub(crate) fn run(&mut self, samples: usize) -> Vec<Message> {
        (0..samples).flat_map(|_| self.step()).collect()
    }

    pub(crate) fn command(&mut self) -> Command {
        let sent = self.step();
        let commands: Vec<_> = sent
            .iter()
            .filter_map(|message| match message {
                Message::Command(command) => Some(*command),
                _ => None,
            })
            .collect();
        assert_eq!(commands.len(), 1, "one command per feedback: {sent:?}");
        assert_eq!(commands[0].sample, self.sample - 1, "the sample is echoed");
        commands[0]
    }

    /// A sample that is lost on the way.
    pub(crate) fn lose(&mut self) {
        self.next_feedback();
        self.now += self.period;
    }

    /// Frames of a node that floods the bus.
    pub(crate) fn babble(&mut self, frames: usize) {
        let id = StandardId::new(0).expect("11 bits");
        let frame = CanFrame::classical(id, &[0; 8]).expect("eight bytes");
        self.wire.to_node.extend([frame].repeat(frames));
    }

    /// Control words of the next samples.
    pub(crate) fn words(&mut self, samples: usize) -> Vec<ControlWord> {
        self.run(samples)
            .iter()
            .filter_map(|message| match message {
                Message::Command(command) => Some(command.control),
                _ => None,
            })
            .collect()
    }

    pub(crate) fn hello(&mut self, schema: u32) {
        let hello = Hello {
            schema,
            build: 0,
            profile: Hello::PROFILE_FD,
        };
        let request = Message::ParameterRequest(Server::Controller, ParameterRequest::Hello(hello));
        self.wire.to_node.push_back(encode(&request, 0).unwrap());
    }

    pub(crate) fn motion(&mut self, request: MotionRequest) -> CanFrame {
        self.sequence = self.sequence.wrapping_add(1);
        let motion = Motion {
            sequence: self.sequence,
            request,
        };
        let frame = encode(&Message::Motion(motion), self.motion_counter).unwrap();
        self.motion_counter = self.motion_counter.wrapping_add(1);
        frame
    }

    pub(crate) fn request(&mut self, request: MotionRequest) -> Option<Outcome> {
        let frame = self.motion(request);
        self.wire.to_node.push_back(frame);
        let sequence = self.sequence;
        self.run(200).iter().find_map(|message| match message {
            Message::MotionReply(reply) if reply.sequence == sequence => Some(reply.outcome),
            _ => None,
        })
    }

    pub(crate) fn refusal(&mut self, request: MotionRequest) -> RefusalReason {
        match self.request(request) {
            Some(Outcome::Refused(refusal)) => refusal.reason,
            other => panic!("{request:?} not refused: {other:?}"),
        }
    }
}

/// For an arm that moves by itself: these drives report no torque, and what an observer would make of that is no motion.
pub(crate) fn by_itself() -> Config {
    let mut config = Config::new(IRB_930, PERIOD);
    config.setup.selection.compensation = Compensation::None;
    config.setup.monitor.collision = f32::MAX;
    config
}

pub(crate) fn is_off(command: &Command) -> bool {
    !command.control.contains(ControlWord::TORQUE_ENABLE)
        && !command.control.contains(ControlWord::BRAKE_RELEASE)
        && command.torque == [0.0; 4]
}

pub(crate) fn estop() -> CanFrame {
    let estop = EStop {
        reason: EStopReason::UNSPECIFIED,
        counter: 0,
    };
    encode(&Message::EStop(estop), 0).unwrap()
}

/// A heartbeat of this node in this state.
pub(crate) fn heartbeat(name: Name, state: Mode, counter: u8) -> CanFrame {
    let heartbeat = Heartbeat {
        state,
        cause: Cause::None,
        reset: ResetReason::PowerOn,
    };
    encode(&Message::Heartbeat(name, heartbeat), counter).unwrap()
}
