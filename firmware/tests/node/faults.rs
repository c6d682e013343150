//! What the node makes of faults.

use firmware::control::fault::MAX_GAP_MS;
use firmware::node::PEER_TIMEOUT_US;
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Message, Mode, MotionRequest, Outcome};

use crate::bench::{Bench, PERIOD_US, is_off};

#[test]
fn gaps_up_to_the_limit_are_ridden_out_and_longer_ones_stop_the_arm() {
    for lost in 0..=MAX_GAP_MS + 1 {
        let mut bench = Bench::enabled();
        for _ in 0..lost {
            bench.next_feedback();
            bench.now += PERIOD_US;
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
