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
//!
//! Encoders are another bound. A position is known to a count, and so a mean velocity over a sample to a count per period, which the
//! derivative part and the observer turn into torque: with an inertia J the step
//!
//! ```text
//! J (2 zeta w + observer) count / period
//! ```
//!
//! up and down, from sample to sample. What it takes of the torque limit is lost to moves, which need that limit, and beyond some
//! tenths the loop does nothing but chatter. So the defaults are lowered until it is [`Gains::ENCODER_STEP`] at the most, for the arm stretched
//! with the heaviest payload; of a finer encoder nothing is to be seen. A payload off the axis of the flange can have many times the
//! inertia of everything else that the wrist turns: whoever announces one lowers the gains for it ([`Gains::for_load`]).

use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};
use protocol::parameters::ControllerParameter as Parameter;
use serde::{Deserialize, Serialize};

use crate::mechanics::arm::{ArmModel, Axis, Payload};
use crate::mechanics::body::Body;
use crate::mechanics::kinematics::Trig;
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
    /// Share of an axis' torque limit that a count of its encoder may make with the default gains. The plan leaves as much as half of that
    /// of each limit, and a step is half above the mean and half below.
    pub const ENCODER_STEP: f32 = 0.1;

    /// Greatest bandwidth in manual operation, rad/s: the loop is stable with a reading that is 10 ms late, and diverges slowly with
    /// one of which that cannot be said. What moves slowly needs no more.
    pub const MANUAL: f32 = 25.0;

    /// Defaults of the parameter table, for an arm as stiff as the model says, reduced where the delay of sampling
    /// every `period` seconds requires it.
    pub fn for_period(period: f32) -> Self {
        Self {
            bandwidth: Parameter::Bandwidth.initial(period),
            damping: Parameter::Damping.initial(period),
            observer: Parameter::Observer.initial(period),
        }
    }

    /// The same for `arm` with its heaviest payload, on the axis of the flange: with bandwidth and observer lowered where its encoders are too
    /// coarse for them.
    pub fn for_arm(arm: &ArmModel, period: f32) -> Self {
        let heaviest = Payload {
            mass: arm.payload_max,
            ..Payload::NONE
        };
        Self::for_load(arm, &heaviest, period)
    }

    /// The same for `arm` with this payload.
    // Out of line: once.
    #[inline(never)]
    pub fn for_load(arm: &ArmModel, payload: &Payload, period: f32) -> Self {
        let mut gains = Self::for_period(period);
        let (_, step) = gains.encoder_step(arm, payload, period);
        if step > Self::ENCODER_STEP {
            let lower = |gain: &mut f32, least: f32| {
                *gain = (*gain * (Self::ENCODER_STEP / step)).max(least)
            };
            lower(&mut gains.bandwidth, Parameter::Bandwidth.rule().lower);
            lower(&mut gains.observer, Parameter::Observer.rule().lower);
        }
        gains
    }

    /// The axis on which a count of the encoder makes the greatest step of the torque, as a share of its limit, and that share. For
    /// the stretched arm, with the centre of mass of `payload` where frame 4 has it while axis 4 is at 0: farthest out along x.
    pub fn encoder_step(&self, arm: &ArmModel, payload: &Payload, period: f32) -> (Axis, f32) {
        let body = Body::new(arm, payload);
        let inertia = body.own_inertia(&Trig::new(&Vector4::zeros()));
        let count = body.drive.motor_angle_of_counts(&[1; 4]);
        // What each axis gets from its own motor, which turns as much more as it gives less.
        let step = count.component_div(&body.drive.own_torque(&Vector4::repeat(1.0)));
        let torque = inertia.component_mul(&step) * ((self.derivative() + self.observer) / period);
        let shares = torque.component_div(&body.torque_limit.fixed_rows::<4>(0));
        let mut greatest = (Axis::Shoulder, 0.0);
        for axis in Axis::ALL {
            let share = axis.of(&shares);
            if share > greatest.1 {
                greatest = (axis, share);
            }
        }
        greatest
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

    /// The same as used in manual operation.
    pub fn in_manual(self) -> Self {
        let bandwidth = self.bandwidth.min(Self::MANUAL);
        Self {
            bandwidth,
            observer: self.observer.min(self.damping * bandwidth),
            ..self
        }
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
