//! Generalised-momentum disturbance observer (De Luca & Mattone, 2003).
//!
//! With p = M qd and M' = C + C^T, p' = tau + d + C^T qd - g - friction for the unknown torque d;
//! C^T qd is the gradient of the kinetic energy with respect to q.
//! The residual r = K (p - integral of all known terms and r) follows d as a first-order low-pass
//! with corner K. It needs no acceleration and does not wind up when an axis saturates, since it uses the torque that
//! the drives report instead of the commanded one.

use nalgebra::Vector4;

use super::{Motion, Output};
use crate::mechanics::body::Body;

/// State of the observer.
#[derive(Clone, Copy, Debug)]
pub struct MomentumObserver {
    expected: Vector4<f32>,
    residual: Vector4<f32>,
    /// Mean torque of the sample before the last one.
    previous_torque: Vector4<f32>,
    /// Friction that the laws counted with in the last sample, and in the one before.
    friction: [Vector4<f32>; 2],
    /// What the law gets: the residual, or less of it with a corner below the least.
    for_law: Vector4<f32>,
    started: bool,
}

impl MomentumObserver {
    /// An observer that has seen nothing.
    pub fn new() -> Self {
        Self {
            expected: Vector4::zeros(),
            residual: Vector4::zeros(),
            previous_torque: Vector4::zeros(),
            friction: [Vector4::zeros(); 2],
            for_law: Vector4::zeros(),
            started: false,
        }
    }

    /// Estimated disturbance at the joints, positive along +q: N m, N m, N, N m.
    pub fn residual(&self) -> &Vector4<f32> {
        &self.residual
    }

    /// The same with the corner of the law, which may be less than that of the residual.
    pub fn for_law(&self) -> &Vector4<f32> {
        &self.for_law
    }

    /// Estimates the disturbance after one more sample.
    ///
    /// The corner is bounded to half a radian per sample, where the discrete filter still behaves like the continuous
    /// one.
    pub fn update(
        &mut self,
        body: &Body,
        motion: &Motion<'_>,
        law: &Output,
        [corner, least]: [f32; 2],
    ) {
        let period = motion.period;
        let couplings = &law.couplings;
        let bias = couplings.bias(&motion.qd_ahead);
        let kinetic_gradient = couplings.kinetic_gradient(&motion.qd);
        // Velocities are means over a sample and stand for its middle. The inertia is that of its end: half a sample of the
        // change M' qd = C qd + C^T qd takes the momentum back to the middle.
        let half = 0.5 * period;
        let mut momentum = body.inertial(couplings, &motion.qd);
        // The lift has no part in either, and the shoulder none in the second.
        momentum.x -= bias.x * half;
        momentum.y -= (bias.y + kinetic_gradient.y) * half;
        momentum.w -= (bias.w + kinetic_gradient.w) * half;
        if !self.started {
            self.started = true;
            self.expected = momentum;
            self.previous_torque = motion.torque;
            return;
        }
        // Between two such velocities act the second half of one torque sample and the first half of the next, and the
        // friction of the instant between them.
        let torque = 0.5 * (motion.torque + self.previous_torque);
        self.previous_torque = motion.torque;
        // Each was that of an instant ahead of its sample: the one between them is at the end of the last sample.
        let [last, before] = self.friction;
        self.friction = [law.friction, last];
        let share = motion.lead / period;
        let friction = last + (before - last) * if share < 1.0 { share } else { 1.0 };
        let mut unknown = torque + kinetic_gradient - friction;
        unknown.z -= body.lagrange.gravity().z;
        self.expected += (unknown + self.residual) * motion.elapsed;
        let greatest = 0.5 / period;
        let is_slow = corner < least;
        let own = if is_slow { least } else { corner };
        let own = if own < greatest { own } else { greatest };
        let before = self.residual;
        self.residual = (momentum - self.expected) * own;
        if is_slow {
            self.filter(&before, corner / own, corner * motion.elapsed);
        } else {
            self.for_law = self.residual;
        }
    }

    /// The low-pass with a lower corner of what the residual is the low-pass of: with r that one, `before` a sample ago, and s the slow one,
    /// s' = r' corner / own + corner (r - s).
    // Out of line: not with the gains that most will have.
    #[inline(never)]
    fn filter(&mut self, before: &Vector4<f32>, share: f32, angle: f32) {
        self.for_law += (self.residual - before) * share + (before - self.for_law) * angle;
    }
}

impl Default for MomentumObserver {
    fn default() -> Self {
        Self::new()
    }
}
