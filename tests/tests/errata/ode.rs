//! Integration of the closed loops.

use std::ops::{Add, Mul};

use nalgebra::{SVector, Vector4};

/// Integrates `xd = f(t, x)` from 0 to `end` with the classical Runge-Kutta method, calling `each` after every step.
pub(crate) fn integrate<X>(
    mut x: X,
    end: f64,
    steps: u32,
    f: impl Fn(f64, &X) -> X,
    mut each: impl FnMut(f64, &X),
) -> X
where
    X: Copy + Add<Output = X> + Mul<f64, Output = X>,
{
    let h = end / f64::from(steps);
    for step in 0..steps {
        let t = f64::from(step) * h;
        let k1 = f(t, &x);
        let k2 = f(t + h / 2.0, &(x + k1 * (h / 2.0)));
        let k3 = f(t + h / 2.0, &(x + k2 * (h / 2.0)));
        let k4 = f(t + h, &(x + k3 * h));
        x = x + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        each(t + h, &x);
    }
    x
}

/// Position and velocity as one state.
pub(crate) fn stack(upper: &Vector4<f64>, lower: &Vector4<f64>) -> SVector<f64, 8> {
    SVector::from_fn(|i, _| if i < 4 { upper[i] } else { lower[i - 4] })
}

/// The inverse of [`stack`].
pub(crate) fn split(x: &SVector<f64, 8>) -> (Vector4<f64>, Vector4<f64>) {
    (x.fixed_rows::<4>(0).into(), x.fixed_rows::<4>(4).into())
}
