//! The node on a bus of the test's own: what it answers, what it refuses, and what it ignores.

use std::collections::VecDeque;

use firmware::control::controller::{Config, MAX_GAP};
use firmware::control::phase::{Phase, Probe};
use firmware::mechanics::arm::IRB_930;
use firmware::mechanics::dynamics::drive::Drive;
use firmware::node::{FRAMES_PER_POLL, Node, PEER_TIMEOUT_US};
use nalgebra::Vector4;
use proptest::prelude::*;
use protocol::bus::{Bus, TransmitError};
use protocol::codec::{decode, encode};
use protocol::frame::{CanFrame, StandardId};
use protocol::messages::{
    Cause, Command, ControlWord, DriveStatus, EStop, EStopReason, Feedback, Hello, Message, Mode,
    Motion, MotionRequest, Nmt, NmtCommand, Node as Name, Outcome, ParameterRequest, RefusalReason,
    ResetReason, Server, State,
};
use protocol::table;

const PERIOD_US: u64 = 1000;

#[derive(Default)]
struct Wire {
    to_node: VecDeque<CanFrame>,
    from_node: Vec<CanFrame>,
}

impl Bus for Wire {
    fn receive(&mut self) -> Option<CanFrame> {
        self.to_node.pop_front()
    }

    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self.from_node.push(*frame);
        Ok(())
    }
}

/// A node, and an arm that stands still whatever it is told.
struct Bench {
    node: Node,
    wire: Wire,
    now: u64,
    sample: u32,
    feedback_counter: u8,
    motion_counter: u8,
    sequence: u8,
    position: [i32; 4],
}

impl Bench {
    fn new() -> Self {
        let drive = Drive::new(&IRB_930.drive);
        let q = Vector4::new(0.2, 1.5, 0.15, 0.3);
        Self {
            node: Node::new(Config::new(IRB_930, 1e-3), ResetReason::Watchdog),
            wire: Wire::default(),
            now: 0,
            sample: 0,
            feedback_counter: 0,
            motion_counter: 0,
            sequence: 0,
            position: drive.counts_of_motor_angle(&drive.motor_angle(&q)),
        }
    }

    /// A bench whose axes are under torque.
    fn enabled() -> Self {
        let mut bench = Self::new();
        bench.hello(table::HASH);
        bench.run(2);
        assert_eq!(bench.request(MotionRequest::Stop), Some(Outcome::Accepted));
        assert_eq!(
            bench.request(MotionRequest::Enable),
            Some(Outcome::Accepted)
        );
        bench.run(100);
        assert_eq!(bench.mode(), Mode::Enabled);
        bench
    }

    fn mode(&self) -> Mode {
        self.node.controller().mode()
    }

    fn next_feedback(&mut self) -> CanFrame {
        let feedback = Feedback {
            sample: self.sample,
            status: DriveStatus::READY | DriveStatus::ENCODER_VALID,
            position: self.position,
            velocity: [0.0; 4],
            torque: [0; 4],
        };
        let frame = encode(&Message::Feedback(feedback), self.feedback_counter).unwrap();
        self.sample += 1;
        self.feedback_counter = self.feedback_counter.wrapping_add(1);
        frame
    }

    fn poll(&mut self) -> Vec<Message> {
        self.node.poll(self.now, &mut self.wire);
        self.wire
            .from_node
            .drain(..)
            .map(|frame| decode(&frame).expect("a node sends valid frames").message)
            .collect()
    }

    /// One sample with what has been put on the wire; returns what the node sent.
    fn step(&mut self) -> Vec<Message> {
        self.now += PERIOD_US;
        let frame = self.next_feedback();
        self.wire.to_node.push_back(frame);
        self.poll()
    }

    fn run(&mut self, samples: usize) -> Vec<Message> {
        (0..samples).flat_map(|_| self.step()).collect()
    }

    fn command(&mut self) -> Command {
        let sent = self.step();
        let commands: Vec<_> = sent
            .iter()
            .filter_map(|message| match message {
                Message::Command(command) => Some(*command),
                _ => None,
            })
            .collect();
        assert_eq!(commands.len(), 1, "one command a feedback: {sent:?}");
        assert_eq!(commands[0].sample, self.sample - 1, "the sample is echoed");
        commands[0]
    }

    fn hello(&mut self, schema: u32) {
        let hello = Hello {
            schema,
            build: 0,
            profile: Hello::PROFILE_FD,
        };
        let request = Message::ParameterRequest(Server::Controller, ParameterRequest::Hello(hello));
        self.wire.to_node.push_back(encode(&request, 0).unwrap());
    }

    fn motion(&mut self, request: MotionRequest) -> CanFrame {
        self.sequence += 1;
        let motion = Motion {
            sequence: self.sequence,
            request,
        };
        let frame = encode(&Message::Motion(motion), self.motion_counter).unwrap();
        self.motion_counter = self.motion_counter.wrapping_add(1);
        frame
    }

    fn request(&mut self, request: MotionRequest) -> Option<Outcome> {
        let frame = self.motion(request);
        self.wire.to_node.push_back(frame);
        let sequence = self.sequence;
        self.run(200).iter().find_map(|message| match message {
            Message::MotionReply(reply) if reply.sequence == sequence => Some(reply.outcome),
            _ => None,
        })
    }

    fn refusal(&mut self, request: MotionRequest) -> RefusalReason {
        match self.request(request) {
            Some(Outcome::Refused(refusal)) => refusal.reason,
            other => panic!("{request:?} not refused: {other:?}"),
        }
    }
}

fn is_off(command: &Command) -> bool {
    !command.control.contains(ControlWord::TORQUE_ENABLE)
        && !command.control.contains(ControlWord::BRAKE_RELEASE)
        && command.torque == [0.0; 4]
}

fn estop() -> CanFrame {
    let estop = EStop {
        reason: EStopReason::UNSPECIFIED,
        counter: 0,
    };
    encode(&Message::EStop(estop), 0).unwrap()
}

#[test]
fn switching_on_takes_a_known_peer_and_opens_the_brake_under_torque() {
    let mut bench = Bench::new();
    assert!(is_off(&bench.command()));
    assert_eq!(bench.mode(), Mode::PreOperational);
    bench.hello(table::HASH);
    bench.run(2);
    assert_eq!(bench.mode(), Mode::Ready);
    assert_eq!(bench.request(MotionRequest::Stop), Some(Outcome::Accepted));
    let enable = bench.motion(MotionRequest::Enable);
    bench.wire.to_node.push_back(enable);
    bench.step();
    assert_eq!(bench.mode(), Mode::Enabling);
    let opening = bench.command();
    let both = ControlWord::TORQUE_ENABLE | ControlWord::BRAKE_RELEASE;
    assert!(opening.control.contains(both));
    // The weight of lift and shaft, 1.95 kg, on motor 3: m g / (2 pi / 25 mm), within the
    // feedback's share for half a count.
    let carried = 1.95 * 9.81 / (std::f32::consts::TAU / 0.025);
    assert!(
        (opening.torque[2] + carried).abs() < 0.01 * carried,
        "{opening:?}"
    );
    bench.run(100);
    assert_eq!(bench.mode(), Mode::Enabled);
    assert_eq!(
        bench.request(MotionRequest::Disable),
        Some(Outcome::Accepted)
    );
    assert_eq!(bench.mode(), Mode::Ready);
    assert!(is_off(&bench.command()));
}

#[test]
fn switching_off_closes_the_brake_before_torque_goes() {
    let mut bench = Bench::enabled();
    let frame = bench.motion(MotionRequest::Disable);
    bench.wire.to_node.push_back(frame);
    let controls: Vec<_> = bench
        .run(100)
        .iter()
        .filter_map(|message| match message {
            Message::Command(command) => Some(command.control),
            _ => None,
        })
        .collect();
    let torque = |c: &ControlWord| c.contains(ControlWord::TORQUE_ENABLE);
    let brake_open = |c: &ControlWord| c.contains(ControlWord::BRAKE_RELEASE);
    let closing = controls
        .iter()
        .filter(|c| torque(c) && !brake_open(c))
        .count();
    // The drives' brake takes 30 ms to close.
    assert!(closing >= 30, "{closing} samples");
    assert!(
        controls.iter().all(|c| torque(c) || !brake_open(c)),
        "never open without torque"
    );
    assert!(!torque(controls.last().unwrap()));
}

#[test]
fn enable_is_refused_without_a_peer_of_the_same_schema() {
    let mut bench = Bench::new();
    bench.run(2);
    assert_eq!(bench.request(MotionRequest::Stop), Some(Outcome::Accepted));
    assert_eq!(
        bench.refusal(MotionRequest::Enable),
        RefusalReason::SchemaMismatch
    );
    bench.hello(table::HASH ^ 1);
    assert_eq!(
        bench.refusal(MotionRequest::Enable),
        RefusalReason::SchemaMismatch
    );
    assert_eq!(bench.mode(), Mode::PreOperational);
}

#[test]
fn the_first_request_of_an_operator_switches_nothing_on() {
    let mut bench = Bench::new();
    bench.hello(table::HASH);
    bench.run(2);
    assert_eq!(
        bench.refusal(MotionRequest::Enable),
        RefusalReason::WrongState
    );
    // The second one is no replay of the first.
    assert_eq!(
        bench.request(MotionRequest::Enable),
        Some(Outcome::Accepted)
    );
}

#[test]
fn a_replayed_enable_is_dropped() {
    let mut bench = Bench::new();
    bench.hello(table::HASH);
    bench.run(2);
    bench.request(MotionRequest::Stop);
    let enable = bench.motion(MotionRequest::Enable);
    bench.wire.to_node.push_back(enable);
    bench.run(100);
    assert_eq!(
        bench.request(MotionRequest::Disable),
        Some(Outcome::Accepted)
    );
    assert_eq!(bench.mode(), Mode::Ready);
    bench.wire.to_node.push_back(enable);
    bench.run(100);
    assert_eq!(bench.mode(), Mode::Ready);
}

#[test]
fn requests_are_refused_where_they_make_no_sense() {
    let mut bench = Bench::enabled();
    let move_to = |target| MotionRequest::MoveJoint { target, speed: 1.0 };
    assert_eq!(
        bench.refusal(MotionRequest::Enable),
        RefusalReason::WrongState
    );
    assert_eq!(
        bench.refusal(MotionRequest::FaultReset),
        RefusalReason::WrongState
    );
    assert_eq!(
        bench.refusal(move_to([0.0, 3.0, 0.1, 0.0])),
        RefusalReason::JointLimit
    );
    let heavy = MotionRequest::SetPayload {
        mass: 30.0,
        com: [0.0; 3],
        inertia: [0.1; 3],
    };
    assert_eq!(bench.refusal(heavy), RefusalReason::PayloadTooHeavy);
    let wild = MotionRequest::SetGains {
        bandwidth: 900.0,
        damping: 1.0,
        observer: 10.0,
    };
    assert_eq!(bench.refusal(wild), RefusalReason::OutOfRange);
    assert_eq!(
        bench.request(MotionRequest::Disable),
        Some(Outcome::Accepted)
    );
    assert_eq!(
        bench.refusal(move_to([0.0, 1.0, 0.1, 0.0])),
        RefusalReason::NotEnabled
    );
}

#[test]
fn gaps_up_to_the_limit_are_ridden_out_and_longer_ones_stop_the_arm() {
    for lost in 0..=MAX_GAP + 1 {
        let mut bench = Bench::enabled();
        for _ in 0..lost {
            bench.next_feedback();
            bench.now += PERIOD_US;
        }
        bench.command();
        let expected = if lost < MAX_GAP {
            Mode::Enabled
        } else {
            Mode::FaultReaction
        };
        assert_eq!(bench.mode(), expected, "{lost} lost");
    }
}

#[test]
fn a_silent_peer_takes_the_torque_away_and_is_reported() {
    let mut bench = Bench::enabled();
    bench.now += PEER_TIMEOUT_US + 1;
    let sent = bench.poll();
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Fault, Cause::PeerSilent)
    );
    let emergency = sent.iter().find_map(|m| match m {
        Message::Emergency(_, emergency) => Some(emergency),
        _ => None,
    });
    // CiA 301: 8130h is a failed heartbeat; register bits 0 (generic) and 4 (communication).
    let told = emergency.map(|e| (e.cause, e.code, e.register));
    assert_eq!(told, Some((Cause::PeerSilent, 0x8130, 0x11)));
    assert!(is_off(&bench.command()));
}

#[test]
fn following_error_and_drive_faults_stop_the_arm() {
    let mut bench = Bench::enabled();
    // The elbow is pushed 0.1 rad away.
    bench.position[1] += (0.1 * 50.0 / std::f64::consts::TAU * 131_072.0) as i32;
    bench.run(2);
    assert_eq!(bench.mode(), Mode::Enabled, "not before the third sample");
    bench.run(2);
    assert_eq!(bench.node.controller().cause(), Cause::FollowingError);
    bench.run(200);
    assert_eq!(bench.mode(), Mode::Fault);
    assert!(is_off(&bench.command()));
    // A reset leads to a state without torque, and forgets the cause.
    assert_eq!(
        bench.request(MotionRequest::FaultReset),
        Some(Outcome::Accepted)
    );
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Ready, Cause::None)
    );
}

#[test]
fn an_emergency_stop_is_latched() {
    let mut bench = Bench::enabled();
    bench.wire.to_node.push_back(estop());
    bench.step();
    assert_eq!(bench.mode(), Mode::EStop);
    // The lift is never dropped: the brake closes before the torque goes.
    assert!(bench.command().control.contains(ControlWord::TORQUE_ENABLE));
    bench.run(200);
    assert_eq!(bench.mode(), Mode::EStop);
    assert!(is_off(&bench.command()));
    assert_eq!(
        bench.refusal(MotionRequest::Enable),
        RefusalReason::WrongState
    );
    assert_eq!(
        bench.request(MotionRequest::FaultReset),
        Some(Outcome::Accepted)
    );
    bench.run(2);
    assert_eq!(bench.mode(), Mode::Ready);
}

#[test]
fn a_peer_that_goes_silent_during_an_emergency_stop_leaves_no_torque() {
    let mut bench = Bench::enabled();
    bench.wire.to_node.push_back(estop());
    bench.step();
    assert!(
        bench
            .node
            .controller()
            .control_word()
            .contains(ControlWord::TORQUE_ENABLE)
    );
    bench.now += PEER_TIMEOUT_US + 1;
    bench.poll();
    assert_eq!(bench.mode(), Mode::EStop);
    let word = bench.node.controller().control_word();
    assert_eq!(word, ControlWord::ESTOP);
}

#[test]
fn three_bad_feedback_frames_in_a_row_stop_the_arm() {
    let mut bench = Bench::enabled();
    let good = bench.next_feedback();
    let mut bytes = good.data().to_vec();
    bytes[10] ^= 1;
    let bad = CanFrame::fd(good.id(), &bytes, true).unwrap();
    for (count, expected) in [
        (1, Mode::Enabled),
        (2, Mode::Enabled),
        (3, Mode::FaultReaction),
    ] {
        bench.wire.to_node.push_back(bad);
        bench.poll();
        assert_eq!(bench.mode(), expected, "{count}");
    }
    assert_eq!(bench.node.received().crc, 3);
    assert_eq!(bench.node.controller().cause(), Cause::Corrupted);
}

#[test]
fn work_in_one_call_is_bounded() {
    let mut bench = Bench::enabled();
    let estops = 3 * FRAMES_PER_POLL;
    for _ in 0..estops {
        bench.wire.to_node.push_back(estop());
    }
    bench.poll();
    assert_eq!(bench.wire.to_node.len(), estops - FRAMES_PER_POLL);
}

#[test]
fn state_and_heartbeat_come_at_their_rates() {
    let mut bench = Bench::enabled();
    let sent = bench.run(1000);
    let states: Vec<State> = sent
        .iter()
        .filter_map(|m| match m {
            Message::State(state) => Some(*state),
            _ => None,
        })
        .collect();
    assert_eq!(states.len(), 50);
    assert!(
        states
            .iter()
            .all(|s| s.mode == Mode::Enabled && s.queue == 0)
    );
    let beats = sent
        .iter()
        .filter(|m| matches!(m, Message::Heartbeat(..)))
        .count();
    assert_eq!(beats, 10);
}

#[test]
fn every_heartbeat_says_why_the_node_was_started() {
    let reasons: Vec<_> = Bench::enabled()
        .run(1000)
        .iter()
        .filter_map(|message| match message {
            Message::Heartbeat(Name::Controller, heartbeat) => Some(heartbeat.reset),
            _ => None,
        })
        .collect();
    assert_eq!(reasons, [ResetReason::Watchdog; 10]);
}

#[test]
fn the_state_holds_the_longest_tick() {
    let mut bench = Bench::new();
    for cycles in [3000, 170_000, 5] {
        bench.node.note_tick(cycles);
    }
    let worst = bench.run(20).iter().find_map(|message| match message {
        Message::State(state) => Some(state.worst_tick),
        _ => None,
    });
    assert_eq!(worst, Some(170_000));
}

#[test]
fn a_node_asked_to_reset_says_so_and_nothing_more() {
    for (node, command, asked) in [
        (0, NmtCommand::ResetNode, true),
        (Name::Controller.code(), NmtCommand::ResetNode, true),
        (Name::Drives.code(), NmtCommand::ResetNode, false),
        (0, NmtCommand::ResetCommunication, false),
        (0, NmtCommand::Stop, false),
    ] {
        let mut bench = Bench::enabled();
        let nmt = Message::Nmt(Nmt { command, node });
        bench.wire.to_node.push_back(encode(&nmt, 0).unwrap());
        let sent = bench.step();
        assert_eq!(bench.node.reset_asked(), asked, "{command} {node}");
        assert_eq!(sent.is_empty(), asked, "{command} {node}: {sent:?}");
    }
}

fn junk() -> impl Strategy<Value = CanFrame> {
    let bytes = proptest::collection::vec(any::<u8>(), 0..64);
    (0u16..0x800, bytes, any::<bool>()).prop_filter_map("no frame", |(id, bytes, fd)| {
        let id = StandardId::new(id)?;
        if fd {
            CanFrame::fd(id, &bytes, true)
        } else {
            CanFrame::classical(id, &bytes)
        }
    })
}

proptest! {
    /// Frames that are none of ours change nothing: same state, same torques, to the bit.
    #[test]
    fn junk_changes_nothing(frames in proptest::collection::vec(junk(), 1..30)) {
        // Some random frames are valid e-stops or NMT commands, which carry no protection, and
        // three bad feedback frames in a row stop the arm: tested elsewhere.
        prop_assume!(frames.iter().all(|f| f.raw_id() > 0x001 && f.raw_id() != 0x1C0));
        let (mut clean, mut dirty) = (Bench::enabled(), Bench::enabled());
        for frame in frames {
            dirty.wire.to_node.push_back(frame);
            prop_assert_eq!(clean.command(), dirty.command());
            prop_assert_eq!(clean.mode(), dirty.mode());
        }
    }
}

/// A probe that notes what it is told.
#[derive(Default)]
struct Marks(Vec<Phase>);

impl Probe for Marks {
    fn end(&mut self, phase: Phase) {
        self.0.push(phase);
    }
}

#[test]
fn every_phase_of_a_sample_is_marked_once_and_in_order() {
    let mut bench = Bench::enabled();
    let frame = bench.next_feedback();
    bench.wire.to_node.push_back(frame);
    let mut marks = Marks::default();
    bench.now += PERIOD_US;
    bench.node.poll_with(bench.now, &mut bench.wire, &mut marks);
    let mut expected = Phase::ALL.to_vec();
    // After the sample the node has looked for more frames.
    expected.insert(Phase::ALL.len() - 1, Phase::Decode);
    assert_eq!(marks.0, expected);

    let mut marks = Marks::default();
    bench.node.poll_with(bench.now, &mut bench.wire, &mut marks);
    assert_eq!(marks.0, [Phase::Decode, Phase::Report]);
}

/// A jump so slow that an arm that stands still does not stand out.
fn jump() -> MotionRequest {
    MotionRequest::Jump {
        target: [0.6, 0.2, -0.25, 0.0],
        top: -0.2,
        clearance: 0.01,
        speed: 1e-3,
    }
}

/// No call both plans and reports; reports wait for ten samples at the most.
#[test]
fn planning_and_reports_take_turns() {
    let mut bench = Bench::enabled();
    let mut planned = 0;
    for _ in 0..4 {
        let frame = bench.motion(jump());
        bench.wire.to_node.push_back(frame);
    }
    let mut silent = 0;
    for _ in 0..300 {
        let planning = bench.node.controller().is_planning();
        let rests = (bench.sample + 1).is_multiple_of(10);
        let sent = bench.step();
        let reports = sent
            .iter()
            .filter(|message| !matches!(message, Message::Command(_)))
            .count();
        if planning && !rests {
            assert_eq!(reports, 0, "sample {}: {sent:?}", bench.sample);
            planned += 1;
        }
        let state = sent
            .iter()
            .any(|message| matches!(message, Message::State(_)));
        silent = if state { 0 } else { silent + 1 };
        assert!(silent <= 30, "a state every 20 ms, or 10 later");
    }
    assert!(planned > 100);
}

/// A flood of requests is answered one by one; what finds no room is counted, not forgotten.
#[test]
fn answers_that_pile_up_are_sent_or_counted() {
    let mut bench = Bench::enabled();
    let flood = 40;
    let mut answered = 0;
    for _ in 0..flood / 4 {
        for _ in 0..4 {
            let frame = bench.motion(MotionRequest::Stop);
            bench.wire.to_node.push_back(frame);
        }
        answered += replies(&bench.step());
    }
    answered += replies(&bench.run(20));
    assert!(
        answered < flood,
        "the flood is to be more than the outbox holds"
    );
    assert_eq!(answered + usize::from(bench.node.unsent()), flood);
}

fn replies(sent: &[Message]) -> usize {
    sent.iter()
        .filter(|message| matches!(message, Message::MotionReply(_)))
        .count()
}
