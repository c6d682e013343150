//! The observer that holds a plan to the limits of the robot, by the dynamics of the plant.

use std::io;

use nalgebra::Vector4;
use schemars::JsonSchema;
use serde::Serialize;
use sim::model::{Payload, RobotModel};
use sim::observer::{Observer, Truth};
use sim::plant::arm::Arm;
use sim::plant::drive::Drive;
use sim::world::CellEvent;

use super::watch::Course;

/// Greatest shares of the limits that a plan takes, of any axis or motor; in the middle of each sample, where its speed is the mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Peaks {
    /// Effort or motor torque over its limit.
    pub torque: f64,
    /// Change of an effort from sample to sample over what `effort_rise_time_s` of the model allows, dry friction aside.
    pub torque_rate: f64,
    /// Speed of a joint over its limit.
    pub speed: f64,
    /// Farthest past a limit of the position, rad or m.
    pub position: f64,
}

impl Peaks {
    /// Rounding of the controller's numbers, f32: of its positions, and of torques and speeds that are differences of them.
    const ROUNDING: f64 = 1e-3;

    /// Whether one of the limits is passed.
    pub fn is_outside(&self) -> bool {
        let shares = [self.torque, self.torque_rate, self.speed];
        shares.into_iter().any(|share| share > 1.0 + Self::ROUNDING) || self.position > 1e-6
    }
}

/// Measures the reference of a run, sample by sample.
pub(super) struct Limits {
    robot: RobotModel,
    arm: Arm,
    drive: Drive,
    period: f64,
    on: bool,
    /// Position and speed of the last sample.
    before: Option<(Vector4<f64>, Vector4<f64>)>,
    /// Efforts of the last sample without dry friction.
    smooth: Option<Vector4<f64>>,
    peaks: Peaks,
}

impl Limits {
    pub(super) fn new(course: &Course, robot: &RobotModel) -> Self {
        let payload = course.payload.map(Payload::from);
        Self {
            arm: Arm::new(robot, payload.as_ref()),
            drive: Drive::new(&robot.drive),
            robot: robot.clone(),
            period: 1.0 / course.rate_hz,
            on: false,
            before: None,
            smooth: None,
            peaks: Peaks::default(),
        }
    }

    pub(super) fn peaks(&self) -> Peaks {
        self.peaks
    }

    fn watch(&mut self, q: Vector4<f64>, qd: Vector4<f64>) {
        let limits = &self.robot.limits;
        let peaks = &mut self.peaks;
        for axis in 0..4 {
            let past = (q[axis] - limits.upper[axis]).max(limits.lower[axis] - q[axis]);
            peaks.position = peaks.position.max(past);
            peaks.speed = peaks.speed.max(qd[axis].abs() / limits.velocity[axis]);
        }
        let Some((q_before, qd_before)) = self.before.replace((q, qd)) else {
            return;
        };
        let at = self.arm.at(&((q + q_before) / 2.0));
        let (speed, change) = ((qd + qd_before) / 2.0, (qd - qd_before) / self.period);
        let friction = self.drive.friction(&speed);
        let effort = self.arm.inverse_dynamics(&at, &speed, &change)
            + self.drive.rotor_inertia() * change
            + friction;
        let viscous = speed.component_mul(&Vector4::from(self.robot.drive.viscous));
        let smooth = effort - (friction - viscous);
        let motor = self.drive.motor_torque(&effort);
        for axis in 0..4 {
            let shares = [
                effort[axis] / limits.effort[axis],
                motor[axis] / self.robot.drive.motor_torque_limit[axis],
            ];
            peaks.torque = shares
                .iter()
                .fold(peaks.torque, |peak, share| peak.max(share.abs()));
            if let Some(before) = self.smooth {
                let allowed = limits.effort[axis] / limits.effort_rise_time[axis] * self.period;
                let rate = (smooth[axis] - before[axis]).abs() / allowed;
                peaks.torque_rate = peaks.torque_rate.max(rate);
            }
        }
        self.smooth = Some(smooth);
    }
}

impl Observer for Limits {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        if self.on {
            self.watch(truth.mind.q.into(), truth.mind.qd.into());
        }
        Ok(())
    }

    fn cell_event(&mut self, event: &CellEvent) {
        match event {
            CellEvent::BeginCycle => self.on = true,
            CellEvent::EndCycle => self.on = false,
            CellEvent::Attach(_) | CellEvent::Release => {}
        }
    }
}
