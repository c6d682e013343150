//! The elementary functions of the simulation: the same bits on every machine.
//!
//! IEEE 754 fixes the result of `+ - * /`, the square root, comparisons and rounding to an integer to the last bit; those
//! come from the standard library. It does not fix the sine: the standard library leaves that to the platform's C
//! library, where glibc chooses an implementation by processor and WebAssembly has another. The `libm` crate computes
//! these functions from the operations above alone, always in the same order. `clippy.toml` forbids the others in this
//! crate.

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

/// Hyperbolic tangent.
pub(crate) fn tanh(x: f64) -> f64 {
    libm::tanh(x)
}

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
