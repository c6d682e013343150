//! The parameters of the drives.

use protocol::parameters::{DriveParameter as Parameter, Field, Store};
use protocol::time::Period;

use crate::model::DriveTrain;

/// Parameters that can be read and set over the bus.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    period: Period,
    rated_torque: [f32; 4],
    /// Fraction of its peak torque that each motor may give.
    torque_limit: [f32; 4],
    /// Peak torques, N m.
    greatest_torque: [f64; 4],
    hold_samples: u32,
    /// Torque is off.
    pub(super) at_rest: bool,
}

impl Settings {
    pub(super) fn new(train: &DriveTrain, period: Period) -> Self {
        Self {
            period,
            rated_torque: train.motor_torque_rated.map(|torque| torque as f32),
            torque_limit: [
                Parameter::TorqueLimitShoulder,
                Parameter::TorqueLimitElbow,
                Parameter::TorqueLimitLift,
                Parameter::TorqueLimitWrist,
            ]
            .map(|parameter| parameter.initial(period.seconds())),
            greatest_torque: train.motor_torque_limit,
            hold_samples: Parameter::HoldSamples.initial(period.seconds()) as u32,
            at_rest: true,
        }
    }

    /// Samples for which the last command is held without a new one.
    pub(super) fn hold_samples(&self) -> u32 {
        self.hold_samples
    }

    /// Motor torques (N m) cut to their limits.
    pub(super) fn cut(&self, torque: [f32; 4]) -> [f64; 4] {
        std::array::from_fn(|axis| {
            let limit = f64::from(self.torque_limit[axis]) * self.greatest_torque[axis];
            f64::from(torque[axis]).clamp(-limit, limit)
        })
    }
}

impl Store for Settings {
    type Parameter = Parameter;

    fn period(&self) -> f32 {
        self.period.seconds()
    }

    fn is_at_rest(&self) -> bool {
        self.at_rest
    }

    fn field(&mut self, parameter: Parameter) -> Field<'_> {
        Field::Real(match parameter {
            Parameter::RatedTorqueShoulder => &mut self.rated_torque[0],
            Parameter::RatedTorqueElbow => &mut self.rated_torque[1],
            Parameter::RatedTorqueLift => &mut self.rated_torque[2],
            Parameter::RatedTorqueWrist => &mut self.rated_torque[3],
            Parameter::TorqueLimitShoulder => &mut self.torque_limit[0],
            Parameter::TorqueLimitElbow => &mut self.torque_limit[1],
            Parameter::TorqueLimitLift => &mut self.torque_limit[2],
            Parameter::TorqueLimitWrist => &mut self.torque_limit[3],
            Parameter::HoldSamples => return Field::Whole(&mut self.hold_samples),
        })
    }

    fn changed(&mut self, _: Parameter) {}
}
