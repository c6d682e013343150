//! The elementary functions of the simulation: the same bits on every machine.
//!
//! IEEE 754 fixes the result of `+ - * /`, the square root, comparisons and rounding to an integer to the last bit; those
//! come from the standard library. It does not fix the sine: the standard library leaves that to the platform's C
//! library, where glibc chooses an implementation by processor and WebAssembly has another. The `libm` crate computes
//! these functions from the operations above alone, always in the same order. `clippy.toml` forbids the others in this
//! crate.

use std::f64::consts::{LN_2, LOG2_E};

/// Sine and cosine of `x` (rad).
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Angle (rad) of the vector (x, y), in [-pi, pi].
pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Length of the vector (x, y).
pub(crate) fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

/// Hyperbolic tangent, within 3 units in the last place, where that of `libm` keeps 2 and takes twice as long: friction asks for
/// it sixteen times a step.
///
/// With m = e^2x - 1 it is m / (m + 2). The exponent is 2x = k ln 2 + r with the nearest k, and e^r - 1 is the series, of
/// which fourteen terms would be beyond the last place.
pub(crate) fn tanh(x: f64) -> f64 {
    let twice = 2.0 * x.abs();
    if twice > 40.0 {
        // To the last place.
        return 1.0_f64.copysign(x);
    }
    let k = (twice * LOG2_E + 0.5) as i32;
    let r = twice - f64::from(k) * LN_2;
    let series = RECIPROCAL_FACTORIALS.iter().rev();
    let less_one = series.fold(0.0, |sum, term| (sum + term) * r);
    let power = (1_i64 << k) as f64;
    let m = power * less_one + (power - 1.0);
    (m / (m + 2.0)).copysign(x)
}

/// 1/1! to 1/13!.
const RECIPROCAL_FACTORIALS: [f64; 13] = {
    let (mut terms, mut n, mut factorial) = ([0.0; 13], 0, 1.0);
    while n < terms.len() {
        factorial *= (n + 1) as f64;
        terms[n] = 1.0 / factorial;
        n += 1;
    }
    terms
};

/// Natural logarithm.
pub(crate) fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// Power of e.
pub(crate) fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Square, without the freedom that `powi` has.
pub(crate) fn square(x: f64) -> f64 {
    x * x
}

/// What is left of `x` after the nearest multiple of `y`: exact, in [-y/2, y/2].
pub(crate) fn remainder(x: f64, y: f64) -> f64 {
    libm::remainder(x, y)
}

#[cfg(test)]
mod tests {
    use super::tanh;

    #[test]
    fn tanh_is_that_of_libm_but_for_the_last_places() {
        let near = |x: f64| {
            let expected = libm::tanh(x);
            let error = (tanh(x) - expected).abs();
            // An epsilon is up to two units in the last place.
            assert!(
                error <= 4.0 * f64::EPSILON * expected.abs(),
                "{x}: {error:e}"
            );
        };
        // Evenly in x, and in the order of magnitude.
        (-250_000..=250_000).for_each(|k| near(f64::from(k) * 1e-4));
        (-3000..=100).for_each(|k| near(libm::exp10(f64::from(k) * 0.1)));
        for x in [0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(tanh(x).to_bits(), libm::tanh(x).to_bits(), "{x}");
        }
        assert!(tanh(f64::NAN).is_nan());
    }
}
