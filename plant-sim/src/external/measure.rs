//! The real-time loop by itself: drives at rest, an answering controller, and a clock.

use std::time::Duration;

use firmware::mechanics::arm::ArmModel;
use link::LinkAddress;
use protocol::time::Period;
use protocol::wire::BitTiming;
use sim::drives::Drives;
use sim::model::RobotModel;
use sim::rig::{Rig, RigConfig, RunError};

use super::timing::Timing;
use super::{RealTime, WallClock};

/// Exchanges feedback and commands with the controller on `bus`, `rate_hz` times per second for `time`. The brake stays
/// closed and no motion is requested.
///
/// # Errors
/// The bus or the controller fails; see [`RealTime::connect`].
pub fn measure(bus: &LinkAddress, rate_hz: f64, time: Duration) -> Result<Timing, RunError> {
    let actual = RobotModel::irb_930_22_105();
    let limits = &actual.limits;
    let config = RigConfig {
        start: std::array::from_fn(|axis| (limits.lower[axis] + limits.upper[axis]) / 2.0),
        nominal: ArmModel::from(&actual),
        period: Period::of_rate(rate_hz),
        timing: BitTiming::default(),
        actual,
    };
    let mut clock = WallClock::new(config.period);
    let mut rig = Rig::new(&config);
    rig.attach(Drives::new(&config.actual, config.period));
    rig.attach(RealTime::connect(bus, config.controller(), &clock)?);
    for _ in 0..(time.as_secs_f64() * rate_hz).round() as u64 {
        rig.step(&mut clock, &mut ())?;
    }
    Ok(clock.timing().clone())
}
