//! Moves that pass into each other without a stop, within a zone around the corners. Judged by the moves as they are planned one by one,
//! and by the recursive Newton-Euler dynamics, which planning does not use.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::planned::{check_walk, robot, two_kg};
use common::queued::{Manner, PERIOD, Run, run};
use firmware::mechanics::arm::{ArmModel, IRB_930, Payload};
use firmware::mechanics::body::Body;
use firmware::mechanics::jacobian::Jacobian;
use firmware::mechanics::kinematics::{self, Elbow, Pose};
use firmware::trajectory::Trajectory;
use firmware::trajectory::request::Target;
use firmware::trajectory::tool_speed::{self, PLANNED};
use firmware::trajectory::torque_budget::TorqueBudget;
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;
use protocol::messages::Posture;

fn tool(arm: &ArmModel, q: &Vector4<f32>) -> Vector3<f32> {
    let pose = kinematics::forward(&arm.geometry, q);
    Vector3::new(pose.x, pose.y, pose.z)
}

/// How far `q` is from the path of a move next to its time `t`, rad or m: Newton's method for the nearest place.
fn off(arm: &ArmModel, trajectory: &Trajectory, q: &Vector4<f32>, mut t: f32) -> f32 {
    for _ in 0..4 {
        let there = trajectory.at(arm, t).unwrap();
        let speed = there.qd.dot(&there.qd);
        if speed > 1e-6 {
            t += (q - there.q).dot(&there.qd) / speed;
        }
    }
    (trajectory.at(arm, t).unwrap().q - q).amax()
}

/// Checks limits, zones, paths and time; how much time was saved, s.
fn check(
    arm: &ArmModel,
    payload: &Payload,
    from: &Vector4<f32>,
    moves: &[(Target, f32)],
) -> Result<Option<f32>, TestCaseError> {
    let Some((run, single)) = run(arm, payload, from, moves, &Manner::default()) else {
        return Ok(None);
    };
    // About one line in some thousand passes a limit by a thousandth by itself, between the places that planning looks at.
    let alone = |it: &Trajectory| {
        let steps = (it.duration() / PERIOD) as u16;
        let walk = (0..=steps).map(|step| it.at(arm, f32::from(step) * PERIOD).unwrap());
        check_walk(arm, payload, PERIOD, walk).is_ok()
    };
    if single.iter().all(alone) {
        check_walk(arm, payload, PERIOD, run.walk.iter().copied())?;
    }
    let planned: f32 = single.iter().map(Trajectory::duration).sum();
    // The walk has a sample at either end.
    let taken = run.walk.len() as f32 * PERIOD;
    prop_assert!(taken < planned + 2.5 * PERIOD, "{taken} {planned}");
    // Where the move under way has begun: within a sample.
    let mut begun = 0.0;
    let mut next_begun = None;
    for (sample, (here, (blending, completed))) in run.walk.iter().zip(&run.blending).enumerate() {
        let now = sample as f32 * PERIOD;
        let index = usize::from(*completed);
        if sample > 0 && run.blending[sample - 1].1 < *completed {
            begun = next_begun.take().unwrap_or(now);
        }
        if *blending {
            next_begun.get_or_insert(now);
            let (_, zone) = moves[index];
            let aside = tool(arm, &here.q) - tool(arm, &single[index].end);
            let aside = aside.dot(&aside).sqrt();
            // Between the instants that planning looks at.
            prop_assert!(aside < zone + 1e-4, "{aside} from a corner, zone {zone}");
        } else if let Some(trajectory) = single.get(index) {
            let off = off(arm, trajectory, &here.q, now - begun);
            prop_assert!(off < 2e-5, "{off} off its path at {now}");
        }
    }
    let last = single.last().unwrap();
    prop_assert!((run.walk.last().unwrap().q - last.end).amax() < 1e-5);
    Ok(Some(planned - taken))
}

fn pose() -> impl Strategy<Value = Pose> {
    (0.4f32..0.95, -1.5f32..1.5, -0.4f32..-0.15, -2.0f32..2.0).prop_map(|(r, a, z, yaw)| Pose {
        x: r * a.cos(),
        y: r * a.sin(),
        z,
        yaw,
    })
}

/// A move to a pose, a short or a long one.
fn target() -> impl Strategy<Value = Target> {
    let posture = Posture::NEAREST;
    prop_oneof![
        pose().prop_map(move |pose| Target::Line(pose, posture)),
        pose().prop_map(move |pose| Target::Jump {
            pose,
            posture,
            top: -0.15,
            clearance: 0.0
        }),
        (-1.5f32..1.5, 0.3f32..2.4, 0.02f32..0.28, -3.0f32..3.0)
            .prop_map(|(a, b, c, d)| Target::Joints(Vector4::new(a, b, c, d))),
    ]
}

fn place(x: f32, y: f32, z: f32) -> Pose {
    let yaw = 0.0;
    Pose { x, y, z, yaw }
}

fn joints_of(pose: &Pose) -> Option<Vector4<f32>> {
    kinematics::inverse(&IRB_930, pose, Elbow::Positive, &Vector4::zeros()).ok()
}

proptest! {
    #![proptest_config(common::draws::cases(500))]

    /// Moves of all kinds, to anywhere.
    #[test]
    fn blends_keep_limits_zones_and_paths(
        arm in robot(), from in pose(), mass in 0.0f32..22.0,
        moves in prop::collection::vec((target(), prop_oneof![Just(0.0f32), 0.001f32..0.2]), 2..=4),
    ) {
        let Some(from) = joints_of(&from) else { return Ok(()) };
        check(&arm, &Payload { mass, ..two_kg() }, &from, &moves)?;
    }

    /// Lines along a zigzag, as on the edge of a part.
    #[test]
    fn polylines_keep_limits_zones_and_paths(
        x in 0.45f32..0.6, y in -0.3f32..0.0, ways in prop::collection::vec((0.02f32..0.15, -1.6f32..1.6), 2..=4),
        zone in 0.001f32..0.05, mass in 0.0f32..22.0,
    ) {
        let mut here = Pose { x, y, z: -0.2, yaw: 0.0 };
        let Some(from) = joints_of(&here) else { return Ok(()) };
        let moves: Vec<_> = ways.iter().map(|(way, angle)| {
            here.x += way * angle.sin();
            here.y += way * angle.cos();
            (Target::Line(here, Posture::NEAREST), zone)
        }).collect();
        check(&IRB_930, &Payload { mass, ..two_kg() }, &from, &moves)?;
    }
}

/// One after the other, from and to places at which the arm can do anything.
fn corner(zone: f32) -> (Vector4<f32>, [(Target, f32); 3]) {
    let posture = Posture::NEAREST;
    let from = joints_of(&place(0.5, 0.2, -0.3)).unwrap();
    let moves = [
        (Target::Line(place(0.7, 0.2, -0.2), posture), zone),
        (
            Target::Jump {
                pose: place(0.7, -0.1, -0.3),
                posture,
                top: -0.2,
                clearance: 0.0,
            },
            zone,
        ),
        (Target::Joints(Vector4::new(0.3, 1.2, 0.1, 0.5)), zone),
    ];
    (from, moves)
}

/// Whatever the pace does, the arm goes along the same way: that of full pace, which is blended.
#[test]
fn another_pace_keeps_the_way() {
    let (from, moves) = corner(0.05);
    let (full, _) = run(&IRB_930, &two_kg(), &from, &moves, &Manner::default()).unwrap();
    assert!(
        full.blending
            .iter()
            .filter(|(blending, _)| *blending)
            .count()
            > 20
    );
    for pace in [0.1, 0.5, 0.9] {
        for begin in 1..20 {
            let begin = begin as f32 * 0.025;
            let changes = [(begin, pace), (begin + 0.15, 1.0)];
            let (slow, _) = run(
                &IRB_930,
                &two_kg(),
                &from,
                &moves,
                &Manner {
                    changes: &changes,
                    ..Manner::default()
                },
            )
            .unwrap();
            assert!(slow.walk.len() > full.walk.len());
            let mut at = 0;
            for here in &slow.walk {
                let away = |at: usize| (full.walk[at].q - here.q).amax();
                while at + 1 < full.walk.len() && away(at + 1) <= away(at) {
                    at += 1;
                }
                // As far as a joint moves in half a sample.
                let most = 0.6 * PERIOD * full.walk[at].qd.amax().max(0.5);
                assert!(away(at) < most, "{} off at pace {pace}", away(at));
            }
            assert!((slow.walk.last().unwrap().q - full.walk.last().unwrap().q).amax() < 1e-5);
        }
    }
}

/// A stop brakes on the way, through a corner where it has to, with torques that a plan may use.
#[test]
fn a_stop_brakes_on_the_way() {
    let (from, moves) = corner(0.05);
    let (full, _) = run(&IRB_930, &two_kg(), &from, &moves, &Manner::default()).unwrap();
    let body = Body::new(&IRB_930, &two_kg());
    let budget = TorqueBudget {
        arm: &IRB_930,
        body: &body,
    };
    for begin in (100..full.walk.len()).step_by(40) {
        let stop = Manner {
            stop: Some(begin),
            ..Manner::default()
        };
        let (run, _) = run(&IRB_930, &two_kg(), &from, &moves, &stop).unwrap();
        assert!(run.walk.len() < begin + 1200, "no stop");
        let (_, braking) = run.walk.split_last().unwrap();
        for here in braking {
            let away = full.walk.iter().map(|there| (there.q - here.q).amax());
            assert!(away.fold(f32::MAX, f32::min) < 2e-3, "off the way");
            let torque = budget.torque_scale(here).0;
            assert!(torque > 0.97, "{torque} from {begin}");
        }
    }
}

/// Without a zone each move is its own trajectory, to the last bit.
#[test]
fn without_a_zone_the_arm_stops_at_every_corner() {
    let (from, moves) = corner(0.0);
    let (run, single) = run(&IRB_930, &two_kg(), &from, &moves, &Manner::default()).unwrap();
    assert!(run.blending.iter().all(|(blending, _)| !blending));
    let first = &single[0];
    for (sample, here) in run.walk.iter().enumerate() {
        let t = sample as f32 * PERIOD;
        if t < first.duration() {
            assert_eq!(*here, first.at(&IRB_930, t).unwrap());
        }
    }
    let longer =
        single.iter().map(Trajectory::duration).sum::<f32>() - run.walk.len() as f32 * PERIOD;
    assert!(longer.abs() < 2.0 * PERIOD, "{longer}");
}

/// A way up, across and down takes a tenth less with zones of 5 mm, and a sixth with 20 mm.
#[test]
fn a_zone_saves_time() {
    let posture = Posture::NEAREST;
    let from = joints_of(&place(0.5, 0.2, -0.3)).unwrap();
    let ways = [(0.5, 0.2, -0.25), (0.7, -0.1, -0.25), (0.7, -0.1, -0.3)];
    for (zone, share) in [(0.005, 0.9), (0.02, 0.84)] {
        let moves = ways.map(|(x, y, z)| (Target::Line(place(x, y, z), posture), zone));
        let (run, single) = run(&IRB_930, &two_kg(), &from, &moves, &Manner::default()).unwrap();
        let planned: f32 = single.iter().map(Trajectory::duration).sum();
        let taken = run.walk.len() as f32 * PERIOD;
        assert!(taken < share * planned, "{zone}: {planned} {taken}");
    }
}

/// Fastest point that a tool may have in a run, and the flange, m/s.
fn fastest(run: &Run) -> (f32, f32) {
    run.walk.iter().fold((0.0, 0.0), |(tool, flange), here| {
        let trig = kinematics::Trig::new(&here.q);
        let velocity = Jacobian::new(&IRB_930.geometry, &trig).task_velocity(&here.qd);
        let along = velocity.xyz();
        (
            tool_speed::of(&velocity).max(tool),
            along.dot(&along).sqrt().max(flange),
        )
    })
}

/// Between two moves with a speed of the tool, it is no faster; nor is it in manual operation.
#[test]
fn the_tool_is_no_faster_where_moves_overlap() {
    let posture = Posture::NEAREST;
    let from = joints_of(&place(0.6, -0.3, -0.3)).unwrap();
    let moves = [-0.1, 0.1, 0.3].map(|y| (Target::Line(place(0.6, y, -0.3), posture), 0.03));
    for tool_speed in [0.5, 1.0] {
        let slow = Manner {
            tool_speed,
            ..Manner::default()
        };
        let (run, _) = run(&IRB_930, &two_kg(), &from, &moves, &slow).unwrap();
        let (_, flange) = fastest(&run);
        assert!(flange < 1.003 * tool_speed, "{flange}");
        let blended = run.blending.iter().filter(|(blending, _)| *blending);
        assert!(blended.count() > 20);
    }
    let held = Manner {
        held: true,
        ..Manner::default()
    };
    let (run, _) = run(&IRB_930, &two_kg(), &from, &moves, &held).unwrap();
    let (tool, _) = fastest(&run);
    assert!(tool < 1.003 * PLANNED, "{tool}");
}
