//! The controller's parameters: where each is stored, and what a change entails.

use protocol::parameters::{ControllerParameter as Parameter, Field, Store};

use super::Controller;

impl Store for Controller {
    type Parameter = Parameter;

    fn period(&self) -> f32 {
        self.config.period.seconds()
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
                return Field::Reading(self.config.period.seconds());
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
            Parameter::SpeedFactor => &mut monitor.speed_factor,
            Parameter::BrakeDelay => &mut setup.brake_delay,
            Parameter::FeedbackTimeout => &mut setup.feedback_timeout,
            Parameter::FeedbackGap => &mut monitor.gap,
            Parameter::FaultSamples => return Field::Whole(&mut monitor.samples),
            Parameter::BadFrames => return Field::Whole(&mut setup.bad_frames),
        })
    }

    fn changed(&mut self, parameter: Parameter) {
        match parameter {
            Parameter::Bandwidth | Parameter::Damping | Parameter::Observer => {
                self.forget();
            }
            _ => {
                let limits = &self.setup.monitor;
                self.max_gap = limits.gap_samples(self.config.period.seconds());
                self.monitor.adopt(&self.config.arm, limits);
            }
        }
    }
}
