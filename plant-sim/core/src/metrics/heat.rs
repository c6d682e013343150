//! How warm the motors get: the mean square of the effort of each over its continuous limit, as a first-order lag forgets it (I2t).

use std::f64::consts::TAU;

use protocol::parameters::ControllerParameter as Parameter;

use crate::maths::{exp, square};
use crate::model::RobotModel;

/// Time constant, s: the controller's, unless it has been set to another.
pub(crate) fn time_constant() -> f64 {
    f64::from(Parameter::ThermalTime.initial(1.0))
}

/// Heat of the motors of one robot.
#[derive(Clone, Debug)]
pub struct Heat {
    continuous: [f64; 4],
    /// Effort of the wrist for one of the lift, N m/N: what the spline nut's motor turns of it.
    coupling: f64,
    shares: [f64; 4],
    greatest: [f64; 4],
    last: Option<f64>,
}

impl Heat {
    /// Motors that have not done anything for long.
    pub fn new(model: &RobotModel) -> Self {
        let drive = &model.drive;
        Self {
            continuous: model.limits.effort_continuous,
            coupling: drive.screw_hand * drive.screw_lead / TAU,
            shares: [0.0; 4],
            greatest: [0.0; 4],
            last: None,
        }
    }

    /// The efforts of the joints at `t` s, which stand for the time since the last call: N m, N m, N, N m.
    pub fn sample(&mut self, t: f64, tau: &[f64; 4]) {
        let Some(last) = self.last.replace(t) else {
            return;
        };
        // Of each motor by itself.
        let mut own = *tau;
        own[3] -= self.coupling * tau[2];
        let kept = exp(-(t - last) / time_constant());
        for (axis, effort) in own.into_iter().enumerate() {
            let wanted = square(effort / self.continuous[axis]);
            let share = wanted + (self.shares[axis] - wanted) * kept;
            self.shares[axis] = share;
            self.greatest[axis] = self.greatest[axis].max(share);
        }
    }

    /// Now, by axis: 1 is what a motor may have for ever.
    pub fn shares(&self) -> [f64; 4] {
        self.shares
    }

    /// The greatest so far, by axis.
    pub fn greatest(&self) -> [f64; 4] {
        self.greatest
    }
}
