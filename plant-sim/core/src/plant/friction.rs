//! Coulomb friction that builds up smoothly: `level tanh(speed / eps)`, of several axes at once.

use std::array;

use crate::maths::tanh;

/// Friction against motions at these speeds.
pub(super) fn coulomb<const N: usize>(
    level: &[f64; N],
    eps: &[f64; N],
    speed: &[f64; N],
) -> [f64; N] {
    let tanh: [f64; N] = tanh(array::from_fn(|i| speed[i] / eps[i]));
    array::from_fn(|i| level[i] * tanh[i])
}

/// Friction over speed: the dampers that brake as hard at these speeds.
pub(super) fn coulomb_secant<const N: usize>(
    level: &[f64; N],
    eps: &[f64; N],
    speed: &[f64; N],
) -> [f64; N] {
    let friction = coulomb(level, eps, speed);
    array::from_fn(|i| {
        // tanh x = x to f64 precision below |x| = 1e-8.
        if speed[i].abs() > 1e-8 * eps[i] {
            friction[i] / speed[i]
        } else {
            level[i] / eps[i]
        }
    })
}
