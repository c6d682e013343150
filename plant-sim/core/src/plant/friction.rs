//! Coulomb friction that builds up smoothly: `level tanh(speed / eps)`.

use crate::maths::tanh;

/// Friction against a motion at `speed`.
pub(super) fn coulomb(level: f64, eps: f64, speed: f64) -> f64 {
    level * tanh(speed / eps)
}

/// Friction over speed: the damper that brakes as hard at this speed.
pub(super) fn coulomb_secant(level: f64, eps: f64, speed: f64) -> f64 {
    // tanh x = x to f64 precision below |x| = 1e-8.
    if speed.abs() > 1e-8 * eps {
        coulomb(level, eps, speed) / speed
    } else {
        level / eps
    }
}
