//! Axes that stand although what drives them would have moved them: their encoders show nothing.
//!
//! A loop ends at some counts from its reference, and the observer makes of them an effort that grows until the axis moves. One that stands to the
//! count while that effort grows beyond what friction can hold does move, and its encoder does not show it; or it is blocked, which looks the same.
//! Efforts are what the model does not explain. An axis that a load holds beside its reference has one all the time: only how much it grows counts.

use nalgebra::Vector4;

use crate::control::monitor::first_beyond;
use crate::control::readings::Readings;
use crate::mechanics::arm::Axis;

/// Growth as a multiple of the dry friction that is too much: what friction holds, if it is as the model says, and half as much again.
const BEYOND: f32 = 1.5;
/// Counts of the encoder that an axis may be off by meanwhile. The loop pulls it from one to the next as on a spring; one that has come and gone
/// between two looks is the speed of a sample to the observer.
const COUNTS: f32 = 2.0;

/// Watches axes that stand. Looked at now and then.
#[derive(Clone, Copy, Debug)]
pub struct Stance {
    places: [Place; 4],
}

/// Where an axis was found.
#[derive(Clone, Copy, Debug)]
struct Place {
    count: i32,
    /// Magnitude of the effort then, N m, lift N; while it moves, when it was looked at before the last time.
    effort: f32,
    /// The same when it was last looked at.
    last: f32,
}

impl Stance {
    /// A watch that has seen nothing.
    pub fn new() -> Self {
        let nowhere = Place {
            count: i32::MAX,
            effort: f32::INFINITY,
            last: f32::INFINITY,
        };
        Self {
            places: [nowhere; 4],
        }
    }

    /// Judges the efforts that the model does not explain (N m, lift N), with the dry friction of each axis and what the loop makes of a
    /// count. Looks are `close` where an axis that came to rest between two of them hardly slowed down before the first: an effort that has
    /// grown since then is that of the motion which an encoder misses that got stuck. Returns the first axis whose effort has grown by more than
    /// these hold, with that growth and its bound.
    pub fn look(
        &mut self,
        readings: &Readings,
        effort: &Vector4<f32>,
        friction: &Vector4<f32>,
        spring: &Vector4<f32>,
        close: bool,
    ) -> Option<(Axis, f32, f32)> {
        let bound = friction * BEYOND + spring * COUNTS;
        let mut growths = [0.0; 4];
        let axes = Axis::ALL.into_iter().zip(self.places.iter_mut());
        for ((axis, place), growth) in axes.zip(growths.iter_mut()) {
            *growth = place.growth(axis, readings, effort, close);
        }
        let growth = Vector4::from(growths);
        let axis = first_beyond(&growth, &bound)?;
        Some((axis, axis.of(&growth), axis.of(&bound)))
    }
}

impl Place {
    /// How much more the effort of an axis is than when it was first found here, if it is; 0 if it moves, and is somewhere else from now on.
    // Out of line, for the size of four copies.
    #[inline(never)]
    fn growth(
        &mut self,
        axis: Axis,
        readings: &Readings,
        effort: &Vector4<f32>,
        close: bool,
    ) -> f32 {
        let count = readings.counts.get(axis as usize).copied();
        let effort = axis.of(effort).abs();
        let last = core::mem::replace(&mut self.last, effort);
        let moves = axis.of(&readings.velocity) != 0.0;
        if moves || count != Some(self.count) {
            self.effort = match (close, moves) {
                (false, _) => effort,
                (true, true) => last,
                // An encoder may have got stuck in the middle of the sample that was last looked at.
                (true, false) => self.effort.min(last).min(effort),
            };
            self.count = count.unwrap_or_default();
            return 0.0;
        }
        // Less than 0 after a load was lost.
        (effort - self.effort).max(0.0)
    }
}

impl Default for Stance {
    fn default() -> Self {
        Self::new()
    }
}
