//! What follows where an axis would need more torque than there is.

use nalgebra::Vector4;
use protocol::messages::{Cause, Fault};

use super::Controller;
use crate::control::readings::Readings;
use crate::control::states::State;
use crate::mechanics::arm::Axis;

/// Share of its greatest speed below which an axis hardly moves. It passes that within milliseconds when it turns back.
const SLOW: f32 = 0.1;

impl Controller {
    /// Slows down a move for which the axes would need more torque than there is, as with a heavier load than was announced.
    // Out of line: rare in a sample.
    #[inline(never)]
    pub(super) fn ease(&mut self, torque: &Vector4<f32>, qd: &Vector4<f32>) {
        if self.state != State::Moving {
            return;
        }
        let (arm, drive) = (&self.config.arm, &self.body.drive);
        let joint = torque.component_div(&arm.limits.effort);
        let motor = drive
            .motor_torque(torque)
            .component_div(&arm.drive.motor_torque_limit);
        let needed = joint.abs().sup(&motor.abs());
        let axis = needed.imax();
        let speeds_up = torque
            .get(axis)
            .zip(qd.get(axis))
            .is_some_and(|(torque, qd)| torque * qd > 0.0);
        self.queue.ease(needed.max(), speeds_up);
    }

    /// Counts samples in which an axis hardly moves at its torque limit. An axis that speeds up may be at its limit; one that
    /// stays there where it is meets something that the model does not have; one whose encoder does not move at all may be
    /// anywhere.
    // Out of line: rare in a sample.
    #[inline(never)]
    pub(super) fn strain(&mut self, readings: &Readings, qd: &Vector4<f32>) {
        let slow = self.config.arm.limits.velocity * SLOW;
        let stands =
            |axis: &Axis| axis.of(&self.excess) != 0.0 && axis.of(qd).abs() < axis.of(&slow);
        let Some(axis) = Axis::ALL.into_iter().find(stands) else {
            return;
        };
        self.saturated += 1;
        let time = self.saturated as f32 * self.config.period.seconds();
        let limit = self.setup.saturation_time;
        if time >= limit {
            let fault = if readings.is_still(axis) {
                Fault::value(Cause::StuckSensor, axis.of(&self.error), 0.0)
            } else {
                Fault::value(Cause::OverTorque, time * 1e3, limit * 1e3)
            };
            let axis = axis.into();
            self.fail(Fault { axis, ..fault });
        }
    }
}
