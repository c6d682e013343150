//! The controller's parameters: where each is stored, and what a change entails.

use protocol::parameters::{ControllerParameter as Parameter, Field, Store};

use super::Controller;
use crate::control::laws::{Gains, Selection};

/// Bisections of the way from a value to one that is refused: a thousandth of it remains.
const HALVINGS: u8 = 10;

impl Store for Controller {
    type Parameter = Parameter;

    fn period(&self) -> f32 {
        self.period
    }

    fn is_at_rest(&self) -> bool {
        self.is_idle()
    }

    #[inline(never)]
    fn field(&mut self, parameter: Parameter) -> Field<'_> {
        let setup = &mut self.setup;
        let gains = &mut setup.selection.gains;
        let monitor = &mut setup.monitor;
        Field::Real(match parameter {
            Parameter::SamplingPeriod => {
                return Field::Reading(self.period);
            }
            Parameter::PayloadMass => return Field::Reading(setup.payload.mass),
            Parameter::Bandwidth => &mut gains.bandwidth,
            Parameter::Damping => &mut gains.damping,
            Parameter::Observer => &mut gains.observer,
            Parameter::CommandDelay => &mut setup.command_delay,
            Parameter::FollowingErrorShoulder => &mut monitor.following_error.x,
            Parameter::FollowingErrorElbow => &mut monitor.following_error.y,
            Parameter::FollowingErrorLift => &mut monitor.following_error.z,
            Parameter::FollowingErrorWrist => &mut monitor.following_error.w,
            Parameter::RangeMarginShoulder => &mut monitor.range_margin.x,
            Parameter::RangeMarginElbow => &mut monitor.range_margin.y,
            Parameter::RangeMarginLift => &mut monitor.range_margin.z,
            Parameter::RangeMarginWrist => &mut monitor.range_margin.w,
            Parameter::CollisionLimit => &mut monitor.collision,
            Parameter::SpeedFactor => &mut monitor.speed_factor,
            Parameter::BrakeDelay => &mut setup.brake_delay,
            Parameter::FeedbackTimeout => &mut setup.feedback_timeout,
            Parameter::HeartbeatTimeout => &mut setup.heartbeat_timeout,
            Parameter::HoldTime => &mut setup.hold_time,
            Parameter::SaturationTime => &mut setup.saturation_time,
            Parameter::ThermalTime => &mut setup.thermal_time,
            Parameter::FeedbackGap => &mut monitor.gap,
            Parameter::FaultSamples => return Field::Whole(&mut monitor.samples),
            Parameter::BadFrames => return Field::Whole(&mut setup.bad_frames),
        })
    }

    /// Gains and command delay together have to leave the loop a margin. The limit is the value nearest to the one asked
    /// for, to a thousandth of the way from the present one, with which they do.
    #[inline(never)]
    fn check(&self, parameter: Parameter, value: f32) -> Result<(), f32> {
        let Selection { gains, .. } = self.setup.selection;
        let mut numbers = [
            gains.bandwidth,
            gains.damping,
            gains.observer,
            self.setup.command_delay,
        ];
        let index = match parameter {
            Parameter::Bandwidth => 0,
            Parameter::Damping => 1,
            Parameter::Observer => 2,
            Parameter::CommandDelay => 3,
            _ => return Ok(()),
        };
        let Some(&(mut good)) = numbers.get(index) else {
            return Ok(());
        };
        let (mut bad, mut tried) = (value, value);
        for halving in 0..=HALVINGS {
            if let Some(number) = numbers.get_mut(index) {
                *number = tried;
            }
            let [bandwidth, damping, observer, delay] = numbers;
            let gains = Gains {
                bandwidth,
                damping,
                observer,
            };
            let selection = Selection {
                gains,
                ..self.setup.selection
            };
            match selection.check(self.period(), delay) {
                Ok(()) if halving == 0 => return Ok(()),
                Ok(()) => good = tried,
                Err(_) => bad = tried,
            }
            tried = 0.5 * (good + bad);
        }
        Err(good)
    }

    fn changed(&mut self, parameter: Parameter) {
        match parameter {
            Parameter::Bandwidth | Parameter::Damping | Parameter::Observer => {
                self.forget();
            }
            _ => {
                let limits = &self.setup.monitor;
                let period = self.period;
                self.max_gap = limits.gap_samples(period);
                self.monitor.adopt(&self.arm, limits, period);
            }
        }
    }
}
