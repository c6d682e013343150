//! What an operator may ask for in which state.

use nalgebra::Vector4;
use protocol::messages::{Cause, Mode, MotionRequest, Refusal, RefusalReason};

use super::{Controller, Shutdown};
use crate::control::laws::{Gains, Memory};
use crate::control::mode::{self, Event};
use crate::mechanics::arm::Payload;
use crate::mechanics::body::Body;
use crate::mechanics::kinematics::Pose;
use crate::trajectory::request::{Request, Target};

/// When a request is answered.
pub(super) enum Answer {
    Now,
    WhenPlanned,
}

impl Controller {
    pub(super) fn judge(
        &mut self,
        sequence: u8,
        request: &MotionRequest,
    ) -> Result<Answer, Refusal> {
        let idle = matches!(self.mode, Mode::Ready | Mode::PreOperational)
            || (self.mode == Mode::Enabled && self.queue.is_empty());
        let answer = match request {
            MotionRequest::Enable => return self.operate(Event::Enable),
            MotionRequest::Disable if !self.queue.is_empty() => {
                return Err(Refusal::because(RefusalReason::Moving));
            }
            MotionRequest::Disable => return self.operate(Event::Disable),
            MotionRequest::FaultReset => {
                if self.shutdown != Shutdown::Off {
                    return Err(Refusal::because(RefusalReason::Moving));
                }
                return self.operate(Event::Reset);
            }
            MotionRequest::Stop => {
                self.withdraw();
                if self.mode == Mode::Enabled {
                    // Planned, not begun: there is nothing to brake.
                    self.queue.clear(&self.reference.q);
                }
                self.event(Event::Stop, Cause::None);
                Answer::Now
            }
            MotionRequest::MoveJoint { target, speed } => {
                self.enqueue(sequence, Target::Joints(Vector4::from(*target)), *speed)?
            }
            MotionRequest::MoveLine { target, speed } => {
                self.enqueue(sequence, Target::Line(pose(target)), *speed)?
            }
            MotionRequest::Jump {
                target,
                top,
                clearance,
                speed,
            } => {
                let target = Target::Jump {
                    pose: pose(target),
                    top: *top,
                    clearance: *clearance,
                };
                self.enqueue(sequence, target, *speed)?
            }
            _ if !idle => return Err(Refusal::because(RefusalReason::Moving)),
            MotionRequest::SetPayload { mass, com, inertia } => {
                let limit = self.config.arm.payload_max;
                if *mass > limit {
                    return Err(Refusal::value(RefusalReason::PayloadTooHeavy, *mass, limit));
                }
                self.config.payload = Payload {
                    mass: *mass,
                    com: (*com).into(),
                    inertia: (*inertia).into(),
                };
                self.body = Body::new(&self.config.arm, &self.config.payload);
                self.memory = Memory::new();
                Answer::Now
            }
            MotionRequest::SelectLaw { law, compensation } => {
                self.config.selection.law = *law;
                self.config.selection.compensation = *compensation;
                self.memory = Memory::new();
                Answer::Now
            }
            MotionRequest::SetGains {
                bandwidth,
                damping,
                observer,
            } => {
                let gains = Gains {
                    bandwidth: *bandwidth,
                    damping: *damping,
                    observer: *observer,
                };
                gains.check(self.config.period)?;
                self.config.selection.gains = gains;
                self.memory = Memory::new();
                Answer::Now
            }
        };
        Ok(answer)
    }

    fn operate(&mut self, event: Event) -> Result<Answer, Refusal> {
        if mode::transition(self.mode, event).is_none() {
            return Err(Refusal::because(RefusalReason::WrongState));
        }
        self.event(event, Cause::None);
        Ok(Answer::Now)
    }

    fn enqueue(&mut self, sequence: u8, target: Target, speed: f32) -> Result<Answer, Refusal> {
        match self.mode {
            Mode::Enabled | Mode::Moving => {}
            Mode::Ready | Mode::Enabling => {
                return Err(Refusal::because(RefusalReason::NotEnabled));
            }
            _ => return Err(Refusal::because(RefusalReason::WrongState)),
        }
        let request = Request {
            sequence,
            target,
            speed,
        };
        self.queue.push(request)?;
        Ok(Answer::WhenPlanned)
    }
}

fn pose(target: &[f32; 4]) -> Pose {
    let [x, y, z, yaw] = *target;
    Pose { x, y, z, yaw }
}
