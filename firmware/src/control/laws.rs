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
//! All are pure functions of a [`ControlInput`] plus a [`Memory`] (integrals and observer). Outputs
//! are joint torques: N m, N m, N, N m.

pub mod computed_torque;
pub mod computed_torque_task;
mod control_input;
pub mod kinematic_joint;
pub mod kinematic_task;
pub mod observer;
pub mod pd_gravity;
pub mod pid;
mod velocity_loop;

use nalgebra::Vector4;
use protocol::messages::{Compensation, Law, Refusal, RefusalReason};
use protocol::parameters::ControllerParameter as Parameter;
use serde::{Deserialize, Serialize};

pub use control_input::{ControlInput, Model, Motion, Task};
use observer::MomentumObserver;

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

    /// Refuses gains that cannot be stable at this sampling period.
    ///
    /// # Errors
    /// [`RefusalReason::OutOfRange`] with the gain and its bound: a bandwidth or observer corner
    /// above a quarter radian per sample leaves no phase margin for the delays of sampling and bus.
    pub fn check(&self, period: f32) -> Result<(), Refusal> {
        for (value, parameter) in [
            (self.bandwidth, Parameter::Bandwidth),
            (self.damping, Parameter::Damping),
            (self.observer, Parameter::Observer),
        ] {
            parameter
                .rule()
                .check(value, period)
                .map_err(|limit| Refusal::value(RefusalReason::OutOfRange, value, limit))?;
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

/// What a law remembers between samples.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    integral: Vector4<f32>,
    observer: MomentumObserver,
}

impl Memory {
    /// Nothing remembered.
    pub fn new() -> Self {
        Self {
            integral: Vector4::zeros(),
            observer: MomentumObserver::new(),
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
    /// Joint torques for one sample.
    pub fn torque(&self, input: &ControlInput<'_>, memory: &mut Memory) -> Vector4<f32> {
        let gains = &self.gains;
        match self.law {
            Law::KinematicJoint => kinematic_joint::torque(input, gains, memory),
            Law::KinematicTask => kinematic_task::torque(input, gains, memory),
            Law::Pid => pid::torque(input, gains, memory),
            Law::PdGravity => pd_gravity::torque(input, gains),
            Law::ComputedTorqueJoint => {
                computed_torque::torque(input, gains, self.compensation, memory)
            }
            Law::ComputedTorqueTask => {
                computed_torque_task::torque(input, gains, self.compensation, memory)
            }
        }
    }
}
