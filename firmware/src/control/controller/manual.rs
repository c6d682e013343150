//! Manual operation: moves go on only while they are held, and slowly (ISO 10218-1).

use nalgebra::Vector4;
use protocol::messages::{Cause, Fault, FaultAxis, Law, Operation, Refusal, RefusalReason};

use super::Controller;
use super::requests::Answer;
use crate::control::laws::Selection;
use crate::control::states::State;
use crate::mechanics::jacobian::Jacobian;
use crate::mechanics::kinematics::Trig;
use crate::trajectory::tool_speed;

impl Controller {
    /// How the arm is operated.
    pub fn operation(&self) -> Operation {
        self.operation
    }

    /// Operates the arm like this from now on. Nothing moves, and nothing is about to. Where the loop is too slow to keep the tool so,
    /// there is no manual operation.
    pub(super) fn operate_as(&mut self, operation: Operation) -> Result<Answer, Refusal> {
        let is_manual = operation == Operation::Manual;
        let (rate, least) = (1.0 / self.period, tool_speed::LEAST_RATE);
        // Periods are rounded.
        if is_manual && rate < least - 0.01 {
            return Err(Refusal::value(RefusalReason::OutOfRange, rate, least));
        }
        self.operation = operation;
        self.held = 0;
        self.too_fast = 0;
        self.queue.set_held(is_manual.then_some(false));
        Ok(Answer::Now)
    }

    /// Lets moves go on for another hold time.
    pub(super) fn hold(&mut self) -> Result<Answer, Refusal> {
        match self.state {
            _ if self.operation == Operation::Automatic => {
                return Err(Refusal::because(RefusalReason::WrongState));
            }
            State::Enabled | State::Moving => {
                self.held = (self.setup.hold_time / self.period + 0.5) as u16;
                self.queue.set_held(Some(true));
            }
            // It comes to rest first.
            State::QuickStop => {}
            _ => return Err(Refusal::because(RefusalReason::NotEnabled)),
        }
        Ok(Answer::Never)
    }

    /// Counts down the time of the last hold.
    pub(super) fn loosen(&mut self, steps: u32) {
        if self.held > 0 {
            self.held = u32::from(self.held).saturating_sub(steps) as u16;
            if self.held == 0 {
                self.queue.set_held(Some(false));
            }
        }
    }

    /// Nobody holds a move any more.
    pub(super) fn let_go(&mut self) {
        self.loosen(u32::MAX);
        self.too_fast = 0;
    }

    /// The law where it is not used as it was chosen.
    // Out of line: not in automatic operation.
    #[inline(never)]
    pub(super) fn lowered(&self) -> Selection {
        let mut selection = self.setup.selection;
        if self.operation == Operation::Manual {
            selection.gains = selection.gains.in_manual();
        }
        if self.limp {
            // What the arm's encoders show must not reach the shaft.
            selection.law = Law::PdGravity;
        }
        selection
    }

    /// Judges the velocity of the flange, measured.
    #[inline(never)]
    pub(super) fn watch_tool(&mut self, q: &Vector4<f32>, qd: &Vector4<f32>) {
        let jacobian = Jacobian::new(&self.arm.geometry, &Trig::new(q));
        let speed = tool_speed::of(&jacobian.task_velocity(qd));
        if speed <= tool_speed::LIMIT {
            self.too_fast = 0;
            return;
        }
        self.too_fast = self.too_fast.saturating_add(1);
        if u32::from(self.too_fast) >= self.setup.monitor.samples {
            self.too_fast = 0;
            let fault = Fault::value(Cause::OverSpeed, speed, tool_speed::LIMIT);
            let axis = FaultAxis::Tool;
            self.fail(Fault { axis, ..fault });
        }
    }

    /// Whether an axis beyond its range is on its way back, or stands: in manual operation that frees it.
    // Out of line: rare.
    #[inline(never)]
    pub(super) fn is_freed(&self, q: &Vector4<f32>) -> bool {
        let limits = &self.arm.limits;
        let qd = &self.setpoint.reference.qd;
        let inward = |((q, qd), (lower, upper)): ((&f32, &f32), (&f32, &f32))| {
            !(q > upper && *qd > 0.0 || q < lower && *qd < 0.0)
        };
        let limits = limits.lower.as_slice().iter().zip(limits.upper.as_slice());
        self.operation == Operation::Manual
            && q.as_slice()
                .iter()
                .zip(qd.as_slice())
                .zip(limits)
                .all(inward)
    }
}
