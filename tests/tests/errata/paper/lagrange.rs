//! The energies before eq. 40 and the joint torques of eq. 40-43.

use nalgebra::{Vector2, Vector4};

/// Parameters of eq. 40-43. `m` and `a` are the masses and lengths of links 1 to 3: the equations have no link 4, no
/// inertia and no payload, but a length `a3` that Table 1 sets to zero.
pub(crate) struct Given {
    pub m: [f64; 3],
    pub a: [f64; 3],
    pub g: f64,
}

/// Kinetic energy: `sum m_i (xd_i^2 + yd_i^2) / 2`, J.
pub(crate) fn kinetic_energy(bodies: impl IntoIterator<Item = (f64, Vector2<f64>)>) -> f64 {
    bodies
        .into_iter()
        .map(|(m, v)| 0.5 * m * v.norm_squared())
        .sum()
}

/// Potential energy: `sum m_i g_i y_i`, J. `bodies` gives mass and y of each.
pub(crate) fn potential_energy(bodies: impl IntoIterator<Item = (f64, f64)>, g: f64) -> f64 {
    bodies.into_iter().map(|(m, y)| m * g * y).sum()
}

/// Eq. 40-43: tau_1 to tau_4. `rate` is the theta-dots that occur to the first power and `square` those that occur in
/// products; as printed both are the joint velocities.
pub(crate) fn eq_40_to_43(
    given: &Given,
    q: &Vector4<f64>,
    rate: &Vector2<f64>,
    square: &Vector2<f64>,
) -> Vector4<f64> {
    Vector4::new(
        eq_40(given, q, rate, square),
        eq_41(given, q, rate),
        eq_42(given, q, rate),
        eq_43(given, q, rate),
    )
}

/// Eq. 40: tau_1, in the order of the print.
pub(crate) fn eq_40(
    given: &Given,
    q: &Vector4<f64>,
    rate: &Vector2<f64>,
    square: &Vector2<f64>,
) -> f64 {
    let ([m1, m2, m3], [a1, a2, a3], g) = (given.m, given.a, given.g);
    let (c1, c2, c12, s2) = (q.x.cos(), q.y.cos(), (q.x + q.y).cos(), q.y.sin());
    let (v1, v2) = (rate.x, rate.y);
    let (w1, w2) = (square.x, square.y);
    2.0 * a1 * a1 * m1 * v1 + 2.0 * a2 * a2 * m2 * v1 - 2.0 * a2 * a2 * m2 * v2
        + 2.0 * a3 * a3 * m3 * v1
        - 2.0 * a3 * a3 * m3 * v2
        - a1 * a2 * m2 * v1
        + a1 * a2 * m2 * v2
        - a1 * a2 * m3 * v1
        + a1 * a2 * m3 * v2
        + 2.0 * a2 * a3 * m3 * v1
        - 2.0 * a2 * a3 * m3 * v2
        + 2.0 * a2 * g * m2 * c12
        + a2 * g * m2 * c12
        + a3 * g * m3 * c12
        + 2.0 * a1 * g * m1 * c1
        + a1 * g * m2 * c1
        + a1 * g * m3 * c1
        + 2.0 * a1 * a1 * m1 * v1 * c1
        + a1 * a1 * m2 * v1 * c1
        + a1 * a1 * m3 * v1 * c1
        - 2.0 * a2 * a2 * m2 * v1 * c2
        + 2.0 * a2 * a2 * m2 * v2 * c2
        - a2 * a2 * m3 * v1 * c2
        + a2 * a2 * m3 * v2 * c2
        - 2.0 * a1 * a2 * m2 * w1 * w1 * s2
        - a1 * a2 * m2 * w2 * w2 * s2
        - a1 * a2 * m3 * w1 * w1 * s2
        - a1 * a3 * m3 * w1 * w1 * s2
        - a1 * a3 * m3 * w2 * w2 * s2
        + 2.0 * a1 * a2 * m2 * v1 * c12
        + a1 * a2 * m3 * v1 * c12
        + a1 * a3 * m3 * v1 * c12
        + a1 * a2 * m2 * v1 * c2
        - a1 * a2 * m2 * v2 * c2
        + 2.0 * a1 * a3 * m3 * v1 * c2
        - 2.0 * a1 * a3 * m3 * v2 * c2
        - a2 * a3 * m3 * v1 * c2
        + a2 * a3 * m3 * v2 * c2
        + 2.0 * a1 * a2 * m2 * w1 * w2 * s2
        + 2.0 * a1 * a3 * m3 * w1 * w2 * s2
}

/// Eq. 41: tau_2, in the order of the print. It has no product of velocities at all.
pub(crate) fn eq_41(given: &Given, q: &Vector4<f64>, rate: &Vector2<f64>) -> f64 {
    let ([m1, m2, m3], [a1, a2, a3], g) = (given.m, given.a, given.g);
    let (c1, c2, c12) = (q.x.cos(), q.y.cos(), (q.x + q.y).cos());
    let (v1, v2) = (rate.x, rate.y);
    a1 * a1 * m1 * v1 + 2.0 * a2 * a2 * m2 * v1 - 2.0 * a2 * a2 * m2 * v2 + 2.0 * a3 * a3 * m3 * v1
        - 2.0 * a3 * a3 * m3 * v2
        + 2.0 * a2 * a3 * m3 * v1
        - 2.0 * a2 * a3 * m3 * v2
        + 2.0 * a2 * g * m2 * c12
        + a2 * g * m3 * c12
        + a2 * g * m3 * c12
        + a1 * g * m1 * c1
        + a1 * a1 * m1 * v1 * c1
        - 2.0 * a2 * a2 * m2 * v1 * c2
        + 2.0 * a2 * a2 * m2 * v2 * c2
        - a2 * a2 * m3 * v1 * c2
        + a2 * a2 * m3 * v2 * c2
        + 2.0 * a1 * a2 * m2 * v1 * c12
        + a1 * a2 * m3 * v1 * c12
        + a1 * a3 * m3 * v1 * c12
        - a2 * a3 * m3 * v1 * c2
        + a2 * a3 * m3 * v2 * c2
}

/// Eq. 42: tau_3.
pub(crate) fn eq_42(given: &Given, q: &Vector4<f64>, rate: &Vector2<f64>) -> f64 {
    let ([_, m2, m3], [a1, a2, a3], g) = (given.m, given.a, given.g);
    let (c2, c12) = (q.y.cos(), (q.x + q.y).cos());
    let (v1, v2) = (rate.x, rate.y);
    -a2 * m2 * (a2 * v1 - a2 * v2 + g * c12 - a2 * v1 * c2 + a2 * v2 * c2 + a1 * v1 * c12)
        - a3 * m3
            * (2.0 * a3 * v1 - 2.0 * a3 * v2 + g * c12 - a2 * v1 * c2
                + a2 * v2 * c2
                + a1 * v1 * c12)
}

/// Eq. 43: tau_4. The printed formula breaks off inside the last cosine, "cos(theta_1 + theta"; the rest is
/// read as theta_2.
pub(crate) fn eq_43(given: &Given, q: &Vector4<f64>, rate: &Vector2<f64>) -> f64 {
    let ([_, _, m3], [a1, a2, a3], g) = (given.m, given.a, given.g);
    let (c2, c12) = (q.y.cos(), (q.x + q.y).cos());
    let (v1, v2) = (rate.x, rate.y);
    -a3 * m3
        * (2.0 * a3 * v1 - 2.0 * a3 * v2 + g * c12 - a2 * v1 * c2 + a2 * v2 * c2 + a1 * v1 * c12)
}
