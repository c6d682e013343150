//! The state machine: every state and every event, judged by the control word for the drives.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test fails by panicking"
)]

use std::fmt::Write;

use firmware::control::controller::{Config, Controller};
use firmware::control::readings::Readings;
use firmware::control::states::{Event, Halt, State, TRANSITIONS};
use firmware::mechanics::arm::IRB_930;
use firmware::mechanics::dynamics::drive::Drive;
use nalgebra::Vector4;
use protocol::messages::{Cause, Compensation, ControlWord, DriveStatus};
use protocol::time::Period;

#[path = "common/table.rs"]
mod table;

/// The letters of [`EXPECTED`]: control words for the drives.
fn word(letter: char) -> ControlWord {
    let torque = ControlWord::TORQUE_ENABLE;
    let released = torque | ControlWord::BRAKE_RELEASE;
    let stopping = released | ControlWord::QUICK_STOP;
    match letter {
        // Torque off, brake closed.
        'o' => ControlWord::EMPTY,
        // Torque on, brake released.
        'T' => released,
        // The same in a controlled stop.
        'S' => stopping,
        // Torque on, brake closing.
        'B' => torque,
        // The same three in an emergency stop.
        'x' => ControlWord::ESTOP,
        'X' => stopping | ControlWord::ESTOP,
        'C' => torque | ControlWord::ESTOP,
        other => panic!("no control word {other}"),
    }
}

/// Events in the order of the columns of [`EXPECTED`].
const COLUMNS: [Event; 15] = [
    Event::SelfTestPassed,
    Event::PeerReady,
    Event::Enable,
    Event::Disable,
    Event::BrakeOpen,
    Event::BrakeClosed,
    Event::Start,
    Event::Arrived,
    Event::Stop,
    Event::AtRest,
    Event::FaultStop,
    Event::FaultBrake,
    Event::FaultOff,
    Event::EmergencyStop,
    Event::Reset,
];

/// State, how it is reached, and the control word after each event. Written by hand: the intended behaviour of the
/// cabinet.
const EXPECTED: [(&str, &[Event], &str); 14] = {
    use Event::{
        AtRest, BrakeClosed, BrakeOpen, Disable, EmergencyStop, Enable, FaultOff, FaultStop,
        PeerReady, SelfTestPassed, Start, Stop,
    };
    const READY: &[Event] = &[SelfTestPassed, PeerReady];
    [
        // pass peer enable disable open closed start arrived stop rest fault-stop -brake -off estop reset
        ("SelfTest", &[], "ooooooooooooooo"),
        ("PreOperational", &[SelfTestPassed], "oooooooooooooxo"),
        ("Ready", READY, "ooTooooooooooxo"),
        (
            "Enabling",
            &[SelfTestPassed, PeerReady, Enable],
            "TTTBTTTTTTBBoCT",
        ),
        (
            "Enabled",
            &[SelfTestPassed, PeerReady, Enable, BrakeOpen],
            "TTTBTTTTTTSBoXT",
        ),
        (
            "Moving",
            &[SelfTestPassed, PeerReady, Enable, BrakeOpen, Start],
            "TTTTTTTTSTSBoXT",
        ),
        (
            "QuickStop",
            &[SelfTestPassed, PeerReady, Enable, BrakeOpen, Start, Stop],
            "SSSSSSSSSTSBoXS",
        ),
        (
            "Disabling",
            &[SelfTestPassed, PeerReady, Enable, BrakeOpen, Disable],
            "BBBBBoBBBBBBoCB",
        ),
        (
            "FaultStopping",
            &[
                SelfTestPassed,
                PeerReady,
                Enable,
                BrakeOpen,
                Start,
                FaultStop,
            ],
            "SSSSSSSSSBSBoXS",
        ),
        (
            "FaultClosing",
            &[SelfTestPassed, PeerReady, Enable, FaultStop],
            "BBBBBoBBBBBBoCB",
        ),
        (
            "FaultOff",
            &[SelfTestPassed, PeerReady, Enable, FaultOff],
            "oooooooooooooxo",
        ),
        (
            "EStopStopping",
            &[
                SelfTestPassed,
                PeerReady,
                Enable,
                BrakeOpen,
                Start,
                EmergencyStop,
            ],
            "XXXXXXXXXCXCxXX",
        ),
        (
            "EStopClosing",
            &[
                SelfTestPassed,
                PeerReady,
                Enable,
                BrakeOpen,
                EmergencyStop,
                AtRest,
            ],
            "CCCCCxCCCCCCxCC",
        ),
        (
            "EStopOff",
            &[
                SelfTestPassed,
                PeerReady,
                Enable,
                EmergencyStop,
                BrakeClosed,
            ],
            "xxxxxxxxxxxxxxo",
        ),
    ]
};

fn name(state: State) -> &'static str {
    match state {
        State::SelfTest => "SelfTest",
        State::PreOperational => "PreOperational",
        State::Ready => "Ready",
        State::Enabling(_) => "Enabling",
        State::Enabled => "Enabled",
        State::Moving => "Moving",
        State::QuickStop => "QuickStop",
        State::Disabling(_) => "Disabling",
        State::Fault(Halt::Stopping) => "FaultStopping",
        State::Fault(Halt::Closing(_)) => "FaultClosing",
        State::Fault(Halt::Off) => "FaultOff",
        State::EStop(Halt::Stopping) => "EStopStopping",
        State::EStop(Halt::Closing(_)) => "EStopClosing",
        State::EStop(Halt::Off) => "EStopOff",
    }
}

/// A controller after these events, with a sample before torque and one with it; without observer: readings here have no torques.
fn after(events: &[Event]) -> Controller {
    let mut config = Config::new(IRB_930, Period::of_rate(1000.0));
    config.setup.selection.compensation = Compensation::None;
    let mut controller = Controller::new(config);
    for event in events {
        assert!(controller.event(*event), "{event:?} of {events:?}");
        if matches!(event, Event::PeerReady | Event::Enable) {
            controller.step(&obedient(&controller), &mut ());
        }
    }
    controller
}

/// Readings of an arm at rest, whose brake is where it was told to be.
fn obedient(controller: &Controller) -> Readings {
    let is_open = (controller.control_word()).contains(ControlWord::BRAKE_RELEASE);
    let mut readings = at_rest();
    readings.status = readings.status.with(DriveStatus::BRAKE_RELEASED, is_open);
    readings
}

/// The same with a closed brake.
fn at_rest() -> Readings {
    let drive = Drive::new(&IRB_930.drive);
    let q = Vector4::new(0.2, 1.5, 0.15, 0.3);
    Readings {
        steps: 1,
        status: DriveStatus::READY | DriveStatus::TORQUE_ON | DriveStatus::ENCODER_VALID,
        counts: drive.counts_of_motor_angle(&drive.motor_angle(&q)),
        velocity: Vector4::zeros(),
        torque: Vector4::zeros(),
    }
}

#[test]
fn every_event_in_every_state_sends_the_word_that_it_is_to_send() {
    assert_eq!(COLUMNS.len(), Event::ALL.len());
    assert!(Event::ALL.iter().all(|event| COLUMNS.contains(event)));
    for (state, way, words) in EXPECTED {
        assert_eq!(name(after(way).state()), state);
        assert_eq!(words.len(), COLUMNS.len(), "{state}");
        for (event, letter) in COLUMNS.into_iter().zip(words.chars()) {
            let mut controller = after(way);
            controller.event(event);
            assert_eq!(
                controller.control_word(),
                word(letter),
                "{state}, {event:?}: is {:?}, expected {letter}",
                controller.state()
            );
        }
    }
}

/// No state of the table is missing above.
#[test]
fn every_state_is_walked() {
    let mut states: Vec<_> = TRANSITIONS
        .iter()
        .flat_map(|(from, _, to)| [name(*from), name(*to)])
        .collect();
    states.sort_unstable();
    states.dedup();
    let mut walked = EXPECTED.map(|(state, ..)| state);
    walked.sort_unstable();
    assert_eq!(states, walked);
}

/// Whatever has happened, the next command carries the lift or closes its brake: the weight of lift and shaft,
/// 1.95 kg, on motor 3 is m g / (2 pi / 25 mm) = 0.076 N m. In the first half of its time, 30 samples, the brake has not opened yet: torque
/// builds up, also where something else follows meanwhile.
#[test]
fn the_lift_never_falls() {
    let carried = -1.95 * 9.81 / (std::f32::consts::TAU / 0.025);
    for (state, way, _) in EXPECTED {
        for event in Event::ALL {
            let mut controller = after(&[]);
            controller.step(&obedient(&controller), &mut ());
            let mut samples_on = 0;
            let mut events = way.iter().chain([&event]);
            for sample in 0..200 {
                if let Some(event) = events.next() {
                    controller.event(*event);
                }
                let actions = controller.step(&obedient(&controller), &mut ());
                let [_, _, lift, _] = actions.torque;
                let is_on = actions.control.contains(ControlWord::TORQUE_ENABLE);
                samples_on = if is_on { samples_on + 1 } else { 0 };
                if (1..=30).contains(&samples_on) {
                    let built_up = carried * samples_on as f32 / 30.0;
                    assert!(
                        (lift - built_up).abs() < 1e-3,
                        "{sample}: {lift} N m, {built_up}"
                    );
                } else if actions.control.contains(ControlWord::TORQUE_ENABLE) {
                    assert!(
                        (lift - carried).abs() < 0.01 * carried.abs(),
                        "{state}, {event:?}, sample {sample}: {lift} N m, {carried} N m carry the lift"
                    );
                } else {
                    assert!(!actions.control.contains(ControlWord::BRAKE_RELEASE));
                    assert_eq!(actions.torque, [0.0; 4]);
                }
            }
        }
    }
}

/// A brake that is open without torque is told once: at once where the arm was ready, else after its time, 60 samples. No arm is ready with it.
#[test]
fn a_brake_that_does_not_hold_an_arm_without_torque_is_told() {
    let open = Readings {
        status: DriveStatus::READY | DriveStatus::BRAKE_RELEASED | DriveStatus::ENCODER_VALID,
        ..at_rest()
    };
    let closed = Readings {
        status: DriveStatus::READY | DriveStatus::ENCODER_VALID,
        ..open
    };
    for (state, way, _) in EXPECTED {
        let mut controller = after(way);
        let before = controller.state();
        if !matches!(before, State::Ready) && before.halt() != Some(Halt::Off) {
            continue;
        }
        let _ = controller.take_alarm();
        let (patience, halted) = match before {
            State::Ready => (0, State::Fault(Halt::Off)),
            _ => (59, before),
        };
        for _ in 0..patience {
            controller.step(&open, &mut ());
        }
        controller.step(&closed, &mut ());
        for _ in 0..patience {
            controller.step(&open, &mut ());
            assert_eq!(
                (controller.state(), controller.take_alarm()),
                (before, None),
                "{state}"
            );
        }
        controller.step(&open, &mut ());
        let alarm = controller.take_alarm().expect("it is told");
        assert_eq!(
            (alarm.cause, alarm.value()),
            (Cause::DriveFault, 69.0),
            "{state}"
        );
        for _ in 0..200 {
            controller.step(&open, &mut ());
            assert_eq!(
                (controller.state(), controller.take_alarm()),
                (halted, None),
                "{state}"
            );
        }
        // As long as it is open, no reset helps.
        for event in [Event::Reset, Event::PeerReady] {
            assert!(controller.event(event));
        }
        controller.step(&open, &mut ());
        assert_eq!(controller.state(), State::Fault(Halt::Off), "{state}");
        for event in [Event::Reset, Event::PeerReady] {
            assert!(controller.event(event));
        }
        controller.step(&closed, &mut ());
        assert_eq!(controller.state(), State::Ready, "{state}");
        assert!(controller.event(Event::Enable));
    }
}

/// A stop that has begun ends without torque, however it proceeds.
#[test]
fn every_halt_ends_without_torque() {
    for (state, way, _) in EXPECTED {
        let mut controller = after(way);
        if controller.state().halt().is_none() {
            continue;
        }
        for _ in 0..200 {
            controller.step(&obedient(&controller), &mut ());
        }
        assert_eq!(
            controller.state().halt(),
            Some(Halt::Off),
            "{state} does not end"
        );
    }
}

/// The drawing in the docs is the table.
#[test]
fn the_drawing_is_that_of_the_table() {
    let mut drawing = String::from("```mermaid\nstateDiagram-v2\n    [*] --> SelfTest\n");
    let mut drawn = Vec::new();
    for (from, _, to) in TRANSITIONS {
        let arrow = (name(from), name(to));
        if drawn.contains(&arrow) {
            continue;
        }
        drawn.push(arrow);
        let events: Vec<_> = TRANSITIONS
            .iter()
            .filter(|(f, _, t)| (name(*f), name(*t)) == arrow)
            .map(|(_, event, _)| format!("{event:?}"))
            .collect();
        let _ = writeln!(
            drawing,
            "    {} --> {}: {}",
            arrow.0,
            arrow.1,
            events.join(", ")
        );
    }
    drawing += "```\n";
    table::compare("transitions", &drawing);
}
