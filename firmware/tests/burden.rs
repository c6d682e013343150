//! Which mass the lift carries beyond the announced one. Numbers by hand: a mean with a time constant of one second.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use firmware::control::burden::Burden;

const GRAVITY: f32 = 9.81;

fn after(seconds: u32, pull: impl Fn(u32) -> f32) -> f32 {
    let mut burden = Burden::new();
    for sample in 0..100 * seconds {
        burden.account(pull(sample), GRAVITY, 1.0, 0.01);
    }
    burden.mass()
}

#[test]
fn it_is_the_weight_that_is_not_explained() {
    // 4.4 kg; after one second 1 - 0.99^100 = 0.634 of it.
    assert!((after(1, |_| 4.4 * GRAVITY) - 0.634 * 4.4).abs() < 0.002);
    assert!((after(10, |_| 4.4 * GRAVITY) - 4.4).abs() < 0.001);
    assert!((after(10, |_| -2.5 * GRAVITY) + 2.5).abs() < 0.001);
}

/// Friction of 30 N that the model does not have, in strokes of 0.25 s up and down: a tenth of what it would be in one direction.
#[test]
fn friction_is_gone_in_the_mean_of_both_directions() {
    let friction = |sample: u32| {
        if (sample / 25).is_multiple_of(2) {
            30.0
        } else {
            -30.0
        }
    };
    let left = after(10, friction).abs();
    assert!(left < 0.13 * 30.0 / GRAVITY, "{left} kg");
}

/// 2 kg in a lift that swings with 15 m/s²: half a second of it is as good as any other.
#[test]
fn acceleration_is_not_taken_for_weight() {
    for seconds in [8, 9, 10] {
        for phase in 0..25 {
            let mut burden = Burden::new();
            for sample in 0..100 * seconds + phase {
                let swing = (sample as f32 * 0.25).sin() * 15.0;
                let pull = 2.0 * (GRAVITY - swing);
                burden.account(pull, GRAVITY, 1.0 - swing / GRAVITY, 0.01);
            }
            assert!((burden.mass() - 2.0).abs() < 0.002, "{}", burden.mass());
        }
    }
}

/// What a fault makes of it stays within what the report can carry.
#[test]
fn it_stays_finite() {
    for pull in [f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(after(10, |_| pull).abs() <= 300.0, "{pull}");
    }
}

/// However long the time that is accounted for at once, and however heavy the mass meanwhile: it comes nearer, and is never past it.
#[test]
fn no_gap_makes_it_overshoot() {
    for time in [0.01, 0.1, 1.0, 10.0] {
        for heavier in [0.5, 1.0, 3.0, 6.0] {
            let mut burden = Burden::new();
            burden.account(2.0 * heavier * GRAVITY, GRAVITY, heavier, time);
            let mass = burden.mass();
            assert!(0.0 < mass && mass < 2.0001, "{mass} kg in {time} s");
        }
    }
}
