//! What the other nodes of the bus do wrong: bad frames, silence, and the place of this one.

use protocol::codec::{self, DecodeError};
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Fault, Message};
use protocol::table;
use protocol::time::{Duration, Instant};

use super::Node;

impl Node {
    pub(super) fn reject(&mut self, error: DecodeError, frame: &CanFrame) {
        self.received.refuse(&error);
        if table::FEEDBACK.identifies(frame) {
            self.suspect(match error {
                DecodeError::Value(_) | DecodeError::Malformed | DecodeError::NotCanonical => {
                    Cause::BadValue
                }
                _ => Cause::Corrupted,
            });
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

    /// Counts bad feedback frames; several in a row stop the arm.
    pub(super) fn suspect(&mut self, cause: Cause) {
        self.bad_feedback = self.bad_feedback.saturating_add(1);
        if u32::from(self.bad_feedback) >= self.controller.setup().bad_frames {
            let frames = f32::from(self.bad_feedback);
            self.bad_feedback = 0;
            self.controller.fail(Fault::value(cause, frames, 0.0));
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
            self.controller
                .fail(Fault::value(Cause::PeerSilent, age_ms, timeout * 1e3));
            self.newest = None;
            self.feedback.reset();
            self.drives_parameter.reset();
            self.same_schema = false;
        }
    }
}
