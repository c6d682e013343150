//! The control laws of the paper, corrected, one file each, selectable at run time.
//!
//! | law | paper | what it uses |
//! |---|---|---|
//! | [`kinematic_joint`] | kinematic control, joint space | inner velocity loop |
//! | [`kinematic_task`] | kinematic control, task space | Jacobian, inner velocity loop |
//! | [`pid`] | named, not given | nominal inertias |
//! | [`pd_gravity`] | dynamic control, joint space | g(q), nominal inertias |
//! | [`computed_torque`] | dynamic control, joint space, tracking form | M, C, g, friction |
//! | [`computed_torque_task`] | eq 49 | the same and the Jacobian |
//!
//! All are pure functions of a [`ControlInput`] plus a [`Memory`] (integrals). Outputs are joint torques: N m, N m, N, N m.

pub mod computed_torque;
pub mod computed_torque_task;
mod control_input;
mod gains;
pub mod kinematic_joint;
pub mod kinematic_task;
pub mod observer;
pub mod pd_gravity;
pub mod pid;
mod velocity_loop;

use nalgebra::Vector4;
use protocol::messages::{Compensation, Law, Refusal};
use serde::{Deserialize, Serialize};

use crate::mechanics::kinematics::Trig;

pub use control_input::{ControlInput, Motion, Output, Task};
pub use gains::Gains;

/// What a law remembers between samples.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    integral: Vector4<f32>,
}

impl Memory {
    /// Nothing remembered.
    pub fn new() -> Self {
        Self {
            integral: Vector4::zeros(),
        }
    }

    /// Adds `error` over one sample, except where the axis is saturated in that direction
    /// (clamping anti-windup, Åström & Hägglund, *Advanced PID Control*, section 3.5). Returns
    /// the integral.
    fn integrate(&mut self, error: &Vector4<f32>, motion: &Motion<'_>) -> Vector4<f32> {
        let winds_up = motion.excess.component_mul(error).map(|x| x > 0.0);
        self.integral += error.zip_map(
            &winds_up,
            |e, stop| {
                if stop { 0.0 } else { e * motion.period }
            },
        );
        self.integral
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// A law, its compensation of friction and payload error, and its gains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Selection {
    /// The law.
    pub law: Law,
    /// Used by the two computed-torque laws.
    pub compensation: Compensation,
    /// Gains.
    pub gains: Gains,
}

impl Selection {
    /// Refuses gains with which the sampled loop of this law would not be stable with a margin; see [`Gains::check`].
    ///
    /// # Errors
    /// [`RefusalReason::OutOfRange`](protocol::messages::RefusalReason::OutOfRange) with the gain and its bound.
    pub fn check(&self, period: f32, command_delay: f32) -> Result<(), Refusal> {
        let integrates = self.law == Law::Pid || self.compensation == Compensation::Integral;
        self.gains.check(period, command_delay, integrates)
    }

    /// Joint torques for one sample, without those of the observer, and what it goes on with.
    // Out of line: so its instructions and its stack can be measured.
    #[inline(never)]
    pub fn torque(&self, input: &ControlInput<'_>, memory: &mut Memory) -> Output {
        let ControlInput { motion, body, .. } = input;
        let gains = &self.gains;
        let trig = Trig::relative_in_line(&motion.q);
        // Begun here, so that what is known already does not take registers until the end.
        let mut output = Output {
            torque: Vector4::zeros(),
            couplings: body.lagrange.couplings(&trig),
            friction: body.drive.friction(&motion.setpoint.ahead.qd),
        };
        output.torque = match self.law {
            Law::KinematicJoint => kinematic_joint::torque(input, gains, memory),
            Law::KinematicTask => kinematic_task::torque(input, &trig, gains, memory),
            Law::Pid => pid::torque(input, gains, memory),
            Law::PdGravity => pd_gravity::torque(input, gains),
            Law::ComputedTorqueJoint => {
                computed_torque::torque(input, &output, gains, self.compensation, memory)
            }
            Law::ComputedTorqueTask => {
                let position = (&trig, &output);
                computed_torque_task::torque(input, position, gains, self.compensation, memory)
            }
        };
        output
    }
}
