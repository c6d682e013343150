//! Entry actions of the states, and the events that change them.

use nalgebra::Vector4;
use protocol::messages::{Cause, ControlWord, DriveStatus, Fault, FaultAxis, LimitFlags};

use super::{Actions, Controller};
use crate::control::fault;
use crate::control::monitor::{Felt, Monitor};
use crate::control::readings::Readings;
use crate::control::states::{Event, Halt, State};
use crate::mechanics::body::Body;
use crate::trajectory::{Reference, Setpoint};

/// Speed of the lift, m/s, from which on it cannot be stopped where it is within its following error.
const SLOW_LIFT: f32 = 0.2;

impl Controller {
    /// Takes the transition of the current state on `event`; returns whether there is one.
    pub fn event(&mut self, event: Event) -> bool {
        let Some(mut next) = self.state.after(event, self.brake_samples()) else {
            return false;
        };
        if matches!(self.state, State::Enabling(_)) && self.built_up == 0.0 {
            next = next.without_torque();
        }
        if event == Event::SelfTestPassed {
            self.body = Body::new(&self.arm, &self.setup.payload);
        }
        self.enter(next);
        true
    }

    /// Reacts to a fault according to the fault table. The first fault is kept until a reset; every fault that changes
    /// the state is reported.
    // Out of line: rarely reached in a sample.
    #[inline(never)]
    pub fn fail(&mut self, fault: Fault) {
        let before = self.fault;
        let first = before.cause == Cause::None;
        if first {
            // Before the transition, which may lead to a state without a latched fault.
            self.fault = fault;
        }
        let changed = match fault::event(fault.cause, self.state) {
            // The lift need not fall because an axis of the arm has to be without torque, least of all if its brake is stuck.
            Some(Event::FaultOff) if self.state.is_powered() && is_of_arm(fault.axis) => {
                let first = !self.limp;
                if first {
                    let Reference { q, qd, .. } = self.setpoint.reference;
                    self.lift_held = (qd.z.abs() < SLOW_LIFT).then_some(q.z);
                }
                self.limp = true;
                self.event(Event::FaultBrake) || first
            }
            event => event.is_some_and(|event| self.event(event)),
        };
        if changed || (first && fault.cause == Cause::SelfTest) {
            self.keep_alarm(fault);
        } else {
            self.fault = before;
        }
    }

    fn enter(&mut self, next: State) {
        match next {
            State::Enabling(_) => {
                self.limp = false;
                self.drives_on = false;
                self.built_up = 0.0;
                self.misplaced = 0;
                self.unlearn();
                self.monitor.reset();
            }
            State::Fault(halt) | State::EStop(halt) => {
                self.withdraw();
                // A violation has to recur before it escalates.
                self.monitor.reset();
                if let Halt::Closing(_) = halt {
                    self.misplaced = 0;
                }
                if halt == Halt::Off {
                    self.queue.clear(&self.setpoint.reference.q);
                }
            }
            State::PreOperational => self.fault = Fault::NONE,
            _ => {}
        }
        self.state = next;
    }

    /// Bridges a gap in the feedback if it is short.
    // Out of line: rare.
    #[inline(never)]
    pub(super) fn bridge(&mut self, steps: u32) {
        if steps > self.max_gap {
            let gap = steps as f32 * self.period * 1e3;
            let fault = Fault::value(Cause::FeedbackLost, gap, self.setup.monitor.gap * 1e3);
            self.fail(fault);
        } else if self.state.is_powered() {
            self.limits = self.limits | LimitFlags::PREDICTED;
        }
    }

    /// Watches the arm as long as torque moves or holds it, including a stop for a fault.
    pub(super) fn watch(&mut self, readings: &Readings, q: &Vector4<f32>, qd: &Vector4<f32>) {
        if !self.state.is_powered() {
            return;
        }
        // Drives that missed commands have switched off by themselves, and nobody else says so. After too long a gap in the feedback, the
        // stop goes on with them.
        self.drives_on |= readings.status.contains(DriveStatus::TORQUE_ON);
        let has_torque = self.expects_torque() && readings.steps <= self.max_gap;
        if let Some(fault) = Monitor::status(readings.status, has_torque) {
            self.fail(fault);
        }
        let is_to_be_open = matches!(
            self.state,
            State::Enabled | State::Moving | State::QuickStop
        );
        if is_to_be_open && !readings.status.contains(DriveStatus::BRAKE_RELEASED) {
            self.fail(closed_brake(readings.status));
        }
        let error = self.setpoint.reference.q - q;
        if self.limp {
            // Nothing else is under torque.
            if let Some(fault) = self.monitor.shaft(&error) {
                self.fail(fault);
            }
            return;
        }
        // The reference of the last sample: at most one sample of motion older than `q`.
        let moved = self.setpoint.reference.qd * self.period;
        let (drive, last) = (&self.body.drive, &self.last_velocity);
        let errors = [&(error + moved), &self.error];
        let last_qd = || super::last_qd(drive, last);
        if let Some(fault) = self.monitor.check(readings, q, qd, errors, last_qd)
            && !(fault.cause == Cause::SoftLimit && self.is_freed(q))
        {
            self.fail(fault);
        }
    }

    /// Whether the drives should have torque: while the brake opens they may not be on yet.
    pub fn expects_torque(&self) -> bool {
        self.state.is_powered() && (self.drives_on || !matches!(self.state, State::Enabling(_)))
    }

    /// Holds a lift that was at rest where it is, as its brake closes: the path of the stop may lead on.
    // Out of line: rare in a sample.
    #[inline(never)]
    pub(super) fn hold_lift(&mut self) {
        if let Some(place) = self.lift_held {
            let Setpoint { reference, ahead } = &mut self.setpoint;
            (reference.q.z, reference.qd.z, reference.qdd.z) = (place, 0.0, 0.0);
            (ahead.qd.z, ahead.qdd.z) = (0.0, 0.0);
        }
    }

    /// Reacts to what was felt in this sample. The torques of the last one go on for it: those of the law would be the answer to readings that
    /// are wrong.
    // Out of line: rare in a sample.
    #[inline(never)]
    pub(super) fn react(&mut self, felt: Felt) -> Actions {
        match felt {
            Felt::Fault(fault) => self.fail(fault),
            Felt::Missed => {
                self.missed = 1;
                self.unlearn();
            }
            Felt::Nothing => {}
        }
        self.act(self.chatter.last())
    }

    /// Samples that have passed besides those that the drives have counted since the last one.
    pub fn take_missed(&mut self) -> u32 {
        core::mem::take(&mut self.missed)
    }

    /// Counts down the time of the brake. One that has not closed by then does not hold the lift: torque goes on holding it,
    /// until the brake has closed or the drives are off. One that has not opened has as much time again, since the command may have been
    /// lost: nothing may move before.
    pub(super) fn wait(&mut self, readings: &Readings) {
        let (state, event) = self.state.wait(readings.steps);
        self.state = state;
        let Some(event) = event else {
            return;
        };
        let status = readings.status;
        match (event, status.contains(DriveStatus::BRAKE_RELEASED)) {
            (Event::BrakeOpen, false) => {
                self.misplaced = self.misplaced.saturating_add(readings.steps);
                if self.misplaced >= self.brake_samples() {
                    self.fail(closed_brake(status));
                }
            }
            (Event::BrakeClosed, true) => {
                let fault = open_brake(status);
                self.fail(fault);
                if self.misplaced == 0 {
                    // Told once, also where it changes nothing.
                    self.misplaced = 1;
                    self.keep_alarm(fault);
                }
            }
            _ => {
                self.misplaced = 0;
                self.event(event);
            }
        }
    }

    /// Watches an arm without torque. Ready, it needs sound drives, a closed brake, and no encoder may jump. The brake alone holds it: one
    /// that does not close in its time is told once, and keeps the arm from being ready; one that opens by itself is told at once.
    pub(super) fn watch_at_rest(&mut self, readings: &Readings, q: &Vector4<f32>) {
        let status = readings.status;
        if self.state == State::Ready {
            // Since the last sample, which may have been the last one under torque.
            let moved = self.setpoint.reference.q - self.error - q;
            let jump = self.monitor.jumped(&moved, readings.steps as f32);
            let jump = jump.filter(|_| self.is_placed);
            if let Some(fault) = Monitor::status(status, false).or(jump) {
                self.fail(fault);
            }
        }
        if !status.contains(DriveStatus::BRAKE_RELEASED) {
            self.misplaced = 0;
            return;
        }
        let was_told = self.is_unheld();
        let was_closed = self.state == State::Ready;
        self.misplaced = if was_closed {
            u32::MAX
        } else {
            self.misplaced.saturating_add(readings.steps)
        };
        if self.is_unheld() && (was_closed || !was_told) {
            self.fail(open_brake(status));
        }
    }

    /// Whether an arm without torque has been without its brake for longer than that takes to close.
    pub fn is_unheld(&self) -> bool {
        self.misplaced >= self.brake_samples()
    }

    /// Time of the brake, samples.
    fn brake_samples(&self) -> u32 {
        (self.setup.brake_delay / self.period) as u32 + 1
    }

    /// The control word for drives and pins now: unlike the last command sent, it includes what has happened since that
    /// sample.
    pub fn control_word(&self) -> ControlWord {
        self.state.control_word()
    }
}

/// The fault of a brake that is open where it should hold, with what the drives say.
fn open_brake(status: DriveStatus) -> Fault {
    Fault::value(Cause::DriveFault, f32::from(status.bits()), 0.0)
}

/// The fault of a brake that is closed where the lift is to move: with what the drives say, and what they do not.
fn closed_brake(status: DriveStatus) -> Fault {
    let missing = DriveStatus::BRAKE_RELEASED.bits();
    Fault::value(
        Cause::DriveFault,
        f32::from(status.bits()),
        f32::from(missing),
    )
}

/// Whether a fault concerns an axis of the arm, and not the shaft that the brake holds.
fn is_of_arm(axis: FaultAxis) -> bool {
    matches!(axis, FaultAxis::Shoulder | FaultAxis::Elbow)
}
