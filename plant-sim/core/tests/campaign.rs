//! The judge of campaigns: a sound controller holds what is promised, and a controller with a planted defect is found out.
//!
//! A campaign that finds nothing proves nothing. Each defect here is one that a real controller could have; it sits in the
//! configuration, or in a wrapper around the controller that spoils what it hears and says.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::BTreeSet;

use firmware::control::controller::Config;
use protocol::codec::{self, Encoder};
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, Command, ControlWord, DriveStatus, Emergency, Feedback, Message, Node, ResetReason,
};
use protocol::time::{Duration, Instant};
use sim::campaign::bounds::Bounds;
use sim::campaign::trial;
use sim::campaign::verdict::{Requirement, Verdict};
use sim::controller::InProcess;
use sim::model::RobotModel;
use sim::peer::{Outbox, Peer, PeerError};
use sim::scenario::{PayloadSpec, Scenario};
use sim::setup::RunConfig;
use sim::world::World;

/// What is wrong with a controller.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Defect {
    // In the configuration.
    FollowingErrorUnwatched,
    SlowMonitor,
    BadFramesIgnored,
    OneBadFrameStops,
    NoGapBridged,
    SpeedLimitTooLow,
    NoWaitForTheBrake,
    // In what it commands.
    StopForgotten,
    StopLate,
    BrakeForgotten,
    BrakeLate,
    TorqueStaysOn,
    TorqueBeyondTheLimit,
    TorqueNotEnabled,
    MovesAfterStandstill,
    // In what it reports.
    Mute,
    LateReport,
    FalseReport,
    Misnamed,
    // In what it hears.
    BrakeUnwatched,
    DamageUnseen,
    OldFramesTaken,
    Distracted,
    // In what it remembers.
    Forgetful,
}

/// Each with the requirement that it breaks.
const DEFECTS: [(Defect, Requirement); 24] = [
    (Defect::FollowingErrorUnwatched, Requirement::Reported),
    (Defect::SlowMonitor, Requirement::Reported),
    (Defect::BadFramesIgnored, Requirement::Detected),
    (Defect::OneBadFrameStops, Requirement::NoFalseAlarm),
    (Defect::NoGapBridged, Requirement::NoFalseAlarm),
    (Defect::SpeedLimitTooLow, Requirement::NoFalseAlarm),
    (Defect::NoWaitForTheBrake, Requirement::Drop),
    (Defect::StopForgotten, Requirement::Reaction),
    (Defect::StopLate, Requirement::Reaction),
    (Defect::BrakeForgotten, Requirement::Drop),
    (Defect::BrakeLate, Requirement::Drop),
    (Defect::TorqueStaysOn, Requirement::Standstill),
    (Defect::TorqueBeyondTheLimit, Requirement::Torque),
    (Defect::TorqueNotEnabled, Requirement::Torque),
    (Defect::MovesAfterStandstill, Requirement::Latch),
    (Defect::Mute, Requirement::Detected),
    (Defect::LateReport, Requirement::Detected),
    (Defect::FalseReport, Requirement::NoFalseAlarm),
    (Defect::Misnamed, Requirement::Cause),
    (Defect::BrakeUnwatched, Requirement::Detected),
    (Defect::DamageUnseen, Requirement::Detected),
    (Defect::OldFramesTaken, Requirement::Detected),
    (Defect::Distracted, Requirement::NoFalseAlarm),
    (Defect::Forgetful, Requirement::Latch),
];

/// A controller with a defect.
struct Planted {
    controller: InProcess,
    defect: Option<Defect>,
    encoder: Encoder,
    /// Of frames that it hears differently.
    ears: Encoder,
    heard: Option<Feedback>,
    /// When it first commanded a stop, and when it first left torque off after it.
    stopped: Option<Instant>,
    off: Option<Instant>,
    was_powered: bool,
    /// Whether it means the brake to be open.
    releases: bool,
    done: bool,
}

impl Planted {
    fn new(mut config: Config, defect: Option<Defect>) -> Self {
        let setup = &mut config.setup;
        match defect {
            Some(Defect::FollowingErrorUnwatched) => setup.monitor.following_error.fill(100.0),
            Some(Defect::SlowMonitor) => setup.monitor.samples = 30,
            Some(Defect::BadFramesIgnored) => setup.bad_frames = 1000,
            Some(Defect::OneBadFrameStops) => setup.bad_frames = 1,
            Some(Defect::NoGapBridged) => setup.monitor.gap = 0.001,
            Some(Defect::SpeedLimitTooLow) => setup.monitor.speed_factor = 0.2,
            Some(Defect::NoWaitForTheBrake) => setup.brake_delay = 0.001,
            _ => {}
        }
        Self {
            controller: InProcess::new(config),
            defect,
            encoder: Encoder::default(),
            ears: Encoder::default(),
            heard: None,
            stopped: None,
            off: None,
            was_powered: false,
            releases: false,
            done: false,
        }
    }

    /// What it hears instead of `frame`.
    fn hear(&mut self, now: Instant, frame: CanFrame) -> CanFrame {
        let received = codec::decode(&frame).map(|received| received.message);
        let again = match (self.defect, received) {
            (Some(Defect::DamageUnseen), Err(_)) => self.heard.map(|mut last| {
                last.sample = last.sample.wrapping_add(1);
                last
            }),
            (Some(Defect::DamageUnseen), Ok(Message::Feedback(feedback))) => Some(feedback),
            (Some(Defect::OldFramesTaken), Ok(Message::Feedback(mut feedback))) => {
                feedback.sample = self.heard.map_or(feedback.sample, |last| last.sample + 1);
                Some(feedback)
            }
            // A brake that it looked at would not be let go of.
            (
                Some(
                    Defect::NoWaitForTheBrake
                    | Defect::BrakeForgotten
                    | Defect::BrakeLate
                    | Defect::BrakeUnwatched,
                ),
                Ok(Message::Feedback(mut feedback)),
            ) => {
                let released = DriveStatus::BRAKE_RELEASED;
                feedback.status = feedback.status.with(released, self.releases);
                Some(feedback)
            }
            (Some(Defect::Distracted), Ok(Message::Feedback(_)))
                if (0.5..0.503).contains(&now.seconds()) =>
            {
                let mut damaged = frame.data().to_vec();
                damaged[0] ^= 1;
                return CanFrame::fd(frame.id(), &damaged, frame.brs()).unwrap();
            }
            _ => None,
        };
        let Some(feedback) = again else { return frame };
        self.heard = Some(feedback);
        self.ears.encode(&Message::Feedback(feedback)).unwrap()
    }

    /// What it says instead of `frame`, and when.
    fn say(&mut self, time: Instant, frame: CanFrame, out: &mut Outbox) {
        match codec::decode(&frame).unwrap().message {
            Message::Command(command) => {
                let command = self.command(time, command);
                let frame = self.encoder.encode(&Message::Command(command)).unwrap();
                out.push((time, frame));
                if self.defect == Some(Defect::FalseReport) && time.seconds() > 0.5 && !self.done {
                    self.done = true;
                    let false_alarm = Emergency::new(Cause::Corrupted, 0);
                    let message = Message::Emergency(Node::Controller, false_alarm);
                    out.push((time, self.encoder.encode(&message).unwrap()));
                }
            }
            Message::Emergency(..) if self.defect == Some(Defect::Mute) => {}
            Message::Emergency(..) if self.defect == Some(Defect::Misnamed) => {
                let message =
                    Message::Emergency(Node::Controller, Emergency::new(Cause::Overload, 0));
                out.push((time, self.encoder.encode(&message).unwrap()));
            }
            Message::Emergency(..) if self.defect == Some(Defect::LateReport) => {
                out.push((time + Duration::from_millis(10), frame));
            }
            _ => out.push((time, frame)),
        }
    }

    fn command(&mut self, time: Instant, mut command: Command) -> Command {
        let (torque, brake) = (ControlWord::TORQUE_ENABLE, ControlWord::BRAKE_RELEASE);
        let sound = command.control;
        self.was_powered |= sound.contains(torque);
        self.releases = sound.contains(brake);
        if self.was_powered && sound.contains(ControlWord::QUICK_STOP) {
            self.stopped.get_or_insert(time);
        }
        if self.stopped.is_some() && !sound.contains(torque) {
            self.off.get_or_insert(time);
        }
        let later = |since: Option<Instant>, ms| {
            since.is_some_and(|since| time.since(since) >= Duration::from_millis(ms))
        };
        match self.defect {
            Some(Defect::StopForgotten) if self.stopped.is_some() && !later(self.stopped, 300) => {
                command.control = torque.with(brake, true);
            }
            Some(Defect::StopLate) if self.stopped.is_some() && !later(self.stopped, 3) => {
                command.control = torque.with(brake, true);
            }
            Some(Defect::BrakeForgotten) if self.stopped.is_some() => {
                command.control = sound.with(brake, true);
            }
            Some(Defect::BrakeLate) if self.stopped.is_some() && !later(self.off, 20) => {
                command.control = sound.with(brake, true);
            }
            Some(Defect::TorqueStaysOn) if self.off.is_some() => {
                command.control = sound.with(torque, true);
            }
            Some(Defect::TorqueBeyondTheLimit) => {
                command.torque = command.torque.map(|torque| 1.5 * torque);
            }
            Some(Defect::TorqueNotEnabled) if !sound.contains(torque) => {
                command.torque[0] = 0.01;
            }
            Some(Defect::MovesAfterStandstill) if later(self.off, 20) && !later(self.off, 30) => {
                command.control = torque;
                command.torque[1] = 1.0;
            }
            _ => {}
        }
        command
    }
}

impl Peer for Planted {
    fn wake(&self) -> Option<Instant> {
        self.controller.wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let received = received.map(|frame| self.hear(now, *frame));
        let mut said = Outbox::new();
        self.controller
            .poll(now, received.as_ref(), world, &mut said)?;
        for (time, frame) in said {
            self.say(time, frame, out);
        }
        if self.defect == Some(Defect::Forgetful)
            && !self.done
            && self
                .off
                .is_some_and(|off| now.since(off) > Duration::from_millis(5))
        {
            self.done = true;
            self.controller.restart(ResetReason::Software);
        }
        Ok(())
    }
}

fn judge(fault: &str, payload: f64, defect: Option<Defect>) -> Verdict {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    scenario.payload = Some(PayloadSpec::compact(payload));
    scenario.faults = match fault {
        "none" => Vec::new(),
        fault => vec![fault.parse().unwrap()],
    };
    let connect = |config| Ok(Planted::new(config, defect));
    let (verdict, ..) = trial::run(&RunConfig::new(scenario), connect, &mut ()).unwrap();
    verdict
}

/// A small campaign: every kind of detection and reaction once.
const CASES: [(&str, f64); 14] = [
    ("none", 2.0),
    ("feedback:loss@0.45s..0.452s", 2.0),
    ("feedback:corrupt@0.45s..0.452s", 2.0),
    ("feedback:corrupt@0.45s..0.454s", 22.0),
    ("feedback:corrupt@0.45s..0.462s", 22.0),
    ("feedback:corrupt@0.7s..0.712s", 22.0),
    ("feedback:replay=8@0.45s..0.462s", 22.0),
    // At rest, where old positions are as good as new ones.
    ("feedback:replay=8@0.25s..0.262s", 22.0),
    ("feedback:loss@0.45s..0.456s", 22.0),
    ("encoder:elbow:jump=0.07@0.45s", 2.0),
    ("encoder:elbow:jump=0.5@0.45s", 22.0),
    ("motor:elbow:dead@0.4s", 2.0),
    ("drives:silent@0.45s", 22.0),
    ("brake:stuck@0.45s", 22.0),
];

fn missed(defect: Option<Defect>) -> BTreeSet<Requirement> {
    let verdicts = CASES.map(|(fault, payload)| judge(fault, payload, defect));
    verdicts.into_iter().flat_map(|one| one.missed).collect()
}

#[test]
fn a_sound_controller_misses_nothing() {
    for (fault, payload) in CASES {
        let verdict = judge(fault, payload, None);
        assert!(verdict.missed.is_empty(), "{fault}: {verdict:?}");
    }
}

#[test]
fn every_planted_defect_is_found_for_what_it_breaks() {
    for (defect, requirement) in DEFECTS {
        let missed = missed(Some(defect));
        assert!(
            missed.contains(&requirement),
            "{defect:?} breaks {requirement:?}, and the judge found {missed:?}"
        );
    }
}

#[test]
fn a_verdict_gives_the_consequence() {
    let verdict = judge("encoder:elbow:jump=0.5@0.45s", 2.0, None);
    assert_eq!(verdict.detected.as_deref(), Some("encoder-fault"));
    // Seen in the sample in which the reading jumps, and reported within it.
    assert!(verdict.detection_ms.is_some_and(|ms| ms <= 1.0));
    assert!(verdict.standstill_ms > verdict.detection_ms);
    assert!(verdict.distance_mm > Some(0.0) && verdict.energy_j > Some(0.0));
    let survived = judge("feedback:loss@0.45s..0.452s", 2.0, None);
    assert!(survived.survived && survived.detected.is_none());
    assert_eq!(survived.distance_mm, None);
}

/// Where nothing begins, nothing can be counted from its beginning.
#[test]
fn a_stop_without_a_fault_has_no_time_of_detection() {
    let verdict = judge("none", 2.0, Some(Defect::FalseReport));
    assert_eq!(verdict.detected.as_deref(), Some("corrupted"));
    assert!(verdict.missed.contains(&Requirement::NoFalseAlarm));
    assert_eq!(verdict.detection_ms, None);
    assert_eq!(verdict.standstill_ms, None);
}

/// What is told at 0.5 s is not the fault of 0.7 s, whatever that may lead to.
#[test]
fn what_is_told_before_the_fault_begins_is_a_false_alarm() {
    for fault in ["motor:elbow:dead@0.7s", "brake:slow=0.02@0.7s"] {
        let sound = judge(fault, 2.0, None);
        assert!(!sound.missed.contains(&Requirement::NoFalseAlarm));
        let verdict = judge(fault, 2.0, Some(Defect::FalseReport));
        assert_eq!(verdict.detected.as_deref(), Some("corrupted"));
        assert!(verdict.missed.contains(&Requirement::NoFalseAlarm));
        assert_eq!(verdict.detection_ms, None);
    }
}

/// Worked out by hand for 22 kg, from rest: 23.95 kg and 8.21 kg of rotor, 860 N and 235 N of weight. 8 ms at 34.0 m/s2 are 1.1 mm
/// and 0.27 m/s; 30 ms of free fall from there 12.6 mm and 0.57 m/s; to stop that at 19.4 m/s2 takes 8.3 mm. From 1 m/s:
/// 9.1 mm, 42.6 mm and 63.1 mm. The stretched arm has 39.0 kg m2 about the shoulder, rotor and load included; 7.68 rad/s are gone after
/// 7.68 x 39.0 / 640 + 0.01 s, of which 1.25 times is the bound.
#[test]
fn bounds_are_those_worked_out_by_hand() {
    let mut bounds = Bounds::new(&RobotModel::irb_930_22_105(), 1e-3);
    bounds.carry(&PayloadSpec::compact(22.0).into());
    assert!(
        (bounds.drop(0.0) - 0.0220).abs() < 1e-4,
        "{}",
        bounds.drop(0.0)
    );
    assert!(
        (bounds.drop(1.0) - 0.1148).abs() < 3e-4,
        "{}",
        bounds.drop(1.0)
    );
    assert!((bounds.stop_s() - 0.598).abs() < 1e-3);
    assert!((bounds.torque_off_s() - 0.666).abs() < 1e-3);
}
