//! The real-time loop by itself: drives at rest, a controller that answers, and a clock.

use std::time::Duration;

use firmware::control::controller::Config;
use firmware::mechanics::arm::ArmModel;
use link::LinkAddress;

use super::RealTime;
use super::timing::Timing;
use sim::drives::Drives;
use sim::endpoint::{Endpoint, EndpointError};
use sim::model::RobotModel;
use sim::plant::Plant;

/// Exchanges feedback and commands with the controller on `bus`, `rate_hz` times a second for `time`. The brake stays
/// closed: nothing moves, and the controller is never asked to.
///
/// # Errors
/// The bus or the controller fails; see [`RealTime::connect`].
pub fn measure(bus: &LinkAddress, rate_hz: f64, time: Duration) -> Result<Timing, EndpointError> {
    let period_ns = (1e9 / rate_hz).round();
    let model = RobotModel::irb_930_22_105();
    let limits = &model.limits;
    let middle = std::array::from_fn(|axis| (limits.lower[axis] + limits.upper[axis]) / 2.0);
    let mut plant = Plant::new(&model, middle);
    let mut drives = Drives::new(&model, period_ns * 1e-9);
    let config = Config::new(ArmModel::from(&model), (period_ns * 1e-9) as f32);
    let mut controller = RealTime::connect(bus, config)?;
    let mut sent = Vec::new();
    for sample in 0..(time.as_secs_f64() * rate_hz).round() as u64 {
        let now = sample * period_ns as u64;
        controller.poll(now / 1000, None, &mut sent)?;
        plant.advance_to(now);
        let feedback = drives.feedback(&mut plant);
        controller.poll(now / 1000, Some(&feedback), &mut sent)?;
        for frame in sent.drain(..) {
            drives.receive(&frame, &mut plant);
        }
    }
    Ok(controller.timing().clone())
}
