//! Linear equations with a mass matrix.

use nalgebra::{Matrix4, Vector4};

/// L D L^T of a symmetric positive definite matrix (Golub and Van Loan, Matrix Computations, section 4.1) whose lift is
/// coupled with the wrist alone.
///
/// The lift comes first: so eliminated, it leaves the coupling of the other joints as it is, and L keeps the zeros of the
/// matrix.
///
/// No square roots and no test of the pivots: kinetic energy is positive for every motion of links that have mass and
/// inertia, which the model guarantees.
pub(crate) struct Factor {
    /// L below its diagonal of ones: the wrist by the lift, the elbow by the shoulder, the wrist by both.
    by_lift: f64,
    elbow_by_shoulder: f64,
    by_shoulder: f64,
    by_elbow: f64,
    /// Reciprocals of D.
    reciprocal: Vector4<f64>,
}

impl Factor {
    /// Factors `matrix`, of which the lower half is read.
    pub(crate) fn of(matrix: &Matrix4<f64>) -> Self {
        let m = |i, j| matrix[(i, j)];
        let (lift, shoulder) = (1.0 / m(2, 2), 1.0 / m(0, 0));
        let by_lift = m(3, 2) * lift;
        let elbow_by_shoulder = m(1, 0) * shoulder;
        let by_shoulder = m(3, 0) * shoulder;
        let elbow = 1.0 / (m(1, 1) - elbow_by_shoulder * m(1, 0));
        let left = m(3, 1) - elbow_by_shoulder * m(3, 0);
        let by_elbow = left * elbow;
        let wrist = 1.0 / (m(3, 3) - by_lift * m(3, 2) - by_shoulder * m(3, 0) - by_elbow * left);
        Self {
            by_lift,
            elbow_by_shoulder,
            by_shoulder,
            by_elbow,
            reciprocal: Vector4::new(shoulder, elbow, lift, wrist),
        }
    }

    /// The solution of `matrix x = right`.
    pub(crate) fn solve(&self, right: &Vector4<f64>) -> Vector4<f64> {
        let mut x = *right;
        x[1] -= self.elbow_by_shoulder * x[0];
        x[3] -= self.by_lift * x[2] + self.by_shoulder * x[0] + self.by_elbow * x[1];
        x.component_mul_assign(&self.reciprocal);
        x[1] -= self.by_elbow * x[3];
        x[0] -= self.elbow_by_shoulder * x[1] + self.by_shoulder * x[3];
        x[2] -= self.by_lift * x[3];
        x
    }
}
