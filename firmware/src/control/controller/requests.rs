//! Which requests an operator may make in which state.

use nalgebra::Vector4;
use protocol::messages::{Compensation, MotionRequest, Refusal, RefusalReason};

use super::Controller;
use crate::control::burden::Burden;
use crate::control::laws::{Gains, Selection};
use crate::control::states::{Event, State};
use crate::mechanics::arm::{ModelError, Payload, Rule};
use crate::mechanics::body::Body;
use crate::mechanics::kinematics::Pose;
use crate::trajectory::request::{Request, Target};

/// When a request is answered.
pub(super) enum Answer {
    Now,
    WhenPlanned,
    Never,
}

impl Controller {
    pub(super) fn accept(
        &mut self,
        sequence: u8,
        request: &MotionRequest,
    ) -> Result<Answer, Refusal> {
        let answer = match request {
            MotionRequest::Enable => return self.operate(Event::Enable),
            MotionRequest::Disable if !self.queue.is_empty() => {
                return Err(Refusal::because(RefusalReason::Moving));
            }
            MotionRequest::Disable => return self.operate(Event::Disable),
            MotionRequest::FaultReset if self.state.is_halting() => {
                return Err(Refusal::because(RefusalReason::Moving));
            }
            MotionRequest::FaultReset => return self.operate(Event::Reset),
            MotionRequest::Stop => {
                self.withdraw();
                if self.state == State::Enabled {
                    // Planned but not started: there is nothing to brake.
                    self.queue.clear(&self.setpoint.reference.q);
                }
                self.event(Event::Stop);
                Answer::Now
            }
            MotionRequest::MoveJoint {
                target,
                speed,
                zone,
            } => {
                let target = Target::Joints(Vector4::from(*target));
                self.enqueue(sequence, target, [*speed, 0.0, *zone])?
            }
            MotionRequest::MoveLine {
                target,
                speed,
                posture,
                tool_speed,
                zone,
            } => {
                let target = Target::Line(pose(target), *posture);
                self.enqueue(sequence, target, [*speed, *tool_speed, *zone])?
            }
            MotionRequest::MoveArc {
                target,
                via,
                speed,
                posture,
                tool_speed,
                zone,
            } => {
                let target = Target::Arc((*via).into(), pose(target), *posture);
                self.enqueue(sequence, target, [*speed, *tool_speed, *zone])?
            }
            MotionRequest::Jump {
                target,
                top,
                clearance,
                speed,
                posture,
                zone,
            } => {
                let target = Target::Jump {
                    pose: pose(target),
                    posture: *posture,
                    top: *top,
                    clearance: *clearance,
                };
                self.enqueue(sequence, target, [*speed, 0.0, *zone])?
            }
            MotionRequest::SetOverride { pace } => {
                self.queue.set_pace(*pace);
                Answer::Now
            }
            MotionRequest::Hold => self.hold()?,
            _ if !self.is_idle() => return Err(Refusal::because(RefusalReason::Moving)),
            MotionRequest::SetOperation { operation } => self.operate_as(*operation)?,
            MotionRequest::SetPayload { mass, com, inertia } => {
                let payload = Payload {
                    mass: *mass,
                    com: (*com).into(),
                    inertia: (*inertia).into(),
                };
                self.arm
                    .validate_payload(&payload)
                    .map_err(payload_refusal)?;
                self.setup.payload = payload;
                self.body = Body::new(&self.arm, &self.setup.payload);
                self.burden = Burden::new();
                self.forget();
                Answer::Now
            }
            MotionRequest::SelectLaw { law, compensation }
                if *compensation != Compensation::None && !law.takes_compensation() =>
            {
                return Err(Refusal::because(RefusalReason::NoCompensation));
            }
            MotionRequest::SelectLaw { law, compensation } => self.select(Selection {
                law: *law,
                compensation: *compensation,
                ..self.setup.selection
            })?,
            MotionRequest::SetGains {
                bandwidth,
                damping,
                observer,
            } => self.select(Selection {
                gains: Gains {
                    bandwidth: *bandwidth,
                    damping: *damping,
                    observer: *observer,
                },
                ..self.setup.selection
            })?,
        };
        Ok(answer)
    }

    /// Uses this law with these gains from the next sample on.
    fn select(&mut self, selection: Selection) -> Result<Answer, Refusal> {
        selection.check(self.period, self.setup.command_delay)?;
        self.setup.selection = selection;
        self.forget();
        Ok(Answer::Now)
    }

    /// Resets the law's memory, which is valid only for the gains and the model it was gathered with.
    // Out of line, like the next: each has several callers, none of them in a sample.
    #[inline(never)]
    pub(super) fn forget(&mut self) {
        self.unlearn();
        self.queue.try_full_pace();
    }

    /// Whether law, gains and model may change: nothing moves or is about to, and no fault is latched.
    #[inline(never)]
    pub(super) fn is_idle(&self) -> bool {
        matches!(self.state, State::Ready | State::PreOperational)
            || (self.state == State::Enabled && self.queue.is_empty())
    }

    fn operate(&mut self, event: Event) -> Result<Answer, Refusal> {
        if self.event(event) {
            Ok(Answer::Now)
        } else {
            Err(Refusal::because(RefusalReason::WrongState))
        }
    }

    fn enqueue(
        &mut self,
        sequence: u8,
        target: Target,
        [speed, tool_speed, zone]: [f32; 3],
    ) -> Result<Answer, Refusal> {
        match self.state {
            // Planned on as soon as it is known where the stop has ended.
            State::Enabled | State::Moving | State::QuickStop => {}
            State::Ready | State::Enabling(_) => {
                return Err(Refusal::because(RefusalReason::NotEnabled));
            }
            _ => return Err(Refusal::because(RefusalReason::WrongState)),
        }
        let request = Request {
            sequence,
            target,
            speed,
            tool_speed,
            zone,
        };
        self.queue.push(request)?;
        Ok(Answer::WhenPlanned)
    }
}

/// The refusal of a payload that breaks a rule.
fn payload_refusal(error: ModelError) -> Refusal {
    let (reason, limit) = match error.rule {
        Rule::AtMost(limit) => (RefusalReason::PayloadTooHeavy, limit),
        _ if error.value.is_finite() => (RefusalReason::OutOfRange, 0.0),
        _ => return Refusal::because(RefusalReason::NotFinite),
    };
    Refusal::value(reason, error.value, limit)
}

fn pose(target: &[f32; 4]) -> Pose {
    let [x, y, z, yaw] = *target;
    Pose { x, y, z, yaw }
}
