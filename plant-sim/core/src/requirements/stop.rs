//! How far the arm goes once it is to stop.

use protocol::messages::Mode;

use crate::observer::Truth;

/// Joint speed below which an axis counts as standing, rad/s and m/s.
const STANDING: f64 = 1e-3;

/// The stop under way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stop {
    begun: Option<f64>,
    distance: f64,
    tool: [f64; 3],
}

impl Stop {
    /// Time, s, and way of the tool, m, since the controller began to stop the arm; none once it stands.
    pub(super) fn sample(&mut self, truth: &Truth) -> Option<(f64, f64)> {
        let [x, y, z, _] = truth.plant.tool;
        let [dx, dy, dz] = [x - self.tool[0], y - self.tool[1], z - self.tool[2]];
        self.tool = [x, y, z];
        if !matches!(
            truth.mind.mode,
            Mode::QuickStop | Mode::FaultReaction | Mode::Fault | Mode::EStop
        ) {
            self.begun = None;
            return None;
        }
        let Some(begun) = self.begun else {
            self.begun = Some(truth.plant.t);
            self.distance = 0.0;
            return Some((0.0, 0.0));
        };
        self.distance += (dx * dx + dy * dy + dz * dz).sqrt();
        let moves = truth.plant.qd.iter().any(|qd| qd.abs() >= STANDING);
        moves.then_some((truth.plant.t - begun, self.distance))
    }
}
