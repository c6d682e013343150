//! Parameters of the drives, requested like the controller does, and the round trip from an operator.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use protocol::codec::{decode, encode};
use protocol::frame::CanFrame;
use protocol::messages::{
    Command, ControlWord, DriveStatus, Message, ParameterError, ParameterReply, ParameterRequest,
    Server,
};
use protocol::parameters::{self, ControllerParameter, DriveParameter};
use protocol::table;
use protocol::time::{Instant, Period};
use sim::clock::Clock;
use sim::controller::InProcess;
use sim::drives::Drives;
use sim::model::RobotModel;
use sim::observer::Observer;
use sim::operator::Operator;
use sim::peer::{Outbox, Peer};
use sim::plant::Plant;
use sim::plant::brake::Brake;
use sim::rig::Rig;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::world::Mind;
use sim::world::World;

const PERIOD: Period = Period::of_rate(1000.0);
const START: [f64; 4] = [0.2, 1.5, 0.15, 0.3];
const TORQUE: DriveParameter = DriveParameter::TorqueLimitShoulder;
const HOLD: DriveParameter = DriveParameter::HoldSamples;

/// Drives on a plant, commanded by hand.
struct Bench {
    model: RobotModel,
    world: World,
    drives: Drives,
    sample: u32,
    counters: [u8; 2],
}

impl Bench {
    fn new() -> Self {
        let model = RobotModel::irb_930_22_105();
        let mut bench = Self {
            world: World {
                plant: Plant::new(&model, START),
                mind: Mind::BLANK,
                sample: None,
                clock: Clock::default(),
                cell_events: Vec::new(),
                outcome: None,
            },
            drives: Drives::new(&model, PERIOD),
            model,
            sample: 0,
            counters: [0; 2],
        };
        // The first request must not change anything, so it is not a set.
        bench.ask(ParameterRequest::List { from: 0 });
        bench
    }

    fn receive(&mut self, kind: usize, message: Message) -> Option<Message> {
        let counter = self.counters[kind];
        self.counters[kind] = counter.wrapping_add(1);
        let frame = encode(&message, counter).unwrap();
        self.call(Some(&frame))
    }

    /// What the drives send.
    fn call(&mut self, received: Option<&CanFrame>) -> Option<Message> {
        let now = PERIOD.sample(u64::from(self.sample));
        let mut out = Outbox::new();
        self.drives
            .poll(now, received, &mut self.world, &mut out)
            .unwrap();
        out.retain(|(_, frame)| !table::DRIVES_HEARTBEAT.identifies(frame));
        assert!(out.len() <= 1);
        let sent = out.pop();
        sent.map(|(_, frame): (Instant, CanFrame)| decode(&frame).unwrap().message)
    }

    fn ask(&mut self, request: ParameterRequest) -> ParameterReply {
        match self.receive(1, Message::ParameterRequest(Server::Drives, request)) {
            Some(Message::ParameterReply(Server::Drives, reply)) => reply,
            other => panic!("{request:?}: {other:?}"),
        }
    }

    fn set(&mut self, parameter: DriveParameter, value: f32) -> ParameterReply {
        let index = parameter.rule().number;
        self.ask(ParameterRequest::Set { index, value })
    }

    fn get(&mut self, parameter: DriveParameter) -> f32 {
        let index = parameter.rule().number;
        match self.ask(ParameterRequest::Get { index }) {
            ParameterReply::Value { value, .. } => value,
            other => panic!("{other:?}"),
        }
    }

    /// One sample; returns the state that the drives report.
    fn sample(&mut self) -> DriveStatus {
        let sent = self.call(None);
        self.sample += 1;
        match sent {
            Some(Message::Feedback(feedback)) => feedback.status,
            other => panic!("{other:?}"),
        }
    }

    fn command(&mut self, torque: f32) {
        self.answer(0, torque);
    }

    /// A command that has missed so many samples since the one that it answers.
    fn answer(&mut self, missed: u32, torque: f32) {
        let command = Command {
            sample: self.sample - 1 - missed,
            control: ControlWord::TORQUE_ENABLE,
            torque: [torque, 0.0, 0.0, 0.0],
        };
        assert_eq!(self.receive(0, Message::Command(command)), None);
    }
}

fn error(reply: ParameterReply) -> (ParameterError, f32) {
    match reply {
        ParameterReply::Error { error, limit, .. } => (error, limit),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_reply_occurs() {
    let mut bench = Bench::new();
    for (axis, parameter) in DriveParameter::ALL[..4].iter().enumerate() {
        let rated = bench.model.drive.motor_torque_rated[axis] as f32;
        assert_eq!(bench.get(*parameter), rated);
    }
    assert_eq!(bench.get(TORQUE), 1.0);
    assert!(matches!(
        bench.set(TORQUE, 0.5),
        ParameterReply::Value { value: 0.5, .. }
    ));
    assert_eq!(
        error(bench.set(TORQUE, 1.5)),
        (ParameterError::OutOfRange, 1.0)
    );
    assert_eq!(
        error(bench.set(DriveParameter::RatedTorqueLift, 1.0)),
        (ParameterError::ReadOnly, 0.0)
    );
    let beyond = bench.ask(ParameterRequest::Get { index: u16::MAX });
    assert_eq!(error(beyond), (ParameterError::NotFound, 0.0));
    bench.sample();
    bench.command(0.0);
    assert_eq!(error(bench.set(TORQUE, 0.8)), (ParameterError::NotNow, 0.0));
    assert!(matches!(
        bench.set(HOLD, 7.0),
        ParameterReply::Value { value: 7.0, .. }
    ));
    assert_eq!(bench.get(TORQUE), 0.5);
    // Drives that restart, and a first frame that may be a replay.
    bench.drives = Drives::new(&bench.model, PERIOD);
    assert_eq!(error(bench.set(HOLD, 9.0)), (ParameterError::NotNow, 0.0));
    assert_eq!(bench.get(HOLD), 5.0);
}

#[test]
fn a_torque_limit_cuts_the_next_command() {
    let mut bench = Bench::new();
    let greatest = bench.model.drive.motor_torque_limit[0];
    bench.set(TORQUE, 0.25);
    bench.sample();
    bench.command(0.5 * greatest as f32);
    assert_eq!(bench.world.plant.motor_torque()[0], 0.25 * greatest);
    assert!(bench.sample().contains(DriveStatus::TORQUE_SATURATED));
    bench.command(-0.2 * greatest as f32);
    let given = bench.world.plant.motor_torque()[0];
    assert!((given + 0.2 * greatest).abs() < 1e-6 * greatest, "{given}");
    assert!(!bench.sample().contains(DriveStatus::TORQUE_SATURATED));
}

/// A command is late that answers a sample of 2 ms before, and stays so until the next one.
#[test]
fn drives_say_that_their_command_is_late() {
    for missed in 0..5 {
        let mut bench = Bench::new();
        for _ in 0..=missed {
            bench.sample();
        }
        bench.answer(missed, 0.0);
        for _ in 0..2 {
            let status = bench.sample();
            let is_late = status.contains(DriveStatus::COMMAND_LATE);
            assert_eq!(is_late, missed >= 2, "{missed}");
        }
        bench.command(0.0);
        assert!(!bench.sample().contains(DriveStatus::COMMAND_LATE));
    }
}

/// Samples without a command until the drives switch torque off.
#[test]
fn commands_are_held_for_as_long_as_is_set() {
    for (set, held) in [(None, 5), (Some(1.0), 1), (Some(20.0), 20)] {
        let mut bench = Bench::new();
        if let Some(samples) = set {
            bench.set(HOLD, samples);
        }
        bench.sample();
        bench.command(0.0);
        bench.sample();
        let missed = (0..100).take_while(|_| bench.sample().contains(DriveStatus::TORQUE_ON));
        assert_eq!(missed.count(), held, "{set:?}");
    }
}

/// Torque must not go off before the brake has closed, whatever an operator sets.
#[test]
fn no_brake_delay_is_shorter_than_the_brake() {
    let shortest = f64::from(ControllerParameter::BrakeDelay.rule().lower);
    let needed = Brake::ENGAGE_NS.max(Brake::RELEASE_NS);
    assert!((shortest * 1e9).round() >= needed as f64);
}

/// Records the answers to the operator.
#[derive(Default)]
struct Answers(Vec<ParameterReply>);

impl Observer for Answers {
    fn frame(&mut self, _: Instant, frame: &CanFrame) -> std::io::Result<()> {
        if let Ok(received) = decode(frame)
            && let Message::ParameterReply(Server::Controller, reply) = received.message
        {
            self.0.push(reply);
        }
        Ok(())
    }
}

/// Through bus, controller, bus and drives and back, in the middle of a run, without disturbing it.
#[test]
fn an_operator_reads_and_sets_what_the_drives_have() {
    let config = RunConfig::new(Scenario::built_in("gate").unwrap());
    let rig = config.rig().unwrap();
    let mut answers = Answers::default();
    let mut bench = Rig::new(&rig);
    bench.attach(Drives::new(&rig.actual, rig.period));
    bench.attach(Operator::new(&config.scenario));
    bench.attach(InProcess::new(rig.controller()));
    for _ in 0..400 {
        bench.step(&mut (), &mut answers).unwrap();
    }
    answers.0.clear();
    let index = HOLD.rule().number;
    // The operator has sent its Hello with counter 0.
    let requests = [
        ParameterRequest::Set { index, value: 9.0 },
        ParameterRequest::Get { index },
        ParameterRequest::List {
            from: ControllerParameter::ThermalTime.rule().number + 1,
        },
    ];
    for (request, counter) in requests.iter().zip(1..) {
        let message = Message::ParameterRequest(Server::Controller, *request);
        bench.inject(&encode(&message, counter).unwrap());
        for _ in 0..3 {
            bench.step(&mut (), &mut answers).unwrap();
        }
    }
    // The first request that the drives receive changes nothing.
    assert!(matches!(
        answers.0[..],
        [
            ParameterReply::Error {
                error: ParameterError::NotNow,
                ..
            },
            ParameterReply::Value { value: 5.0, .. },
            ParameterReply::Value { index: 0x1000, .. }
        ]
    ));
    bench.run(&mut (), &mut answers).unwrap();
    assert_eq!(bench.outcome(), Some(&Ok(())));
    assert_eq!(parameters::numbered(index).unwrap().name, "hold-samples");
}
