//! Gains, and which of them the sampled loop can bear.
//!
//! With the model's inertia a law leaves a double integrator, and its proportional and derivative part the loop
//!
//! ```text
//! L(s) = (2 zeta w s + w^2) / s^2 * e^(-s D),   D = period + command delay
//! ```
//!
//! with bandwidth w and damping zeta. Half a period of D is the hold; velocities are means over a sample, which is the other
//! half. |L| is 1 at c w with c^2 = 2 zeta^2 + sqrt(4 zeta^4 + 1), where the two terms lead by atan(2 zeta c). The delay may
//! take half of that lead (Franklin, Powell & Workman, *Digital Control of Dynamic Systems*, 1998, section 7.4: phase
//! margin). Then the loop gain can about double before the loop becomes unstable, with or without the observer, whose
//! own lead makes up for its integral action: a load lighter than announced, or an axis whose inertia in the present
//! pose is half the nominal one, is still stable. The test `gains` compares with powers of the sampled loop's matrix.

use protocol::messages::{Refusal, RefusalReason};
use protocol::parameters::ControllerParameter as Parameter;
use serde::{Deserialize, Serialize};

use crate::mechanics::math::{atan2, sqrt};

/// Closed-loop gains, the same three numbers for every law and every robot: they yield accelerations, and inertia turns
/// those into torque.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gains {
    /// Natural frequency of the error dynamics, rad/s.
    pub bandwidth: f32,
    /// Damping ratio of the error dynamics.
    pub damping: f32,
    /// Corner frequency of the disturbance observer, or 1 / integral time, rad/s.
    pub observer: f32,
}

impl Gains {
    /// Defaults of the parameter table, for an arm as stiff as the model says, reduced where the delay of sampling
    /// every `period` seconds requires it.
    pub fn for_period(period: f32) -> Self {
        Self {
            bandwidth: Parameter::Bandwidth.initial(period),
            damping: Parameter::Damping.initial(period),
            observer: Parameter::Observer.initial(period),
        }
    }

    /// Refuses gains outside their ranges, and those whose loop, sampled every `period` seconds and acting `command_delay`
    /// seconds after each sample, has too little margin.
    ///
    /// # Errors
    /// [`RefusalReason::OutOfRange`] with the gain and its bound.
    pub fn check(&self, period: f32, command_delay: f32, integrates: bool) -> Result<(), Refusal> {
        for (value, parameter) in [
            (self.bandwidth, Parameter::Bandwidth),
            (self.damping, Parameter::Damping),
            (self.observer, Parameter::Observer),
        ] {
            let allowed = parameter.rule().check(value, period);
            allowed.map_err(|limit| out_of_range(value, limit))?;
        }
        let greatest = greatest_bandwidth(self.damping, period + command_delay);
        if self.bandwidth > greatest {
            return Err(out_of_range(self.bandwidth, greatest));
        }
        // s^3 + 2 zeta w s^2 + w^2 s + w^2 / T has all its roots on the left for 1 / T < 2 zeta w (Routh); half of that.
        let greatest = self.damping * self.bandwidth;
        if integrates && self.observer > greatest {
            return Err(out_of_range(self.observer, greatest));
        }
        Ok(())
    }

    /// Kp, 1/s².
    pub fn proportional(&self) -> f32 {
        self.bandwidth * self.bandwidth
    }

    /// Kd, 1/s.
    pub fn derivative(&self) -> f32 {
        2.0 * self.damping * self.bandwidth
    }

    /// Ki, 1/s³.
    pub fn integral(&self) -> f32 {
        self.proportional() * self.observer
    }
}

/// The bandwidth (rad/s) at which `delay` (s) takes half of the loop's lead.
fn greatest_bandwidth(damping: f32, delay: f32) -> f32 {
    let square = damping * damping;
    let crossover = sqrt(2.0 * square + sqrt(4.0 * square * square + 1.0));
    0.5 * atan2(2.0 * damping * crossover, 1.0) / (crossover * delay)
}

fn out_of_range(value: f32, limit: f32) -> Refusal {
    Refusal::value(RefusalReason::OutOfRange, value, limit)
}
