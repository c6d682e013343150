//! What follows where an axis would need more torque than there is, for an instant or for ever, or where its torque swings.

use nalgebra::Vector4;
use protocol::messages::{Cause, Fault, LimitFlags, Operation};

use super::Controller;
use crate::control::fault::{CHATTER_PERCENT, OVERLOAD_PERCENT};
use crate::control::heat;
use crate::control::readings::Readings;
use crate::control::states::State;
use crate::mechanics::arm::Axis;

/// Time at its torque limit of an axis that is off its reference and whose encoder does not move, s. One that starts or turns back
/// moves in the next sample: the greatest torque speeds up the stretched arm with the greatest payload by 16 mrad/s in a millisecond.
/// At least two samples: the mean over one in the middle of which it turns back is none.
const STUCK_TIME: f32 = 0.0022;
const STUCK_SAMPLES: u32 = 2;
/// Share of the following error from which on it is off. One that holds against the others may be at its limit, and stand where it
/// is meant to: it has [`PATIENCE`] times as long.
const STUCK_ERROR: f32 = 0.05;
const PATIENCE: u32 = 8;
/// Share of the torque of the last command that the motor of such an axis has at least, by its drive.
const PULLS: f32 = 0.8;
/// How much faster a motor gets whose axis turns back however much the others work against it, rad/s². Its encoder moves.
const TURNING: f32 = 100.0;
/// Share of its greatest speed below which an axis hardly moves. It passes that within milliseconds when it turns back.
const SLOW: f32 = 0.1;

/// What need not be done in every sample takes turns, in so many: in the first, planning pauses for a look at what chatters and at the peers, and
/// for reports, half the period of the state at 1 kHz; in the second, axes that stand are looked at, and in the middle heat and burden are accounted
/// for. Counted in samples and not in time, so that the same feedback gives the same torques.
pub const TURNS: u32 = 10;
/// Instructions of a Cortex-M4F that heat and burden take.
const ACCOUNT: u16 = 300;

/// A torque that swings from limit to limit, %, as [`Chatter`](crate::control::chatter::Chatter) counts it.
const FULL_SWING: f32 = 400.0;

impl Controller {
    /// Slows down a move for which the axes would need more torque than there is, as with a heavier load than was announced.
    // Out of line: rare in a sample.
    #[inline(never)]
    pub(super) fn ease(&mut self, torque: &Vector4<f32>, qd: &Vector4<f32>) {
        if self.state != State::Moving {
            return;
        }
        // More than this where the motor of the wrist has to turn lift and wrist, which neither shows by itself.
        let (mut needed, mut speeds_up) = (1.0, false);
        let limits = self.body.torque_limit.as_slice();
        for ((torque, qd), limit) in torque.as_slice().iter().zip(qd.as_slice()).zip(limits) {
            let share = torque.abs() / limit;
            if share > needed {
                (needed, speeds_up) = (share, torque * qd > 0.0);
            }
        }
        self.queue.ease(needed, speeds_up);
    }

    /// Judges a sample in which a torque was cut. An axis that speeds up may be at its limit. One whose encoder does not move
    /// may be anywhere, unless the brake holds it. One that stays where it is meets something that the model does not have.
    // Out of line: rare in a sample.
    #[inline(never)]
    pub(super) fn strain(&mut self, readings: &Readings, qd: &Vector4<f32>) {
        let period = self.period;
        let excess = self.excess;
        let slow = self.arm.limits.velocity * SLOW;
        let off = self.setup.monitor.following_error * STUCK_ERROR;
        let stills = Axis::ALL.map(|axis| self.strains(axis, readings).then_some(axis));
        let is_off = |axis: &Axis| axis.of(&self.error).abs() > axis.of(&off);
        let stuck = stills.into_iter().flatten().find(is_off);
        let stands = |axis: &Axis| axis.of(&excess) != 0.0 && axis.of(qd).abs() < axis.of(&slow);

        let before = self.last_velocity;
        let turns = |axis: Axis| {
            let gained = axis.of(&(readings.velocity - before)) * axis.of(&excess).signum();
            readings.stays_still(axis, axis.of(&before)) && gained > TURNING * period
        };
        match stuck.or(stills.into_iter().flatten().next()) {
            Some(axis) if self.stuck > 0 && turns(axis) => {}
            Some(axis) if !self.state.is_braking() => {
                self.stuck += if stuck.is_some() { PATIENCE } else { 1 };
                let is_long = self.stuck as f32 * period > STUCK_TIME * PATIENCE as f32;
                if is_long && self.stuck >= STUCK_SAMPLES * PATIENCE {
                    let (error, limit) = (axis.of(&self.error), axis.of(&off));
                    self.blame(axis, Cause::StuckSensor, error, limit);
                }
            }
            _ => self.stuck = 0,
        }
        let rise = self.arm.limits.effort_rise_time / period;
        if let Some(axis) = self.chatter.cut(&excess, &rise) {
            let limit = f32::from(CHATTER_PERCENT);
            self.blame(axis, Cause::Chatter, FULL_SWING, limit);
        }
        if let Some(axis) = Axis::ALL.into_iter().find(stands) {
            self.saturated += 1;
            let time = self.saturated as f32 * period;
            let limit = self.setup.saturation_time;
            if time >= limit {
                self.blame(axis, Cause::OverTorque, time * 1e3, limit * 1e3);
            }
        }
    }

    /// Whether the encoder of an axis does not move while its motor is to pull with all it has, and pulls as it was told. Where commands are lost,
    /// drives go on with older ones.
    // Out of line, for the size of four copies.
    #[inline(never)]
    fn strains(&self, axis: Axis, readings: &Readings) -> bool {
        let excess = axis.of(&self.excess);
        if excess == 0.0 || !readings.is_still(axis) {
            return false;
        }
        let lacks = axis.of(&readings.torque) - PULLS * axis.of(&self.chatter.last());
        lacks * excess.signum() >= 0.0
    }

    /// Looks for chatter, which need not be done in every sample.
    pub fn look(&mut self) {
        let period = self.period;
        let limit = &self.arm.drive.motor_torque_limit;
        let rise = &self.arm.limits.effort_rise_time;
        if let Some((axis, percent)) = self.chatter.look(limit, rise, period) {
            let limit = f32::from(CHATTER_PERCENT);
            self.blame(axis, Cause::Chatter, percent, limit);
        }
    }

    /// Nor this, which stands for `samples` samples: accounts for the heat of the motors, too much of which slows down the moves that begin from
    /// now on, and what that does not cool stops the arm; and weighs what the lift carries.
    fn account(&mut self, samples: u32) {
        let time = samples as f32 * self.period;
        let part = time / self.setup.thermal_time;
        // Of each motor by itself.
        let continuous = (self.arm.limits.effort_continuous)
            .component_div(&self.body.drive.own_torque(&Vector4::repeat(1.0)));
        let torques = self.chatter.torques();
        let (axis, heat) = self.heat.account(torques, &continuous, part);
        let limit = f32::from(OVERLOAD_PERCENT);
        if heat > limit * 1e-2 {
            self.blame(axis, Cause::Overload, heat * 100.0, limit);
        }
        let pace = heat::pace(heat);
        if pace < 1.0 {
            self.limits = self.limits | LimitFlags::WARM;
        }
        self.queue.set_cool_pace(pace);
        if self.state.is_powered() && !self.state.is_braking() {
            let gravity = self.arm.gravity;
            let heavier = 1.0 - self.setpoint.reference.qdd.z / gravity;
            let pull = self.observer.residual().z;
            self.burden.account(pull, gravity, heavier, time);
        }
    }

    /// Plans, or watches axes that stand where there is nothing to plan: in one of ten samples; in manual operation, where a moment counts, in each,
    /// and while the arm moves in every other one rather than planning. `turn` is that of the sample. Returns whether there was anything to plan.
    pub fn plan_or_watch(&mut self, readings: &Readings, turn: u32) -> bool {
        let is_manual = self.operation == Operation::Manual;
        let is_turn = if is_manual { turn % 2 == 1 } else { turn == 1 };
        let is_first = is_manual && is_turn && self.state == State::Moving;
        let spent = if turn == TURNS / 2 {
            self.account(TURNS);
            ACCOUNT
        } else {
            0
        };
        let planned = !is_first && self.plan(spent);
        if !planned && (is_manual || is_turn) {
            self.watch_stance(readings);
        }
        planned
    }

    /// Blames the encoder of an axis that stands while its loop makes more and more of that. With a law that does not, the axis does not move.
    // Out of line: in one sample of ten.
    #[inline(never)]
    fn watch_stance(&mut self, readings: &Readings) {
        if self.limp || !self.state.is_powered() || self.state.is_braking() {
            return;
        }
        let drive = &self.body.drive;
        let gains = &self.lowered().gains;
        let corner = gains.observer.max(self.least_corner);
        let stiffness = self.body.nominal_inertia * (gains.proportional() + corner / self.period);
        let count = stiffness.component_mul(&drive.own_count());
        let effort = self.observer.residual();
        let close = self.operation == Operation::Manual;
        let found = (self.stance).look(readings, effort, drive.coulomb(), &count, close);
        if let Some((axis, growth, bound)) = found {
            self.blame(axis, Cause::StuckSensor, growth, bound);
        }
    }

    // Out of line, for the size of six copies.
    #[inline(never)]
    fn blame(&mut self, axis: Axis, cause: Cause, value: f32, limit: f32) {
        let axis = axis.into();
        self.fail(Fault {
            axis,
            ..Fault::value(cause, value, limit)
        });
    }
}
