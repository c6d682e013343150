//! The elementary functions against the host's f64 functions: dense sweeps for the stated errors, arbitrary bits for
//! totality.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use common::U;
use firmware::mechanics::math::{angle, atan2, cbrt, clamp, hypot, sin_cos, sqrt, tanh, wrap};
use proptest::prelude::*;

/// `count` points evenly over [-range, range], each with its neighbours in f32.
fn sweep(range: f64, count: u32) -> impl Iterator<Item = f32> {
    (0..=count).flat_map(move |i| {
        let x = (f64::from(i) / f64::from(count) * 2.0 - 1.0) * range;
        neighbourhood(x)
    })
}

fn neighbourhood(x: f64) -> [f32; 3] {
    let x = x as f32;
    [x.next_down(), x, x.next_up()]
}

/// An angle without its whole turns, in f64.
fn turnless(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

#[track_caller]
fn assert_sin_cos(x: f32, bound: f64) {
    let (sin, cos) = sin_cos(x);
    let (exact_sin, exact_cos) = f64::from(x).sin_cos();
    let error = (f64::from(sin) - exact_sin)
        .abs()
        .max((f64::from(cos) - exact_cos).abs());
    assert!(
        error <= bound,
        "sin_cos({x:e}) is off by {error:e}, allowed {bound:e}"
    );
}

#[test]
fn sine_and_cosine_keep_their_error() {
    for range in [1.0, 8.0, 256.0, 8190.0] {
        for x in sweep(range, 400_000) {
            assert_sin_cos(x, 2.5 * U);
        }
    }
    // Where the quadrant changes and the sine loses its leading digits.
    for eighth in -20_000..=20_000 {
        for x in neighbourhood(f64::from(eighth) * FRAC_PI_2 / 2.0) {
            if x.abs() <= 8192.0 {
                assert_sin_cos(x, 2.5 * U);
            }
        }
    }
}

#[test]
fn the_cube_root_keeps_its_error() {
    // Three octaves cover every remainder of the exponent; the extremes cover the whole documented range.
    for octaves in [-126, -60, -3, 0, 60, 123] {
        for step in 0..300_000 {
            let x = (f64::from(octaves) + 3.0 * f64::from(step) / 300_000.0).exp2() as f32;
            let exact = f64::from(x).cbrt();
            let error = (f64::from(cbrt(x)) - exact).abs() / exact;
            assert!(error <= 2.0 * U, "cbrt({x:e}) is off by {error:e}");
            assert_eq!(cbrt(-x).to_bits(), (-cbrt(x)).to_bits());
        }
    }
    assert_eq!(cbrt(0.0), 0.0);
    assert_eq!(cbrt(1e-40), 0.0);
    assert!(cbrt(f32::NAN).is_nan());
}

#[test]
fn sine_and_cosine_are_exact_at_zero() {
    assert_eq!(sin_cos(0.0), (0.0, 1.0));
}

#[test]
fn square_root_is_correctly_rounded() {
    for x in sweep(100.0, 100_000) {
        let x = x.abs();
        assert_eq!(sqrt(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
    }
    assert!(sqrt(-1.0).is_nan());
}

#[test]
fn hyperbolic_tangent_keeps_its_error() {
    for x in sweep(12.0, 1_000_000) {
        let error = (f64::from(tanh(x)) - f64::from(x).tanh()).abs();
        assert!(error <= 4e-7, "tanh({x:e}) is off by {error:e}");
    }
}

/// Below 4 it is far from 1; above 8 it is 1 by definition. There is nothing between two of these numbers.
#[test]
fn hyperbolic_tangent_does_not_exceed_one() {
    for bits in 4.0f32.to_bits()..=8.0f32.to_bits() {
        let x = f32::from_bits(bits);
        assert!(tanh(x) <= 1.0, "tanh({x:e}) is {}", tanh(x));
    }
}

#[test]
fn wrapped_angle_keeps_its_error() {
    for range in [8.0, 8190.0] {
        for angle in sweep(range, 400_000) {
            let error = turnless(f64::from(wrap(angle)) - f64::from(angle)).abs();
            assert!(error <= 2.0 * U * PI, "wrap({angle:e}) is off by {error:e}");
        }
    }
}

#[test]
fn wrap_closes_the_range_above() {
    use std::f32::consts::PI;
    // Close to half a turn the rounded quotient may be off by one.
    for odd in (-2601..=2601).step_by(2) {
        for angle in neighbourhood(f64::from(odd) * std::f64::consts::PI) {
            let wrapped = wrap(angle);
            assert!(
                -PI < wrapped && wrapped <= PI,
                "wrap({angle:e}) is {wrapped}"
            );
        }
    }
    assert_eq!(wrap(PI), PI);
    assert_eq!(wrap(-PI), PI);
    assert_eq!(wrap((-PI).next_up()), (-PI).next_up());
}

#[test]
fn clamp_has_no_panic() {
    assert_eq!(clamp(2.0, -1.0, 1.0), 1.0);
    assert_eq!(clamp(-2.0, -1.0, 1.0), -1.0);
    assert_eq!(clamp(0.5, -1.0, 1.0), 0.5);
    assert_eq!(
        clamp(0.0, 1.0, -1.0),
        1.0,
        "crossed limits: the lower one wins"
    );
    assert!(clamp(f32::NAN, -1.0, 1.0).is_nan());
}

proptest! {
    #![proptest_config(common::draws::cases(4096))]

    /// Beyond the reduction range the phase may be off by half the spacing of the argument, 2^-24 of it, at most.
    #[test]
    fn functions_are_total(bits: u32) {
        let x = f32::from_bits(bits);
        let (sin, cos) = sin_cos(x);
        if x.is_finite() {
            prop_assert!((-1.0 - 2.0 * U as f32..=1.0 + 2.0 * U as f32).contains(&sin));
            let wide = f64::from(x);
            if wide.abs() < 1e6 {
                assert_sin_cos(x, 2.5 * U + wide.abs() * U);
            }
            let one = f64::from(sin).powi(2) + f64::from(cos).powi(2);
            prop_assert!((one - 1.0).abs() <= 10.0 * U, "sin^2 + cos^2 = {}", one);
            let wrapped = wrap(x);
            prop_assert!(-std::f32::consts::PI < wrapped && wrapped <= std::f32::consts::PI);
            prop_assert_eq!(wrap(wrapped).to_bits(), wrapped.to_bits());
            if x.abs() > 8192.0 {
                prop_assert_eq!(wrapped.to_bits(), wrap(x % std::f32::consts::TAU).to_bits());
            }
            prop_assert_eq!(tanh(-x).to_bits(), (-tanh(x)).to_bits());
            prop_assert!(tanh(x).abs() <= 1.0);
        } else {
            prop_assert!(sin.is_nan() && cos.is_nan() && wrap(x).is_nan() && tanh(x).is_nan());
        }
    }

    #[test]
    fn polar_coordinates_keep_their_error(x in -3.0..=3.0f32, y in -3.0..=3.0f32) {
        let (wide_x, wide_y) = (f64::from(x), f64::from(y));
        let length = wide_x.hypot(wide_y);
        prop_assert!((f64::from(hypot(x, y)) - length).abs() <= 2.0 * U * length);
        let exact = wide_y.atan2(wide_x);
        for found in [atan2(y, x), angle(y, x)] {
            prop_assert!((f64::from(found) - exact).abs() <= 4.0 * U * exact.abs());
        }
    }
}
