//! Switching on and off, and emergency stops.

use nalgebra::Vector4;
use protocol::messages::{
    Cause, ControlWord, DriveStatus, Message, Mode, MotionRequest, Outcome, RefusalReason,
};
use protocol::table;

use crate::bench::{Bench, SILENCE, estop, is_off};
use crate::faults::{not_a_number, states};

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
    let both = ControlWord::TORQUE_ENABLE | ControlWord::BRAKE_RELEASE;
    // The weight of lift and shaft, 1.95 kg, on motor 3: m g / (2 pi / 25 mm), within the
    // feedback's share for half a count. It builds up in the 30 ms that are half of the brake's time.
    let carried = 1.95 * 9.81 / (std::f32::consts::TAU / 0.025);
    let shares: Vec<f32> = (0..50)
        .map(|_| {
            let opening = bench.command();
            assert!(opening.control.contains(both));
            -opening.torque[2] / carried
        })
        .collect();
    assert!(shares[0] < 0.1, "{shares:?}");
    let steps = shares.windows(2).map(|two| two[1] - two[0]);
    assert!(steps.clone().all(|step| step.abs() < 0.04), "{shares:?}");
    let full = |share: &f32| (share - 1.0).abs() < 0.01;
    assert!(shares[30..].iter().all(full), "{shares:?}");
    bench.run(100);
    assert_eq!(bench.mode(), Mode::Enabled);
    assert_eq!(
        bench.request(MotionRequest::Disable),
        Some(Outcome::Accepted)
    );
    assert_eq!(bench.mode(), Mode::Ready);
    assert!(is_off(&bench.command()));
}

/// Before anybody has said what table he has.
#[test]
fn a_node_without_peers_knows_where_the_arm_is() {
    let mut bench = Bench::new();
    bench.step();
    assert_eq!(bench.mode(), Mode::PreOperational);
    let q = bench.node.controller().reference().q;
    let off = q - Vector4::new(0.2, 1.5, 0.15, 0.3);
    assert!(off.amax() < 1e-5, "{q}");
}

/// Two samples beyond the margin of the elbow, 2.531 + 0.02 rad, were the last ones with torque; they do not count for what begins anew.
#[test]
fn switching_on_counts_violations_from_the_beginning() {
    let mut bench = Bench::new();
    bench.put(&Vector4::new(0.2, 2.54, 0.15, 0.3));
    bench.enable();
    let disable = bench.motion(MotionRequest::Disable);
    bench.wire.to_node.push_back(disable);
    // Of the 60 ms of the brake.
    bench.run(58);
    bench.shove(0.015);
    bench.run(1);
    assert_eq!(bench.mode(), Mode::Disabling);
    bench.run(1);
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Ready, Cause::None)
    );
    let enable = bench.motion(MotionRequest::Enable);
    bench.wire.to_node.push_back(enable);
    let mut course = Vec::new();
    for _ in 0..3 {
        bench.step();
        course.push(bench.node.controller().cause());
    }
    assert_eq!(course, [Cause::None, Cause::None, Cause::SoftLimit]);
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
    // Nobody has said anything of a table.
    assert_eq!(
        bench.refusal(MotionRequest::Enable),
        RefusalReason::WrongState
    );
    assert_eq!(
        bench.refusal(MotionRequest::FaultReset),
        RefusalReason::WrongState
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
    // The second one is not a replay of the first.
    assert_eq!(
        bench.request(MotionRequest::Enable),
        Some(Outcome::Accepted)
    );
}

#[test]
fn a_replayed_enable_is_dropped() {
    let (mut bench, enable) = Bench::asked_to_enable();
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
fn an_emergency_stop_is_latched() {
    let mut bench = Bench::enabled();
    bench.wire.to_node.push_back(estop());
    bench.step();
    assert_eq!(bench.mode(), Mode::EStop);
    // The lift is never dropped: the brake closes before torque goes off.
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

/// It may be moved by hand, but needs sound drives, and encoders that do not jump.
#[test]
fn an_arm_that_is_ready_is_watched() {
    let fault = |bench: &mut Bench| bench.status = bench.status | DriveStatus::FAULT;
    let jumped = |bench: &mut Bench| bench.shove(0.1);
    for harm in [fault, jumped] {
        let mut bench = Bench::new();
        bench.hello(table::HASH);
        for _ in 0..20 {
            bench.shove(0.02);
            bench.step();
        }
        assert_eq!(bench.mode(), Mode::Ready);
        harm(&mut bench);
        bench.step();
        assert_ne!(bench.mode(), Mode::Ready);
    }
}

/// The brake takes 60 ms to open. Until the drives are first on they may be late; then they have to stay on.
#[test]
fn drives_that_let_go_while_the_brake_opens_are_told_at_once() {
    for late in [0, 20] {
        let (mut bench, _) = Bench::asked_to_enable();
        bench.obeys = false;
        bench.run(1 + late);
        bench.obeys = true;
        bench.run(20);
        let controller = bench.node.controller();
        let found = (controller.mode(), controller.cause());
        assert_eq!(found, (Mode::Enabling, Cause::None));
        bench.obeys = false;
        bench.step();
        assert_eq!(bench.node.controller().cause(), Cause::DriveFault);
    }
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
    bench.now += SILENCE;
    bench.poll();
    assert_eq!(bench.mode(), Mode::EStop);
    let word = bench.node.controller().control_word();
    assert_eq!(word, ControlWord::ESTOP);
}

/// Nothing is to be stopped in ready, but what is broken stays so: the arm is not ready again by itself, though the cause has gone.
#[test]
fn a_fault_of_an_arm_that_is_ready_stays_until_it_is_reset() {
    type Harm = fn(&mut Bench);
    let harms: [(Cause, Harm); 5] = [
        (Cause::EncoderFault, |bench| bench.shove(0.03)),
        (Cause::EncoderFault, |bench| {
            bench.status = DriveStatus::READY;
        }),
        (Cause::DriveFault, |bench| {
            bench.status = bench.status | DriveStatus::FAULT;
        }),
        (Cause::BadValue, |bench| {
            let frame = not_a_number(&bench.next_feedback());
            bench.wire.to_node.extend([frame; 3]);
        }),
        (Cause::PeerSilent, |bench| {
            bench.now += SILENCE;
            bench.poll();
        }),
    ];
    for (cause, harm) in harms {
        let (mut bench, enable) = Bench::asked_to_enable();
        bench.wire.to_node.clear();
        bench.run(10);
        assert_eq!(bench.mode(), Mode::Ready);
        let sound = bench.status;
        harm(&mut bench);
        bench.step();
        bench.status = sound;
        let sent = bench.run(50);
        assert!(states(&sent).iter().all(|it| it.cause == cause), "{cause}");
        assert_eq!(bench.mode(), Mode::Fault, "{cause}");
        bench.wire.to_node.push_back(enable);
        assert!(is_off(&bench.command()), "{cause}");
        let reset = bench.request(MotionRequest::FaultReset);
        assert_eq!(reset, Some(Outcome::Accepted), "{cause}");
        // Drives that were silent have to be known anew.
        let expected = match cause {
            Cause::PeerSilent => Mode::PreOperational,
            _ => Mode::Ready,
        };
        assert_eq!(bench.mode(), expected, "{cause}");
    }
}

/// Its time is 60 ms, and it has as much again: nothing is enabled that may be held, also when it was enabled before.
#[test]
fn a_brake_that_does_not_open_is_told_and_lets_nothing_be_enabled() {
    for again in [false, true] {
        let mut bench = Bench::asked_to_enable().0;
        if again {
            bench.run(100);
            bench.request(MotionRequest::Disable);
            let enable = bench.motion(MotionRequest::Enable);
            bench.wire.to_node.push_back(enable);
        }
        assert_eq!(bench.mode(), Mode::Ready);
        bench.opens = false;
        let mut opening = 0;
        loop {
            bench.step();
            match bench.mode() {
                Mode::Ready => {}
                Mode::Enabling => opening += 1,
                Mode::FaultReaction => break,
                other => panic!("{other:?} after {opening} samples"),
            }
        }
        assert!((110..=122).contains(&opening), "{opening}");
        let fault = *bench.node.controller().fault();
        assert_eq!(
            fault.to_string(),
            "drive fault: drive status ready torque-on encoder-valid, not brake-released"
        );
        bench.run(100);
        assert_eq!(bench.mode(), Mode::Fault);
        assert!(is_off(&bench.command()));
    }
}

/// A command that was lost on the way, or a brake that is slow.
#[test]
fn a_brake_that_opens_late_is_waited_for() {
    let mut bench = Bench::asked_to_enable().0;
    bench.opens = false;
    bench.run(100);
    assert_eq!(bench.mode(), Mode::Enabling);
    bench.opens = true;
    bench.run(2);
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Enabled, Cause::None)
    );
}

/// Before the axis shows that it is held.
#[test]
fn a_brake_that_closes_by_itself_is_told_at_once() {
    for mut bench in [Bench::enabled(), Bench::moving()] {
        bench.opens = false;
        let command = bench.command();
        assert_eq!(command.control, ControlWord::TORQUE_ENABLE);
        assert_eq!(bench.node.controller().cause(), Cause::DriveFault);
    }
}

/// The first feedback says so: nobody can switch on before it is told, which takes the time of the brake, as it may be on its way.
#[test]
fn an_arm_whose_brake_is_open_is_not_ready() {
    let mut bench = Bench::new();
    bench.status = bench.status | DriveStatus::BRAKE_RELEASED;
    bench.hello(table::HASH);
    bench.run(50);
    assert_eq!(bench.mode(), Mode::PreOperational);
    bench.status = bench.status.with(DriveStatus::BRAKE_RELEASED, false);
    bench.run(2);
    assert_eq!(bench.mode(), Mode::Ready);
    bench.status = bench.status | DriveStatus::BRAKE_RELEASED;
    bench.step();
    assert_eq!(
        (bench.mode(), bench.node.controller().cause()),
        (Mode::Fault, Cause::DriveFault)
    );

    // Nor does anybody have to have greeted: a controller may have been started anew under an arm that goes down.
    for is_greeted in [true, false] {
        let mut bench = Bench::new();
        bench.status = bench.status | DriveStatus::BRAKE_RELEASED;
        if is_greeted {
            bench.hello(table::HASH);
        }
        for _ in 0..62 {
            bench.step();
            assert_ne!(bench.mode(), Mode::Ready);
        }
        assert_eq!(
            (bench.mode(), bench.node.controller().cause()),
            (Mode::Fault, Cause::DriveFault),
            "{is_greeted}"
        );
    }
}
