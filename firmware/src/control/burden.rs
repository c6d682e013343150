//! Which mass the lift carries beyond the announced one, by its weight.

use crate::mechanics::math::clamp;

/// Time constant of the mean, s. Friction that the model does not have acts against the motion: it is gone in the mean of strokes down and up.
const TIME: f32 = 1.0;
/// How much heavier than at rest a mass may be, speeding up with 5 g.
const HEAVIEST: f32 = 6.0;
/// Greatest mass that is told, kg: the most that the report can carry.
const MOST: f32 = 300.0;

/// A mean of the lift's effort that the model does not explain.
#[derive(Clone, Copy, Debug)]
pub struct Burden {
    /// kg.
    mass: f32,
}

impl Burden {
    /// What was announced.
    pub fn new() -> Self {
        Self { mass: 0.0 }
    }

    /// Mass beyond the announced one, kg.
    pub fn mass(&self) -> f32 {
        self.mass
    }

    /// Accounts for a time, s, in which the lift was pulled down by this force, N, that the model does not explain, while a mass was so much heavier
    /// than at rest: 1 at rest, 0 in free fall. That evens out what the mean has of the present stroke; it is 1 in the mean.
    pub fn account(&mut self, pull: f32, gravity: f32, heavier: f32, time: f32) {
        let part = clamp(time / TIME, 0.0, 1.0 / HEAVIEST);
        let error = pull / gravity - self.mass * clamp(heavier, -HEAVIEST, HEAVIEST);
        self.mass = clamp(self.mass + error * part, -MOST, MOST);
    }
}

impl Default for Burden {
    fn default() -> Self {
        Self::new()
    }
}
