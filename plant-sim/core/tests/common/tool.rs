//! How fast the tool truly is.

use sim::observer::PlantState;
use sim::plant::kinematics::wrap;

/// How far from the axis of the flange a point of the tool may be, m.
const REACH: f64 = 0.1;

/// The speed of the fastest point of the tool between two samples, m/s, by where it truly was.
pub(crate) fn speed(a: &PlantState, b: &PlantState) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|i| b.tool[i] - a.tool[i]);
    let turn = wrap(b.tool[3] - a.tool[3]).abs();
    (x.hypot(y) + REACH * turn).hypot(z) / (b.t - a.t)
}
