//! What the other nodes of the bus do wrong: bad frames, silence, and the place of this one.

use protocol::codec::{self, DecodeError};
use protocol::e2e::{Profile, Receiver};
use protocol::frame::CanFrame;
use protocol::messages::{Cause, DriveStatus, Fault, Message, Node as Name};
use protocol::parameters::{DriveParameter, Store as _};
use protocol::table;
use protocol::time::{Duration, Instant};

use super::Node;
use crate::control::fault::{FLOOD, FLOOD_RATE};

/// The heartbeat of another node. As CiA 301 has it, it is watched from the first one on that was heard.
#[derive(Clone, Debug)]
pub(super) struct Pulse {
    receiver: Receiver,
    /// Number of the newest sample at the newest heartbeat.
    last: u32,
    is_watched: bool,
}

impl Pulse {
    /// Nothing has been heard.
    pub(super) fn new() -> Self {
        Self {
            receiver: Receiver::new(Profile::Classical),
            last: 0,
            is_watched: false,
        }
    }

    fn forget(&mut self) {
        self.receiver.reset();
        self.is_watched = false;
    }
}

impl Node {
    /// A heartbeat of another node.
    // Out of line: rare.
    #[inline(never)]
    pub(super) fn hear(&mut self, name: Name, counter: u8) {
        let newest = self.newest.map(|(sample, _)| sample);
        let pulse = match name {
            Name::Drives => &mut self.drives,
            Name::Operator => &mut self.operator,
            Name::Controller => return,
        };
        let verdict = pulse.receiver.check(counter);
        if let Some(newest) = newest
            && verdict.is_new()
        {
            (pulse.last, pulse.is_watched) = (newest, true);
        }
        self.accept(verdict);
    }

    /// Whether the others have given a sign of life, at a sample of this number. Counted in samples, so that the same frames lead
    /// to the same torques whenever they arrive; feedback that stays out is [another matter](Self::guard).
    pub(super) fn listen(&mut self, sample: u32) {
        for (pulse, cause) in [
            (&mut self.drives, Cause::PeerSilent),
            (&mut self.operator, Cause::OperatorSilent),
        ] {
            if !pulse.is_watched {
                continue;
            }
            let age = sample.wrapping_sub(pulse.last) as f32 * self.controller.period();
            let timeout = self.controller.setup().heartbeat_timeout;
            if age > timeout {
                pulse.forget();
                if self.controller.state().is_powered() {
                    let fault = Fault::value(cause, age * 1e3, timeout * 1e3);
                    self.controller.fail(fault);
                }
            }
        }
    }

    pub(super) fn reject(&mut self, error: &DecodeError, frame: &CanFrame) {
        self.received.refuse(error);
        self.strangers = self.strangers.saturating_add(1);
        if table::FEEDBACK.identifies(frame) {
            let cause = match error {
                DecodeError::Value(_) | DecodeError::Malformed | DecodeError::NotCanonical => {
                    Cause::BadValue
                }
                _ => Cause::Corrupted,
            };
            self.suspect(cause, None);
        }
    }

    /// Somebody else sends what only this node sends, and no node receives its own frames: the drives and the operator may
    /// believe either.
    // Out of line: rare.
    #[inline(never)]
    pub(super) fn meet(&mut self, message: &Message) {
        let id = f32::from(codec::info_of(message).id);
        self.controller
            .fail(Fault::value(Cause::DuplicateNode, id, 0.0));
    }

    /// Whether the drives speak the same protocol and are where they have to be for an arm that is ready; or their brake has had its time and is
    /// open, and the arm gets ready to tell it, whoever has greeted.
    // Out of line: only before the arm is ready.
    #[inline(never)]
    pub(super) fn may_be_ready(&self, status: DriveStatus) -> bool {
        if status.contains(DriveStatus::BRAKE_RELEASED) {
            self.controller.is_unheld()
        } else {
            self.same_schema == Some(true) && status.contains(DriveStatus::ENCODER_VALID)
        }
    }

    /// Whether drives that should have torque have none, as when they have started anew.
    pub(super) fn has_let_go(&self, status: DriveStatus) -> bool {
        self.controller.expects_torque() && !status.contains(DriveStatus::TORQUE_ON)
    }

    /// Counts bad feedback frames; several in a row stop the arm. The fault has their number, or what the drives say.
    pub(super) fn suspect(&mut self, cause: Cause, status: Option<DriveStatus>) {
        self.bad_feedback = self.bad_feedback.saturating_add(1);
        if u32::from(self.bad_feedback) >= self.controller.setup().bad_frames {
            let value = status.map_or(self.bad_feedback, DriveStatus::bits);
            self.bad_feedback = 0;
            let value = f32::from(value);
            self.controller.fail(Fault::value(cause, value, 0.0));
        }
    }

    /// The drives have had a late command: they alone know how old its sample is by their clock, whichever of both frames was held up.
    // Out of line: rare.
    #[inline(never)]
    pub(super) fn come_late(&mut self) {
        self.late = self.late.saturating_add(1);
        if u32::from(self.late) >= self.controller.setup().bad_frames {
            let late = f32::from(core::mem::take(&mut self.late));
            self.controller.fail(Fault::value(Cause::Late, late, 0.0));
        }
    }

    /// Judges frames that have come in place of a feedback, which is now there, `steps` samples after the last one. By themselves they change
    /// nothing. Feedback that had waited for their end comes first, and what has followed from them later.
    // Out of line: rare.
    #[inline(never)]
    pub(super) fn feel_flood(&mut self, steps: u32, status: DriveStatus) {
        if self.strangers >= FLOOD {
            // Feedbacks of the samples for which drives hold a command, and of those until they have let go, may have waited for its end.
            let held = DriveParameter::HoldSamples.initial(self.controller.period());
            (self.flood, self.flood_fades) = (self.strangers, held as u8 + 3);
        }
        if steps > 1 || self.has_let_go(status) {
            self.blame_flood(steps as f32 * self.controller.period());
        }
        self.flood_fades = self.flood_fades.saturating_sub(1);
        if self.flood_fades == 0 {
            self.flood = 0;
        }
    }

    /// Puts it down to a flood if the bus was full of such frames for `time`, s.
    fn blame_flood(&mut self, time: f32) {
        let limit = time * FLOOD_RATE;
        let limit = f32::from(FLOOD).max(limit);
        let frames = f32::from(self.strangers.max(self.flood));
        if frames >= limit {
            self.controller
                .fail(Fault::value(Cause::Babbling, frames, limit));
        }
    }

    /// Checks the age of the feedback.
    pub(super) fn guard(&mut self, now: Instant) {
        let Some((_, arrived)) = self.newest else {
            return;
        };
        let age = now.since(arrived);
        let timeout = self.controller.setup().feedback_timeout;
        if age > Duration::from_micros(u64::from((timeout * 1e6) as u32)) {
            let age_ms = age.nanos() as f32 * 1e-6;
            // First what is to blame. Without feedback there is no stop, so the silence follows in any case.
            self.blame_flood(age.nanos() as f32 * 1e-9);
            self.controller
                .fail(Fault::value(Cause::PeerSilent, age_ms, timeout * 1e3));
            self.newest = None;
            self.feedback.reset();
            self.drives.forget();
            self.operator.forget();
            self.drives_parameter.reset();
            self.same_schema = None;
        }
    }
}
