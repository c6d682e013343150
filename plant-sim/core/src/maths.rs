//! The elementary functions of the simulation: the same bits on every machine.
//!
//! IEEE 754 fixes the result of `+ - * /`, the square root, comparisons and rounding to an integer to the last bit; those
//! come from the standard library. It does not fix the sine: the standard library leaves that to the platform's C
//! library, where glibc chooses an implementation by processor and WebAssembly has another. The `libm` crate computes
//! these functions from the operations above alone, always in the same order. `clippy.toml` forbids the others in this
//! crate.

use std::array;
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

/// Hyperbolic tangents, within 3 units in the last place, where that of `libm` keeps 2 and takes several times as long: friction
/// asks for those of four axes four times a step. All at once the processor works on them side by side.
///
/// With m = e^2x - 1 it is m / (m + 2). The exponent is 2x = k ln 2 + r with the nearest k, and e^r - 1 is the series, of
/// which fourteen terms would be beyond the last place.
pub(crate) fn tanh<const N: usize>(x: [f64; N]) -> [f64; N] {
    // From 20 on it is 1 to the last place; far below the last place of 1, x itself.
    let twice = x.map(|x| {
        let twice = 2.0 * x.abs();
        if twice > 40.0 { 40.0 } else { twice }
    });
    if twice.iter().all(|twice| *twice == 40.0 || *twice < 1e-17) {
        return x.map(|x| {
            if x.abs() < 1.0 {
                x
            } else {
                1.0_f64.copysign(x)
            }
        });
    }
    let k = twice.map(|twice| (twice * LOG2_E + 0.5) as i32);
    let r: [f64; N] = array::from_fn(|i| twice[i] - f64::from(k[i]) * LN_2);
    let mut less_one = [0.0; N];
    for term in RECIPROCAL_FACTORIALS.iter().rev() {
        for i in 0..N {
            less_one[i] = (less_one[i] + term) * r[i];
        }
    }
    array::from_fn(|i| {
        let power = (1_i64 << k[i]) as f64;
        let m = power * less_one[i] + (power - 1.0);
        (m / (m + 2.0)).copysign(x[i])
    })
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
            let error = (tanh([x])[0] - expected).abs();
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
            assert_eq!(tanh([x])[0].to_bits(), libm::tanh(x).to_bits(), "{x}");
        }
        assert!(tanh([f64::NAN])[0].is_nan());
    }

    #[test]
    fn a_tanh_does_not_depend_on_those_beside_it() {
        let all = [
            0.0,
            -1e-300,
            1e-18,
            -1e-17,
            1e-8,
            0.3,
            -19.999,
            20.0,
            -21.0,
            f64::INFINITY,
        ];
        for x in all {
            for other in all {
                let [one, two] = tanh([x, other]).map(f64::to_bits);
                assert_eq!(one, tanh([x])[0].to_bits(), "{x} beside {other}");
                assert_eq!(two, tanh([other])[0].to_bits(), "{other} beside {x}");
            }
        }
    }
}
