//! Manual operation: nothing moves without a hold, and nothing fast.

use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use nalgebra::Vector4;
use protocol::codec::encode;
use protocol::messages::{
    Cause, Message, Mode, Motion, MotionRequest, Operation, Outcome, Posture, Refusal,
    RefusalReason,
};

use crate::bench::{Bench, by_itself};
use crate::faults::states;

/// mm/s of ISO 10218-1, in m/s, and how far from the axis of the flange it holds.
const LIMIT: f64 = 0.25;
const REACH: f64 = 0.1;

const FAR: [f32; 4] = [-1.0, 0.5, 0.05, -2.0];

/// Under torque in manual operation, with an arm that follows.
fn manual() -> Bench {
    manual_with(by_itself())
}

fn manual_with(config: Config) -> Bench {
    let mut bench = Bench::with(config);
    bench.enable();
    bench.follows = true;
    assert_eq!(
        bench.request(set(Operation::Manual)),
        Some(Outcome::Accepted)
    );
    bench
}

pub(crate) fn set(operation: Operation) -> MotionRequest {
    MotionRequest::SetOperation { operation }
}

/// Samples with a hold in every 50th, as long as it goes on.
pub(crate) fn hold(bench: &mut Bench, samples: usize) -> Vec<Message> {
    let mut sent = Vec::new();
    for sample in 0..samples {
        if sample % 50 == 0 {
            let frame = bench.motion(MotionRequest::Hold);
            bench.wire.to_node.push_back(frame);
        }
        sent.extend(bench.step());
    }
    sent
}

pub(crate) fn go(bench: &mut Bench, target: [f32; 4]) {
    let to = MotionRequest::MoveJoint {
        target,
        speed: 1.0,
        zone: 0.0,
    };
    assert_eq!(bench.request(to), Some(Outcome::Accepted));
}

pub(crate) fn here(bench: &Bench) -> Vector4<f32> {
    bench.node.controller().reference().q
}

fn stands(bench: &Bench) -> bool {
    let reference = bench.node.controller().reference();
    (reference.qd, reference.qdd) == Default::default()
}

/// Points of the tool all around the flange, by the chain of the two arms.
fn points(q: &Vector4<f32>) -> [[f64; 3]; 8] {
    let [one, two, lift, wrist] = [0, 1, 2, 3].map(|axis| f64::from(q[axis]));
    let geometry = &IRB_930.geometry;
    let (a, b) = (f64::from(geometry.a1), f64::from(geometry.a2));
    std::array::from_fn(|k| {
        let yaw = one + two - wrist + k as f64 * std::f64::consts::FRAC_PI_4;
        [
            a * one.cos() + b * (one + two).cos() + REACH * yaw.cos(),
            a * one.sin() + b * (one + two).sin() + REACH * yaw.sin(),
            lift,
        ]
    })
}

/// The fastest of them from one sample to the next, m/s.
fn speed(before: &Vector4<f32>, after: &Vector4<f32>) -> f64 {
    let way = |(a, b): (&[f64; 3], &[f64; 3])| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let pairs = points(before);
    let ways = pairs
        .iter()
        .zip(&points(after))
        .map(way)
        .fold(0.0, f64::max);
    ways * 1e3
}

#[test]
fn nothing_moves_that_is_not_held() {
    let mut bench = manual();
    let start = here(&bench);
    go(&mut bench, FAR);
    bench.run(2000);
    assert_eq!((bench.mode(), here(&bench)), (Mode::Moving, start));
    hold(&mut bench, 600);
    let (held, moved) = (here(&bench), (here(&bench) - start).amax());
    assert!(moved > 0.05, "{moved}");
    // The last hold was 50 samples ago: 100 are left of it, and a slow arm stops within some more.
    bench.run(130);
    assert!(stands(&bench), "{:?}", bench.node.controller().reference());
    let rest = here(&bench);
    assert!((rest - held).amax() < 0.13 * 0.6, "{}", rest - held);
    let last = *states(&bench.run(2000)).last().unwrap();
    assert_eq!((last.pace, last.operation), (0, Operation::Manual));
    assert_eq!((here(&bench), bench.mode()), (rest, Mode::Moving));
    // It goes on where it is, to where the same move ends in automatic operation.
    hold(&mut bench, 12_000);
    assert_eq!(bench.mode(), Mode::Enabled);
    assert!((here(&bench) - Vector4::from(FAR)).amax() < 1e-5);
}

/// By points of the tool and not by its Jacobian; moves of every kind, one after the other, at whatever override.
#[test]
fn no_point_of_the_tool_is_planned_faster_than_nine_tenths_of_the_limit() {
    let pose = |x, y, z| [x, y, z, 1.0];
    let posture = Posture::NEAREST;
    let line = |target| MotionRequest::MoveLine {
        target,
        speed: 1.0,
        posture,
        tool_speed: 0.0,
        zone: 0.0,
    };
    let jump = |target| MotionRequest::Jump {
        target,
        top: -0.24,
        clearance: 0.0,
        speed: 1.0,
        posture,
        zone: 0.0,
    };
    let joint = |target| MotionRequest::MoveJoint {
        target,
        speed: 1.0,
        zone: 0.0,
    };
    for (name, requests) in [
        (
            "joints",
            vec![joint(FAR), joint([1.5, -1.0, 0.3, 2.0]), joint([0.0; 4])],
        ),
        ("wrist", vec![joint([0.2, 1.5, 0.15, 3.0])]),
        ("lift", vec![joint([0.2, 1.5, 0.01, 0.3])]),
        (
            "lines",
            vec![line(pose(0.5, 0.4, -0.3)), line(pose(0.3, 0.6, -0.2))],
        ),
        (
            "jumps",
            vec![jump(pose(0.5, -0.4, -0.30)), jump(pose(0.7, 0.2, -0.28))],
        ),
        (
            "override",
            vec![MotionRequest::SetOverride { pace: 0.9 }, joint(FAR)],
        ),
    ] {
        let mut bench = manual();
        for request in requests {
            let frame = bench.motion(request);
            bench.wire.to_node.push_back(frame);
            bench.step();
        }
        let (mut fastest, mut before) = (0.0f64, here(&bench));
        for sample in 0..30_000 {
            if sample % 50 == 0 {
                let frame = bench.motion(MotionRequest::Hold);
                bench.wire.to_node.push_back(frame);
            }
            for message in bench.step() {
                if let Message::MotionReply(reply) = message {
                    assert_eq!(reply.outcome, Outcome::Accepted, "{name}");
                }
            }
            let now = here(&bench);
            fastest = fastest.max(speed(&before, &now));
            before = now;
        }
        assert_eq!(
            (bench.mode(), bench.node.controller().queued()),
            (Mode::Enabled, 0),
            "{name}"
        );
        // Not for nothing slow: positions in f32 are 0.1 um, 0.1 mm/s in a sample.
        assert!(
            (0.5 * LIMIT..0.9 * LIMIT + 5e-4).contains(&fastest),
            "{name}: {fastest}"
        );
    }
}

/// A hold is a sign of life: answered only where it has no effect, and never taken from a replay.
#[test]
fn a_hold_is_refused_where_it_has_no_effect() {
    let mut bench = manual();
    assert_eq!(bench.request(MotionRequest::Hold), None);
    assert_eq!(
        bench.request(set(Operation::Automatic)),
        Some(Outcome::Accepted)
    );
    assert_eq!(
        bench.refusal(MotionRequest::Hold),
        RefusalReason::WrongState
    );
    bench.request(set(Operation::Manual));
    bench.request(MotionRequest::Disable);
    assert_eq!(
        bench.refusal(MotionRequest::Hold),
        RefusalReason::NotEnabled
    );
    // A hold from before is none after.
    bench.request(MotionRequest::Enable);
    bench.run(100);
    go(&mut bench, FAR);
    bench.run(1000);
    assert!(stands(&bench));

    // An operator who is heard for the first time: this may be a recorded frame.
    let mut bench = Bench::with(by_itself());
    bench.run(5);
    let frame = bench.motion(MotionRequest::Hold);
    bench.wire.to_node.push_back(frame);
    let refused = Outcome::Refused(Refusal::because(RefusalReason::WrongState));
    assert!(bench.run(5).iter().any(|sent| matches!(sent,
        Message::MotionReply(reply) if reply.outcome == refused)));
}

/// The same frame again holds nothing.
#[test]
fn a_recorded_hold_lets_nothing_move() {
    let mut bench = manual();
    go(&mut bench, FAR);
    let motion = Motion {
        sequence: 9,
        request: MotionRequest::Hold,
    };
    let frame = bench.motion(MotionRequest::Hold);
    bench.wire.to_node.push_back(frame);
    bench.run(400);
    let rest = here(&bench);
    let old = encode(
        &Message::Motion(motion),
        bench.motion_counter.wrapping_sub(1),
    )
    .unwrap();
    for _ in 0..40 {
        bench.wire.to_node.push_back(old);
        bench.run(50);
    }
    assert_eq!(here(&bench), rest);
}

#[test]
fn the_operation_changes_only_where_nothing_moves_or_is_about_to() {
    let mut bench = manual();
    go(&mut bench, FAR);
    for _ in 0..2 {
        assert_eq!(
            bench.refusal(set(Operation::Automatic)),
            RefusalReason::Moving,
            "waiting"
        );
        hold(&mut bench, 200);
        assert_eq!(
            bench.refusal(set(Operation::Automatic)),
            RefusalReason::Moving,
            "moving"
        );
    }
    bench.request(MotionRequest::Stop);
    bench.run(300);
    let rest = here(&bench);
    assert_eq!(
        bench.request(set(Operation::Automatic)),
        Some(Outcome::Accepted)
    );
    bench.run(1000);
    assert_eq!(
        (bench.mode(), here(&bench)),
        (Mode::Enabled, rest),
        "nothing is left to move"
    );
    go(&mut bench, FAR);
    bench.run(1000);
    assert_eq!(bench.mode(), Mode::Enabled);
    assert!(
        (here(&bench) - Vector4::from(FAR)).amax() < 1e-5,
        "at full speed"
    );
}

/// A stop ends a held move as any other, and holds during it change nothing, nor are they refused: who holds cannot know of it yet.
#[test]
fn a_stop_ends_a_held_move() {
    let mut bench = manual();
    go(&mut bench, FAR);
    hold(&mut bench, 500);
    let frame = bench.motion(MotionRequest::Stop);
    bench.wire.to_node.push_back(frame);
    let mut sent = bench.step();
    assert_eq!(bench.mode(), Mode::QuickStop);
    sent.extend(hold(&mut bench, 200));
    let refused = |message: &&Message| matches!(message, Message::MotionReply(reply) if reply.outcome != Outcome::Accepted);
    assert_eq!(sent.iter().find(refused), None);
    assert_eq!(bench.mode(), Mode::Enabled);
    let rest = here(&bench);
    hold(&mut bench, 1000);
    assert_eq!((bench.mode(), here(&bench)), (Mode::Enabled, rest));
}

/// 260 mm/s of the lift, for three samples.
#[test]
fn a_tool_that_is_too_fast_is_a_fault() {
    for (operation, expected) in [
        (Operation::Manual, Cause::OverSpeed),
        (Operation::Automatic, Cause::None),
    ] {
        let mut bench = Bench::enabled();
        bench.request(set(operation));
        // Motor of the lift at 25 mm a turn: 0.26 m/s, far from its own limit. It shakes the others.
        let lift = (0.26 / 0.025 * std::f64::consts::TAU) as f32;
        bench.velocity = [0.01, 0.01, lift, 0.01];
        bench.run(2);
        assert_eq!(bench.mode(), Mode::Enabled, "not before the third sample");
        bench.step();
        let fault = *bench.node.controller().fault();
        assert_eq!(fault.cause, expected);
        if expected != Cause::None {
            assert_eq!(
                fault.to_string(),
                "over speed, tool: 0.26 m/s, limit 0.25 m/s"
            );
        }
    }
}

/// 150 ms: the 150th sample after the last hold is the first in which the arm slows down.
#[test]
fn a_hold_lasts_as_long_as_it_says() {
    for (time, samples) in [(None, 150), (Some(0.05), 50), (Some(0.7), 700)] {
        let mut config = by_itself();
        config.setup.hold_time = time.unwrap_or(config.setup.hold_time);
        let mut held = manual_with(config);
        go(&mut held, FAR);
        hold(&mut held, 201);
        let mut released = held.clone();
        // Both are held now, and one of them from then on.
        let mut alike = 0;
        for sample in 0..1000 {
            for (bench, is_held) in [(&mut held, true), (&mut released, sample == 0)] {
                if is_held {
                    let frame = bench.motion(MotionRequest::Hold);
                    bench.wire.to_node.push_back(frame);
                }
                bench.step();
            }
            let references = [&held, &released].map(|bench| *bench.node.controller().reference());
            if references[0] != references[1] {
                break;
            }
            alike += 1;
        }
        assert_eq!(alike + 1, samples);
    }
}

/// However long it would last.
#[test]
fn a_hold_ends_with_the_torque() {
    let mut config = by_itself();
    config.setup.hold_time = 10.0;
    let mut bench = manual_with(config);
    assert_eq!(bench.request(MotionRequest::Hold), None);
    let mut bench_off = bench.clone();
    bench_off.request(MotionRequest::Disable);
    bench_off.request(MotionRequest::Enable);
    for (bench, moves) in [(&mut bench, true), (&mut bench_off, false)] {
        bench.run(100);
        let start = here(bench);
        go(bench, FAR);
        bench.run(1000);
        assert_eq!((bench.mode(), here(bench) != start), (Mode::Moving, moves));
    }
}
