//! What entering a mode does, what leads out of one, and what pins and drives are told in it.

use nalgebra::Vector4;
use protocol::messages::{Cause, ControlWord, DriveStatus, Mode};

use super::{Controller, Shutdown};
use crate::control::laws::Memory;
use crate::control::mode::{self, Event};
use crate::control::monitor::Finding;

impl Controller {
    pub(super) fn enter(&mut self, next: Mode, was_powered: bool) {
        let brake = self.brake_samples();
        match next {
            Mode::Enabling => {
                self.opening = brake;
                self.memory = Memory::new();
                self.monitor.reset();
            }
            Mode::Disabling => self.shutdown = Shutdown::Closing(brake),
            Mode::FaultReaction | Mode::EStop => {
                self.withdraw();
                self.shutdown = match self.shutdown {
                    Shutdown::Off if was_powered => Shutdown::Stopping,
                    already => already,
                };
            }
            Mode::Fault => {
                self.withdraw();
                self.queue.clear(&self.reference.q);
                self.shutdown = Shutdown::Off;
            }
            Mode::PreOperational => self.cause = Cause::None,
            _ => {}
        }
        self.mode = next;
    }

    pub(super) fn fail(&mut self, finding: Finding) {
        if mode::transition(self.mode, Event::Fail).is_some() {
            self.alarm = Some(finding);
            self.event(Event::Fail, finding.cause);
        }
    }

    pub(super) fn watch(&mut self, status: DriveStatus, q: &Vector4<f32>, qd: &Vector4<f32>) {
        if !mode::is_powered(self.mode) {
            return;
        }
        let error = self.reference.q - q;
        // The reference of the last sample: at most one sample of motion older than `q`.
        let moved = self.reference.qd * self.config.period;
        if let Some(finding) = self.monitor.check(status, q, qd, &(error + moved)) {
            self.fail(finding);
        }
    }

    /// Whether torque holds or moves the arm.
    pub(super) fn is_holding(&self) -> bool {
        mode::is_powered(self.mode) || self.shutdown != Shutdown::Off
    }

    pub(super) fn brake_samples(&self) -> u32 {
        (self.config.brake_delay / self.config.period) as u32 + 1
    }

    pub(super) fn count_brake(&mut self, steps: u32) {
        if self.mode == Mode::Enabling {
            self.opening = self.opening.saturating_sub(steps);
            if self.opening == 0 {
                self.event(Event::BrakeOpen, Cause::None);
            }
        }
        if let Shutdown::Closing(left) = self.shutdown {
            let left = left.saturating_sub(steps);
            self.shutdown = Shutdown::Closing(left);
            if left == 0 {
                self.shutdown = Shutdown::Off;
                self.event(Event::BrakeClosed, Cause::None);
            }
        }
    }

    /// What drives and pins are to do now: unlike the command sent last, it also follows what
    /// happens between two samples.
    pub fn control_word(&self) -> ControlWord {
        let holding = self.is_holding();
        let closing = matches!(self.shutdown, Shutdown::Closing(_));
        ControlWord::EMPTY
            .with(ControlWord::TORQUE_ENABLE, holding)
            .with(ControlWord::BRAKE_RELEASE, holding && !closing)
            .with(ControlWord::QUICK_STOP, self.is_stopping())
            .with(ControlWord::ESTOP, self.mode == Mode::EStop)
    }
}
