//! What the controller tells about itself.

use nalgebra::Vector4;
use protocol::messages::{Cause, Emergency, Fault, LimitFlags, Mode, MotionReply};

use super::Controller;
use crate::control::laws::Selection;
use crate::control::setup::Setup;
use crate::control::states::State;
use crate::mechanics::arm::ArmModel;
use crate::trajectory::{Rates, Reference};

impl Controller {
    /// State of the cabinet.
    pub fn state(&self) -> State {
        self.state
    }

    /// State of the cabinet as it is reported.
    pub fn mode(&self) -> Mode {
        self.state.mode()
    }

    /// The first fault since the last reset, or [`Fault::NONE`].
    pub fn fault(&self) -> &Fault {
        &self.fault
    }

    /// Cause of the first fault since the last reset.
    pub fn cause(&self) -> Cause {
        self.fault.cause
    }

    /// The first fault not reported to the peers yet.
    pub fn alarm(&self) -> &Option<Emergency> {
        let [first, ..] = &self.alarms;
        first
    }

    /// The same, once it has been reported.
    pub fn take_alarm(&mut self) -> Option<Emergency> {
        let [first, second, third] = self.alarms;
        self.alarms = [second, third, None];
        first
    }

    pub(super) fn keep_alarm(&mut self, fault: Fault) {
        let free = self.alarms.iter_mut().find(|alarm| alarm.is_none());
        if let Some(free) = free {
            *free = Some(Emergency::new(fault.cause, fault.value.to_bits()));
        }
    }

    /// The robot.
    pub fn arm(&self) -> &ArmModel {
        &self.arm
    }

    /// Law, compensation and gains in use.
    pub fn selection(&self) -> &Selection {
        &self.setup.selection
    }

    /// What can be changed while the controller runs.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Reference of the last sample.
    pub fn reference(&self) -> &Reference {
        &self.setpoint.reference
    }

    /// How the arm is meant to move when the command of the last sample acts.
    pub fn ahead(&self) -> &Rates {
        &self.setpoint.ahead
    }

    /// Reference minus measured position of the last sample.
    pub fn following_error(&self) -> &Vector4<f32> {
        &self.error
    }

    /// Efforts of the last sample that the model does not explain: N m, N m, N, N m.
    pub fn disturbance(&self) -> &Vector4<f32> {
        self.observer.residual()
    }

    /// Heat of each motor: 1 is what it may have for ever.
    pub fn heat(&self) -> &Vector4<f32> {
        self.heat.shares()
    }

    /// Mass that the lift feels beyond the announced payload, kg.
    pub fn burden(&self) -> f32 {
        self.burden.mass()
    }

    /// Every limit that has acted since the last call.
    pub fn take_limits(&mut self) -> LimitFlags {
        core::mem::take(&mut self.limits)
    }

    /// Moves planned or waiting.
    pub fn queued(&self) -> u8 {
        self.queue.len()
    }

    /// Whether a move is being planned, or the passage between two, which makes a sample expensive.
    pub fn is_planning(&self) -> bool {
        self.queue.is_busy()
    }

    /// Share of its planned speed at which a move passes or would pass now.
    pub fn pace(&self) -> f32 {
        self.queue.pace_now()
    }

    /// Number of the move under way, or about to begin.
    pub fn under_way(&self) -> Option<u8> {
        self.queue.under_way()
    }

    /// Number of the last move that was completed.
    pub fn completed(&self) -> u8 {
        self.queue.completed()
    }

    /// Number of replies to send.
    pub fn answers_waiting(&self) -> usize {
        self.replies.len()
    }

    /// Requests that were never answered, because too many replies were waiting.
    pub fn unanswered(&self) -> u16 {
        self.unanswered
    }

    /// The next reply to send to an operator.
    pub fn take_reply(&mut self) -> Option<MotionReply> {
        self.replies.pop_front()
    }
}
