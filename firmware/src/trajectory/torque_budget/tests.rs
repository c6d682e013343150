//! The root of the time scale.

use super::*;

/// Against the formula for the roots of a parabola, in f64.
#[test]
fn the_scale_is_the_root() {
    for overload in [1.001, 1.01, 1.05, 1.2, 1.5, 2.0, 4.0, 8.0f64] {
        for share in [-0.9, -0.5, -0.1, 0.0, 0.3, 0.7, 1.0f64] {
            // a + b = 1, of which a is this share; a parabola that opens downwards still rises at 1.
            let (a, b, room) = (share, 1.0 - share, 1.0 / overload);
            let root = (b * b + 4.0 * a * room).max(0.0).sqrt();
            let wanted = 2.0 * room / (b + root);
            let found = f64::from(largest_scale(a as f32, b as f32, room as f32));
            let error = found / wanted - 1.0;
            // From below never past the root, though slowly where the parabola is flat.
            let (below, above) = match (share < 0.0, overload > 2.0) {
                (true, _) => (-2e-2, 1e-5),
                (false, true) => (-1e-5, 6e-3),
                (false, false) => (-1e-5, 1e-5),
            };
            assert!(
                error > below && error < above,
                "{overload} {share}: {found} {wanted}"
            );
        }
    }
}
