//! Parameters of a node: a new value takes effect from the next sample on.

use std::ops::{Deref, DerefMut};

use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use firmware::node::Node;
use nalgebra::Vector4;
use proptest::prelude::*;
use protocol::codec::encode;
use protocol::messages::{
    Cause, Compensation, ControlWord, Law, Message, Mode, MotionRequest, ParameterError,
    ParameterReply, ParameterRequest, ResetReason, Server,
};
use protocol::parameters::{ControllerParameter, DriveParameter, Kind};
use protocol::time::Duration;

use crate::bench::{Bench, PERIOD};

/// A bench with a parameter client, and an arm that a test can push.
pub(crate) struct Client {
    bench: Bench,
    counters: [u8; 2],
    joints: Vector4<f32>,
}

impl Deref for Client {
    type Target = Bench;
    fn deref(&self) -> &Bench {
        &self.bench
    }
}

impl DerefMut for Client {
    fn deref_mut(&mut self) -> &mut Bench {
        &mut self.bench
    }
}

impl Client {
    fn of(bench: Bench) -> Self {
        Self {
            bench,
            // The bench has sent its Hello with counter 0.
            counters: [1, 0],
            joints: Vector4::new(0.2, 1.5, 0.15, 0.3),
        }
    }

    /// A bench in Ready that has received the operator's Hello.
    pub(crate) fn new() -> Self {
        let mut bench = Bench::new();
        bench.hello(protocol::table::HASH);
        bench.run(2);
        bench.request(MotionRequest::Stop);
        assert_eq!(bench.mode(), Mode::Ready);
        Self::of(bench)
    }

    fn enabled() -> Self {
        Self::of(Bench::enabled())
    }

    /// Displaces a joint.
    fn push(&mut self, axis: usize, by: f32) {
        self.joints[axis] += by;
        let joints = self.joints;
        self.put(&joints);
    }

    /// Displaces a joint that moves back slowly, and not at all like one with a stuck encoder.
    fn swing(&mut self, axis: usize, by: f32) {
        self.push(axis, by);
        self.velocity[axis] = -10.0 * by.signum();
    }

    /// Passes a request to the node without waiting for a sample.
    fn ask(&mut self, request: MotionRequest) {
        let frame = self.motion(request);
        self.wire.to_node.push_back(frame);
        self.poll();
    }

    /// What the node sends at once on a parameter request.
    fn parameter(&mut self, request: ParameterRequest) -> Vec<Message> {
        self.receive(0, Message::ParameterRequest(Server::Controller, request))
    }

    fn receive(&mut self, kind: usize, message: Message) -> Vec<Message> {
        let frame = encode(&message, self.counters[kind]).expect("the test sends valid messages");
        self.counters[kind] = self.counters[kind].wrapping_add(1);
        self.wire.to_node.push_back(frame);
        self.poll()
    }

    pub(crate) fn reply(&mut self, request: ParameterRequest) -> ParameterReply {
        let sent = self.parameter(request);
        let reply = sent.iter().find_map(|message| match message {
            Message::ParameterReply(Server::Controller, reply) => Some(*reply),
            _ => None,
        });
        reply.unwrap_or_else(|| panic!("{request:?}: {sent:?}"))
    }

    pub(crate) fn set(&mut self, parameter: ControllerParameter, value: f32) {
        let index = parameter.rule().number;
        let reply = self.reply(ParameterRequest::Set { index, value });
        let ParameterReply::Value { value: found, .. } = reply else {
            panic!("{parameter:?} = {value}: {reply:?}");
        };
        assert_eq!(found, value);
    }

    pub(crate) fn get(&mut self, parameter: ControllerParameter) -> f32 {
        let index = parameter.rule().number;
        match self.reply(ParameterRequest::Get { index }) {
            ParameterReply::Value { value, .. } => value,
            other => panic!("{other:?}"),
        }
    }

    fn error(&mut self, parameter: ControllerParameter, value: f32) -> ParameterError {
        let index = parameter.rule().number;
        match self.reply(ParameterRequest::Set { index, value }) {
            ParameterReply::Error { error, .. } => error,
            other => panic!("{other:?}"),
        }
    }
}

/// A listing has the values of a new node: its configuration, and otherwise the table's defaults.
#[test]
fn a_new_node_has_the_defaults() {
    let mut bench = Client::new();
    for &parameter in ControllerParameter::ALL {
        let expected = match parameter {
            ControllerParameter::SamplingPeriod => 1e-3,
            ControllerParameter::PayloadMass => 0.0,
            other => other.initial(1e-3),
        };
        assert_eq!(bench.get(parameter), expected, "{parameter:?}");
    }
}

/// Each field is connected to its own name: a value set is read back, and nothing else changes.
#[test]
fn every_parameter_is_kept_by_itself() {
    for &parameter in ControllerParameter::ALL {
        if parameter.parameter().default.is_none() {
            continue;
        }
        let mut bench = Client::new();
        let rule = parameter.rule();
        let value = if rule.kind == Kind::Whole {
            rule.lower + 1.0
        } else {
            0.9 * rule.lower + 0.1 * rule.upper_at(1e-3)
        };
        bench.set(parameter, value);
        // A new sample does not bring the old value back.
        bench.run(3);
        for &other in ControllerParameter::ALL {
            let expected = match other {
                ControllerParameter::SamplingPeriod => 1e-3,
                ControllerParameter::PayloadMass => 0.0,
                other if other == parameter => value,
                other => other.initial(1e-3),
            };
            assert_eq!(bench.get(other), expected, "{other:?} after {parameter:?}");
        }
    }
}

/// In the very sample after the request the elbow is pushed by 0.025 rad, which the default of 0.05 rad tolerates.
#[test]
fn a_smaller_following_error_stops_the_arm_earlier() {
    let push = |bench: &mut Client| {
        bench.swing(1, 0.025);
        bench.run(2);
        assert_eq!(bench.mode(), Mode::Enabled, "not before the third sample");
        bench.step();
    };
    let mut bench = Client::enabled();
    push(&mut bench);
    assert_eq!(bench.mode(), Mode::Enabled, "0.05 rad");
    let mut bench = Client::enabled();
    bench.set(ControllerParameter::FollowingErrorElbow, 0.02);
    push(&mut bench);
    assert_eq!(bench.node.controller().cause(), Cause::FollowingError);
    assert_eq!(bench.mode(), Mode::FaultReaction);
}

/// A violation in progress keeps its count when the limit of another axis changes.
#[test]
fn setting_a_limit_does_not_start_the_count_again() {
    let mut bench = Client::enabled();
    bench.velocity[1] = -10.0;
    bench.shove_away();
    bench.step();
    bench.set(ControllerParameter::FollowingErrorLift, 0.02);
    bench.step();
    assert_eq!(bench.node.controller().cause(), Cause::FollowingError);
}

#[test]
fn fewer_fault_samples_stop_the_arm_earlier() {
    let mut bench = Client::enabled();
    bench.set(ControllerParameter::FaultSamples, 1.0);
    bench.set(ControllerParameter::FollowingErrorElbow, 0.02);
    bench.swing(1, 0.025);
    bench.step();
    assert_eq!(bench.node.controller().cause(), Cause::FollowingError);
}

/// PD with gravity compensation: torque is proportional to the error and to the square of the bandwidth.
#[test]
fn the_bandwidth_changes_the_next_command() {
    let mut bench = Client::new();
    bench.ask(MotionRequest::SelectLaw {
        law: Law::PdGravity,
        compensation: Compensation::None,
    });
    bench.ask(MotionRequest::Enable);
    bench.run(100);
    bench.push(0, 0.001);
    let before = bench.command().torque[0];
    bench.set(ControllerParameter::Bandwidth, 85.0);
    let after = bench.command().torque[0];
    let ratio = before / after;
    // Encoder counts round the push.
    assert!((ratio - 4.0).abs() < 1e-3, "{before} over {after}: {ratio}");
}

/// Samples from Enable until the control word allows a move, and from Disable until it switches torque off.
#[test]
fn the_brake_delay_times_the_control_word() {
    for (delay, samples) in [(0.06, 60), (0.2, 200)] {
        let mut bench = Client::new();
        bench.set(ControllerParameter::BrakeDelay, delay);
        bench.ask(MotionRequest::Enable);
        let opening = (0..1000).take_while(|_| {
            bench.step();
            bench.mode() != Mode::Enabled
        });
        let opening = opening.count();
        bench.ask(MotionRequest::Disable);
        let closing = (0..1000).take_while(|_| {
            let control = bench.command().control;
            assert!(!control.contains(ControlWord::BRAKE_RELEASE));
            control.contains(ControlWord::TORQUE_ENABLE)
        });
        let closing = closing.count();
        assert!(
            opening.abs_diff(samples) <= 1,
            "{delay} s: {opening} samples"
        );
        assert!(
            closing.abs_diff(samples) <= 1,
            "{delay} s: {closing} samples"
        );
    }
}

#[test]
fn the_watchdogs_follow_their_parameters() {
    // 100 ms by default, in microseconds.
    for (timeout, lost_at) in [(0.1, 100_000), (0.03, 30_000)] {
        let mut bench = Client::enabled();
        bench.set(ControllerParameter::FeedbackTimeout, timeout);
        bench.now += Duration::from_micros(lost_at);
        bench.poll();
        assert_eq!(bench.mode(), Mode::Enabled, "{timeout} s");
        bench.now += Duration::from_micros(1);
        bench.poll();
        assert_eq!(bench.node.controller().cause(), Cause::PeerSilent);
    }
    for (gap, mode) in [(0.005, Mode::FaultReaction), (0.008, Mode::Enabled)] {
        let mut bench = Client::enabled();
        bench.set(ControllerParameter::FeedbackGap, gap);
        for _ in 0..6 {
            bench.lose();
        }
        bench.step();
        assert_eq!(bench.mode(), mode, "gap {gap} s");
    }
    let mut bench = Client::enabled();
    bench.set(ControllerParameter::BadFrames, 1.0);
    bench.feedback_counter -= 1;
    bench.step();
    assert_eq!(bench.node.controller().cause(), Cause::Reordered);
}

#[test]
fn what_changes_torques_waits_until_the_arm_is_at_rest() {
    let mut bench = Client::enabled();
    bench.ask(MotionRequest::MoveJoint {
        target: [0.5, 1.2, 0.1, 0.0],
        speed: 0.5,
        zone: 0.0,
    });
    for parameter in [
        ControllerParameter::Bandwidth,
        ControllerParameter::Damping,
        ControllerParameter::Observer,
        ControllerParameter::CommandDelay,
        ControllerParameter::BrakeDelay,
    ] {
        let value = parameter.initial(1e-3);
        assert_eq!(bench.error(parameter, value), ParameterError::NotNow);
    }
    bench.set(ControllerParameter::FollowingErrorElbow, 0.04);
    // A gain beyond the range is out of range at any time.
    assert_eq!(
        bench.error(ControllerParameter::Bandwidth, 300.0),
        ParameterError::OutOfRange
    );
    assert_eq!(
        bench.error(ControllerParameter::SamplingPeriod, 1e-3),
        ParameterError::ReadOnly
    );
}

/// The first frame that a node receives may be a replay.
#[test]
fn a_first_frame_changes_nothing() {
    let mut bench = Client::new();
    bench.node = Node::new(Config::new(IRB_930, PERIOD), ResetReason::PowerOn);
    bench.run(2);
    let limit = ControllerParameter::FollowingErrorElbow;
    assert_eq!(bench.error(limit, 0.3), ParameterError::NotNow);
    assert_eq!(bench.get(limit), limit.initial(1e-3));
    bench.set(limit, 0.3);
}

/// Requests for the drives are forwarded and their answers returned; silent drives are not waited for.
#[test]
fn the_drives_are_asked_through_the_controller() {
    let mut bench = Client::new();
    let get = ParameterRequest::Get {
        index: DriveParameter::HoldSamples.rule().number,
    };
    let last = ControllerParameter::ALL.last().unwrap().rule().number;
    let list = ParameterRequest::List { from: last + 1 };
    for request in [get, list] {
        assert_eq!(
            bench.parameter(request),
            [Message::ParameterRequest(Server::Drives, request)]
        );
    }
    let reply = ParameterReply::Value {
        index: 0x1020,
        value: 5.0,
        lower: 1.0,
        upper: 50.0,
    };
    assert_eq!(
        bench.receive(1, Message::ParameterReply(Server::Drives, reply)),
        [Message::ParameterReply(Server::Controller, reply)]
    );
    bench.now += Duration::from_secs(1);
    bench.poll();
    assert_eq!(
        bench.reply(get),
        ParameterReply::Error {
            index: 0x1020,
            error: ParameterError::NotNow,
            limit: 0.0
        }
    );
}

fn request() -> impl Strategy<Value = ParameterRequest> {
    let number = prop_oneof![0..0x40u16, 0x0FF0..0x1030u16, any::<u16>()];
    let value = prop_oneof![-1.0..2.0f32, 0.0..300.0f32, -f32::MAX..f32::MAX];
    (0..3, number, value).prop_map(|(kind, index, value)| match kind {
        0 => ParameterRequest::Get { index },
        1 => ParameterRequest::Set { index, value },
        _ => ParameterRequest::List { from: index },
    })
}

proptest! {
    #![proptest_config(crate::draws::cases(64))]

    /// Whatever is set, every value stays in range, and the node answers each feedback with finite torques.
    #[test]
    fn no_requests_lead_out_of_a_range(requests in prop::collection::vec(request(), 1..100)) {
        let mut bench = Client::enabled();
        for request in requests {
            let sent = bench.parameter(request);
            prop_assert!(sent.len() <= 2, "one answer, and at most one report: {:?}", sent);
            let command = bench.command();
            prop_assert!(command.torque.iter().all(|torque| torque.is_finite()));
        }
        for &parameter in ControllerParameter::ALL {
            let value = bench.get(parameter);
            prop_assert_eq!(parameter.rule().check(value, 1e-3), Ok(()), "{:?}", parameter);
        }
    }
}
