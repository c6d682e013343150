//! Linear equations with a mass matrix.

use nalgebra::{Matrix4, Vector4};

/// L D L^T of a symmetric positive definite matrix (Golub and Van Loan, Matrix Computations, section 4.1).
///
/// No square roots and no test of the pivots: kinetic energy is positive for every motion of links that have mass and
/// inertia, which the model guarantees.
pub(super) struct Factor {
    /// L below its diagonal of ones.
    lower: [[f64; 4]; 4],
    /// Reciprocals of D.
    reciprocal: [f64; 4],
}

impl Factor {
    /// Factors `matrix`, of which the lower half is read.
    pub(super) fn of(matrix: &Matrix4<f64>) -> Self {
        let (mut lower, mut pivot, mut reciprocal) = ([[0.0; 4]; 4], [0.0; 4], [0.0; 4]);
        for j in 0..4 {
            pivot[j] = matrix[(j, j)];
            for k in 0..j {
                pivot[j] -= lower[j][k] * lower[j][k] * pivot[k];
            }
            reciprocal[j] = 1.0 / pivot[j];
            for i in j + 1..4 {
                let mut entry = matrix[(i, j)];
                for k in 0..j {
                    entry -= lower[i][k] * lower[j][k] * pivot[k];
                }
                lower[i][j] = entry * reciprocal[j];
            }
        }
        Self { lower, reciprocal }
    }

    /// The solution of `matrix x = right`.
    pub(super) fn solve(&self, right: &Vector4<f64>) -> Vector4<f64> {
        let mut x = *right;
        for i in 1..4 {
            for k in 0..i {
                x[i] -= self.lower[i][k] * x[k];
            }
        }
        for i in 0..4 {
            x[i] *= self.reciprocal[i];
        }
        for i in (0..3).rev() {
            for k in i + 1..4 {
                x[i] -= self.lower[k][i] * x[k];
            }
        }
        x
    }
}
