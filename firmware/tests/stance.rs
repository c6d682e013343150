//! Axes that stand while their loop makes more and more of that, against bounds worked out by hand.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::control::readings::Readings;
use firmware::control::stance::Stance;
use firmware::mechanics::arm::Axis;
use nalgebra::Vector4;
use protocol::messages::DriveStatus;

/// N m, lift N: their bounds are 1.5 times the friction and two counts.
const FRICTION: Vector4<f32> = Vector4::new(8.0, 4.0, 16.0, 2.0);
const COUNT: Vector4<f32> = Vector4::new(2.0, 1.0, 0.5, 0.25);
const BOUND: Vector4<f32> = Vector4::new(16.0, 8.0, 25.0, 3.5);

fn readings(counts: [i32; 4], velocity: [f32; 4]) -> Readings {
    Readings {
        steps: 1,
        status: DriveStatus::EMPTY,
        counts,
        velocity: Vector4::from(velocity),
        torque: Vector4::zeros(),
    }
}

fn of(axis: Axis, value: f32) -> Vector4<f32> {
    let mut all = Vector4::zeros();
    *axis.of_mut(&mut all) = value;
    all
}

/// What a watch finds that looks at an axis with these efforts in turn, at the count and the motor velocity that go with them.
fn found_by(close: bool, axis: Axis, looks: &[(f32, i32, f32)]) -> Option<(usize, Axis, f32, f32)> {
    let mut stance = Stance::new();
    looks.iter().enumerate().find_map(|(number, look)| {
        let (effort, count, velocity) = *look;
        let (mut counts, mut velocities) = ([7; 4], [0.0; 4]);
        counts[axis as usize] = count;
        velocities[axis as usize] = velocity;
        let readings = readings(counts, velocities);
        let found = stance.look(&readings, &of(axis, effort), &FRICTION, &COUNT, close)?;
        Some((number, found.0, found.1, found.2))
    })
}

fn found(axis: Axis, looks: &[(f32, i32, f32)]) -> Option<(usize, Axis, f32, f32)> {
    found_by(false, axis, looks)
}

#[test]
fn an_effort_that_grows_while_the_axis_stands_is_found_when_it_is_beyond_the_bound() {
    for axis in Axis::ALL {
        let bound = axis.of(&BOUND);
        for sign in [1.0, -1.0] {
            // From a load that holds it beside its reference.
            for load in [0.0, 32.0] {
                let looks: Vec<_> = (0..100)
                    .map(|look| (sign * (load + bound * (0.125 * look as f32)), -5, 0.0))
                    .collect();
                // The eighth is on the bound, to the bit.
                assert_eq!(
                    found(axis, &looks),
                    Some((9, axis, bound * 1.125, bound)),
                    "{axis:?} {load}"
                );
            }
        }
    }
}

#[test]
fn a_sound_axis_is_not_found() {
    for axis in Axis::ALL {
        let bound = axis.of(&BOUND);
        let grows = |look: i32| bound * 0.75 * look as f32;
        let sound: [(&str, Vec<_>); 5] = [
            (
                "moves by a count",
                (0..99).map(|it| (grows(it), it, 0.0)).collect(),
            ),
            (
                "is back, with some speed",
                (0..99).map(|it| (grows(it), 3, 0.1)).collect(),
            ),
            (
                "loses a load",
                (0..99)
                    .map(|it| (bound * (99 - it) as f32, 3, 0.0))
                    .collect(),
            ),
            (
                "grows until it moves",
                (0..99)
                    .map(|it| (bound * (it % 2) as f32, it / 2, 0.0))
                    .collect(),
            ),
            (
                "is held on one side and on the other",
                (0..99)
                    .map(|it| {
                        let friction = axis.of(&FRICTION);
                        (if it % 2 == 0 { -friction } else { friction }, 3, 0.0)
                    })
                    .collect(),
            ),
        ];
        for (what, looks) in sound {
            for close in [false, true] {
                assert_eq!(found_by(close, axis, &looks), None, "{axis:?} {what}");
            }
        }
    }
}

/// The effort jumps with the motion that is not shown any more: seen against that of the motion where the looks are close.
#[test]
fn an_axis_whose_encoder_gets_stuck_in_motion_is_found_at_the_second_look() {
    for axis in Axis::ALL {
        let bound = axis.of(&BOUND);
        for load in [0.0, 32.0] {
            let jump = load + bound * 1.5;
            let looks = [
                (load, 3, 0.5),
                (load, 5, 0.5),
                (jump, 6, 0.0),
                (jump, 6, 0.0),
            ];
            let growth = bound * 1.5;
            assert_eq!(found_by(true, axis, &looks), Some((3, axis, growth, bound)));
            assert_eq!(found_by(false, axis, &looks), None);
        }
    }
}

/// Each axis has an account of its own.
#[test]
fn the_axis_that_stands_is_named_though_others_move() {
    for axis in Axis::ALL {
        let mut stance = Stance::new();
        let named = (0..9).find_map(|look| {
            let mut counts = [look; 4];
            counts[axis as usize] = 0;
            let effort = BOUND * look as f32;
            stance.look(
                &readings(counts, [0.0; 4]),
                &effort,
                &FRICTION,
                &COUNT,
                false,
            )
        });
        assert_eq!(named.map(|it| it.0), Some(axis));
    }
}
