//! Heat of the motors, against the first-order response of a body to constant losses.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::control::heat::{Heat, pace};
use firmware::mechanics::arm::Axis;
use nalgebra::Vector4;

/// N m, lift N.
const CONTINUOUS: Vector4<f32> = Vector4::new(200.0, 100.0, 50.0, 10.0);

/// An effort that is this many times the continuous one.
fn times(shares: [f32; 4]) -> Vector4<f32> {
    Vector4::from(shares).component_mul(&CONTINUOUS)
}

/// Heat goes to the square of the effort, by the part of the time constant that passes, and from there back to nothing.
#[test]
fn heat_follows_the_square_of_the_effort() {
    // One that warms up evenly, of either sign, and one hotter motor at a time.
    for (hot, axis) in Axis::ALL.into_iter().enumerate() {
        let mut shares = [0.5, -0.7, 0.9, -1.1];
        shares[hot] = -1.5;
        let (mut heat, part) = (Heat::new(), 0.04);
        let squares = shares.map(|share| f64::from(share).powi(2));
        for step in 1..=300 {
            let is_on = step <= 100;
            let effort = if is_on {
                times(shares)
            } else {
                times([0.0; 4])
            };
            let (warmest, share) = heat.account(&[effort; 4], &CONTINUOUS, part);
            // Four samples, each a quarter of the part.
            let left = |steps: i32| 0.99f64.powi(4 * steps);
            let response = if is_on {
                1.0 - left(step)
            } else {
                (1.0 - left(100)) * left(step - 100)
            };
            for (found, square) in heat.shares().iter().zip(squares) {
                let (found, expected) = (f64::from(*found), square * response);
                assert!(
                    (found - expected).abs() <= 1e-4 * square,
                    "{step}: {found} {expected}"
                );
            }
            assert_eq!((warmest, share), (axis, axis.of(heat.shares())));
        }
    }
}

/// A part longer than all the samples stand for is as long as they: their mean is all that counts.
#[test]
fn no_part_is_more_than_all() {
    let mut heat = Heat::new();
    let (even, uneven) = (times([1.0; 4]), times([0.5, 0.5, 2.0, 0.5]));
    let efforts = [even, uneven, uneven, even];
    let found = heat.account(&efforts, &CONTINUOUS, 100.0);
    assert_eq!(found, (Axis::Lift, 2.5));
    assert_eq!(heat.shares(), &Vector4::new(0.625, 0.625, 2.5, 0.625));
}

/// From all of it at 90 % to three tenths at 100 %.
#[test]
fn the_pace_falls_evenly_between_warm_and_hot() {
    for (heat, expected) in [
        (0.0, 1.0),
        (0.89, 1.0),
        (0.9, 1.0),
        (0.91, 0.93),
        (0.925, 0.825),
        (0.95, 0.65),
        (0.99, 0.37),
        (1.0, 0.3),
        (1.2, 0.3),
    ] {
        let found = pace(heat);
        assert!((found - expected).abs() < 1e-5, "{heat}: {found}");
    }
}
