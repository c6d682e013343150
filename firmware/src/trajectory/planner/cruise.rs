//! Speed along an arc: as fast as the torques can keep the tool on its circle.

use protocol::messages::Refusal;

use super::{Planner, Stage};
use crate::mechanics::math::clamp;
use crate::trajectory::Reference;
use crate::trajectory::torque_budget::TorqueBudget;

/// Places at which the torques are looked at: some evenly spread, and the apex.
pub(super) const PLACES: u8 = EVEN + 1;
const EVEN: u8 = 13;
/// Where they begin, as a share of the way, and how far they are from the end: nearer to either the move is slower anyway.
const MARGIN: f32 = 0.15;

impl Planner {
    /// One place. An S-curve as fast as its ends allow would be slowed down all along for the torque that the turn takes in its middle: with
    /// this, arcs take 1.22 to 1.40 times the optimum of their torques, in place of 1.28 to 1.62 (lines 1.17 to 1.27).
    #[inline(never)]
    pub(super) fn cruise(&mut self, budget: &TorqueBudget<'_>, place: u8) -> Result<(), Refusal> {
        let (begin, end) = (MARGIN, 1.0 - MARGIN);
        let s = if place < EVEN {
            begin + (end - begin) / f32::from(EVEN - 1) * f32::from(place)
        } else {
            clamp(self.apex, begin, end)
        };
        let here = self.point(budget.arm, s)?;
        let speed = &mut self.bounds.speed;
        let even = Reference {
            q: here.q,
            qd: here.dq * *speed,
            qdd: here.ddq * (*speed * *speed),
        };
        *speed *= budget.torque_scale(&even).0;
        self.stage = if place < EVEN {
            Stage::Cruise { place: place + 1 }
        } else {
            Stage::Rest { place: 0 }
        };
        Ok(())
    }
}
