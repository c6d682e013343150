//! The node's reaction to faults.

use firmware::control::controller::Config;
use firmware::control::fault::{MAX_GAP_MS, REACTIONS};
use firmware::mechanics::arm::IRB_930;
use nalgebra::Vector4;
use protocol::e2e::Profile;
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, DriveStatus, Emergency, KnownAnswer, LimitFlags, Message, Mode, MotionRequest,
    Node as Name, Outcome, State,
};
use protocol::time::Period;

use crate::bench::{Bench, PERIOD, SILENCE, by_itself, estop, heartbeat, is_off};

fn emergencies(sent: &[Message]) -> Vec<Emergency> {
    sent.iter()
        .filter_map(|message| match message {
            Message::Emergency(_, emergency) => Some(*emergency),
            _ => None,
        })
        .collect()
}

pub(crate) fn states(sent: &[Message]) -> Vec<State> {
    sent.iter()
        .filter_map(|message| match message {
            Message::State(state) => Some(*state),
            _ => None,
        })
        .collect()
}

#[test]
fn gaps_up_to_the_limit_are_ridden_out_and_longer_ones_stop_the_arm() {
    for lost in 0..=MAX_GAP_MS + 1 {
        let mut bench = Bench::enabled();
        for _ in 0..lost {
            bench.lose();
        }
        bench.command();
        let expected = if lost < MAX_GAP_MS {
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
    bench.now += SILENCE;
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
    let told = emergency.map(|e| (e.cause, e.code, e.error_register));
    assert_eq!(told, Some((Cause::PeerSilent, 0x8130, 0x11)));
    assert!(is_off(&bench.command()));
}

#[test]
fn following_error_and_drive_faults_stop_the_arm() {
    let mut bench = Bench::enabled();
    // The elbow is pushed 0.1 rad away and comes back slowly.
    bench.velocity[1] = -10.0;
    bench.shove_away();
    bench.step();
    assert_eq!(bench.mode(), Mode::Enabled, "not before the third sample");
    bench.run(2);
    assert_eq!(bench.node.controller().cause(), Cause::FollowingError);
    bench.run(200);
    assert_eq!(bench.mode(), Mode::Fault);
    assert!(is_off(&bench.command()));
    // A reset leads to a state without torque and clears the cause.
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

/// A frame with a valid checksum and a shoulder speed of NaN.
pub(crate) fn not_a_number(good: &CanFrame) -> CanFrame {
    let mut bytes = good.data().to_vec();
    let counter = bytes[bytes.len() - 3];
    bytes[21..25].copy_from_slice(&f32::NAN.to_le_bytes());
    Profile::Fd.protect(0x1C0, counter, &mut bytes);
    CanFrame::fd(good.id(), &bytes, true).unwrap()
}

/// A node that has just met with this cause, and what it has sent; `None` for none.
fn raise(cause: Cause) -> Option<(Bench, Vec<Message>)> {
    let mut bench = match cause {
        Cause::SelfTest => {
            let mut arm = IRB_930;
            arm.payload_max = -1.0;
            Bench::with(Config::new(arm, PERIOD))
        }
        Cause::Overload => {
            // Its weight of 20 N is more than the motor of the lift may hold for ever.
            let mut config = by_itself();
            config.arm.limits.effort_continuous.z = 15.0;
            config.setup.thermal_time = 1.0;
            let mut bench = Bench::with(config);
            bench.enable();
            bench
        }
        _ => Bench::enabled(),
    };
    let repeat = |bench: &mut Bench, frame: CanFrame| {
        bench.wire.to_node.extend([frame; 3]);
        bench.poll()
    };
    let sent = match cause {
        Cause::SelfTest => bench.poll(),
        Cause::FeedbackLost => {
            (0..6).for_each(|_| bench.lose());
            bench.step()
        }
        Cause::Babbling => {
            bench.lose();
            bench.babble(40);
            bench.step()
        }
        Cause::BusOff => {
            bench.node.bus_off();
            bench.step()
        }
        Cause::Overrun => (0..5)
            .flat_map(|_| {
                bench.node.count_overrun();
                bench.step()
            })
            .collect(),
        Cause::PeerSilent => {
            bench.now += SILENCE;
            bench.poll()
        }
        Cause::OperatorSilent => {
            let beat = heartbeat(Name::Operator, Mode::Ready, 0);
            bench.wire.to_node.push_back(beat);
            bench.run(262)
        }
        Cause::Reordered => {
            let frame = bench.next_feedback();
            bench.wire.to_node.push_back(frame);
            repeat(&mut bench, frame)
        }
        Cause::Late => {
            bench.status = bench.status | DriveStatus::COMMAND_LATE;
            bench.run(3)
        }
        Cause::Corrupted => {
            let good = bench.next_feedback();
            let short = CanFrame::fd(good.id(), &good.data()[..32], true).unwrap();
            repeat(&mut bench, short)
        }
        Cause::DuplicateNode => {
            let beat = heartbeat(Name::Controller, Mode::Ready, 3);
            bench.wire.to_node.push_back(beat);
            bench.step()
        }
        Cause::BadValue => {
            let frame = not_a_number(&bench.next_feedback());
            repeat(&mut bench, frame)
        }
        Cause::FollowingError => {
            // 0.2 rad/s, back.
            bench.velocity[1] = -10.0;
            bench.shove_away();
            bench.run(2)
        }
        Cause::StuckSensor => {
            bench.strain();
            bench.run(3)
        }
        Cause::OverSpeed => {
            // 1.1 x 2.2 m/s at 25 mm per turn is 608 rad/s at motor 3.
            bench.velocity[2] = 610.0;
            bench.run(3)
        }
        Cause::OverTorque => {
            // 9 mm, below the limit of the following error and more than the motor can correct; 25 mm per turn.
            bench.position[2] += (0.009 / 0.025 * 131_072.0) as i32;
            // 8 mm/s, back.
            bench.velocity[2] = -2.0;
            bench.run(200)
        }
        Cause::SoftLimit => {
            bench.request(MotionRequest::Disable);
            for step in 1..=100 {
                bench.put(&Vector4::new(0.2, 1.5 + 0.0106 * step as f32, 0.15, 0.3));
                bench.step();
            }
            let frame = bench.motion(MotionRequest::Enable);
            bench.wire.to_node.push_back(frame);
            bench.run(20)
        }
        Cause::EStop => {
            bench.wire.to_node.push_back(estop());
            bench.step()
        }
        Cause::DriveFault => {
            bench.status = bench.status | DriveStatus::FAULT;
            bench.step()
        }
        Cause::EncoderFault => {
            bench.status = DriveStatus::READY;
            bench.step()
        }
        Cause::Collision => {
            // 1.6 m/s from one sample to the next, at rest before.
            bench.velocity[2] = 400.0;
            bench.run(4)
        }
        Cause::Chatter => (0..100)
            .flat_map(|_| {
                // 0.08 rad/s, to and fro.
                bench.velocity[1] = if bench.velocity[1] > 0.0 { -4.0 } else { 4.0 };
                bench.step()
            })
            .collect(),
        Cause::Overload => bench.run(3000),
        Cause::None => return None,
    };
    Some((bench, sent))
}

/// Every cause of the fault table can be raised, is latched, sent once, and repeated in the state with its number.
#[test]
fn every_cause_of_the_table_is_raised_and_reported_in_words() {
    let up = "drive status ready torque-on brake-released";
    for cause in Cause::ALL {
        let in_table = REACTIONS.iter().any(|row| row.cause == *cause);
        let raised = raise(*cause);
        assert_eq!(raised.is_some(), in_table, "{cause}");
        let Some((bench, sent)) = raised else {
            continue;
        };
        assert_eq!(bench.node.controller().cause(), *cause);
        let emergencies = emergencies(&sent);
        assert_eq!(emergencies.len(), 1, "{cause}");
        let state = *states(&sent).last().expect("a state follows at once");
        assert_eq!((emergencies[0].cause, state.cause), (*cause, *cause));
        assert_eq!(emergencies[0].value(), state.fault_value, "{cause}");
        let expected = match cause {
            Cause::SelfTest => format!("self test: {}", KnownAnswer::Model),
            Cause::FeedbackLost => "feedback lost: 7.0 ms, limit 5.0 ms".into(),
            Cause::Babbling => "babbling: 40 frames in a row, limit 32 frames in a row".into(),
            Cause::BusOff => "bus off".into(),
            Cause::Overrun => "overrun: 5 samples in a row, limit 5 samples in a row".into(),
            Cause::PeerSilent => "peer silent: 100.001 ms, limit 100.000 ms".into(),
            Cause::OperatorSilent => "operator silent: 258.0 ms, limit 250.0 ms".into(),
            Cause::Reordered => "reordered: 3 frames in a row".into(),
            Cause::Late => "late: 3 frames in a row".into(),
            Cause::Corrupted => "corrupted: 3 frames in a row".into(),
            Cause::DuplicateNode => "duplicate node: identifier 0x741".into(),
            Cause::BadValue => "bad value: 3 frames in a row".into(),
            Cause::FollowingError => {
                "following error, axis 2 (elbow): -0.100 rad, limit 0.050 rad".into()
            }
            Cause::StuckSensor => "stuck sensor, axis 3 (lift): -9.0 mm, limit 0.5 mm".into(),
            Cause::OverTorque => "over torque, axis 3 (lift): 200.0 ms, limit 200.0 ms".into(),
            Cause::OverSpeed => "over speed, axis 3 (lift): 2.43 m/s, limit 2.42 m/s".into(),
            Cause::SoftLimit => "soft limit, axis 2 (elbow): 2.560 rad, limit 2.551 rad".into(),
            Cause::EStop => "estop".to_owned(),
            Cause::DriveFault => format!("drive fault: {up} fault encoder-valid"),
            Cause::EncoderFault => format!("encoder fault: {up}"),
            Cause::Collision => "collision, axis 3 (lift): 1874.9 N, limit 430.0 N".into(),
            Cause::Chatter => "chatter, axis 2 (elbow): 81 %, limit 80 %".into(),
            Cause::Overload => "overload, axis 3 (lift): 120.3 %, limit 120.0 %".into(),
            _ => String::new(),
        };
        assert_eq!(state.fault().to_string(), expected);
    }
}

/// 1.1 x 12.2 rad/s is 13.4 mrad in a sample, at whatever rate, and twice that where it has got faster before or samples are lost, however
/// many; the following error is allowed 50 mrad.
#[test]
fn a_jump_that_no_axis_can_make_is_a_fault_of_the_encoder() {
    for (rate, lost, before, jump) in [
        (2000.0, 0, 0.0, 0.0067),
        (1000.0, 0, 380.0, 0.0269),
        (1000.0, 1, 0.0, 0.0538),
    ] {
        for (share, expected) in [(0.98, Cause::None), (1.02, Cause::EncoderFault)] {
            let mut bench = Bench::with(Config::new(IRB_930, Period::of_rate(rate)));
            bench.enable();
            bench.run(100);
            bench.velocity[1] = before;
            bench.step();
            (0..lost).for_each(|_| bench.lose());
            bench.shove(share * jump);
            // What the drives make of it: beyond the limit of 1.1 x 12.2 rad/s.
            bench.velocity[1] = 700.0;
            bench.step();
            let cause = bench.node.controller().cause();
            assert_eq!(cause, expected, "{rate} {lost} {before} {share}");
        }
    }
}

/// 9 mm are less than the following error allows, and more than the motor of the lift can correct.
#[test]
fn an_encoder_that_stands_while_its_motor_gives_everything_is_stuck() {
    for (rate, samples) in [(1000.0, 3), (2000.0, 5)] {
        for (velocity, expected) in [(0.0, Cause::StuckSensor), (-2.0, Cause::None)] {
            let mut bench = Bench::with(Config::new(IRB_930, Period::of_rate(rate)));
            bench.enable();
            bench.run(100);
            bench.strain();
            bench.velocity[2] = velocity;
            bench.run(samples - 1);
            assert_eq!(bench.mode(), Mode::Enabled, "{rate} Hz");
            bench.step();
            let cause = bench.node.controller().cause();
            assert_eq!(cause, expected, "{rate} Hz, {velocity} rad/s");
        }
    }
}

/// The arm is stopped after a time, whatever the rate: 5 ms is 10 samples at 2 kHz.
#[test]
fn a_gap_is_judged_by_its_time() {
    for (lost, expected) in [(9, Mode::Enabled), (10, Mode::FaultReaction)] {
        let mut bench = Bench::with(Config::new(IRB_930, Period::of_rate(2000.0)));
        bench.enable();
        bench.run(100);
        assert_eq!(bench.mode(), Mode::Enabled);
        (0..lost).for_each(|_| bench.lose());
        bench.step();
        assert_eq!(bench.mode(), expected, "{lost} lost");
    }
}

/// A limit that has acted in one of twenty samples is in the next report, and only there.
#[test]
fn limits_are_kept_until_they_are_reported() {
    let mut bench = Bench::enabled();
    let mut reports = Vec::new();
    for sample in 0..200 {
        if sample == 50 {
            bench.lose();
        }
        reports.extend(states(&bench.step()).iter().map(|state| state.limits));
    }
    let with = |limits: &&LimitFlags| limits.contains(LimitFlags::PREDICTED);
    assert_eq!(reports.iter().filter(with).count(), 1, "{reports:?}");
}

/// Nothing leaves a failed self-test.
#[test]
fn a_failed_self_test_stays() {
    let (mut bench, _) = raise(Cause::SelfTest).unwrap();
    bench.hello(protocol::table::HASH);
    bench.wire.to_node.push_back(estop());
    bench.run(5);
    bench.request(MotionRequest::Stop);
    bench.request(MotionRequest::FaultReset);
    bench.request(MotionRequest::Enable);
    assert_eq!(bench.mode(), Mode::SelfTest);
    let sent = bench.run(100);
    assert!(emergencies(&sent).is_empty(), "it has been said");
    assert_eq!(states(&sent)[0].fault().to_string(), "self test: model");
}
