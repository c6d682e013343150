//! What the operator sends besides what its program says: signs of life, of itself and of the hand on the button.

use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, Heartbeat, Message, Mode, Motion, MotionRequest, Node, ResetReason,
};
use protocol::time::{Duration, Instant};

use super::Operator;
use crate::peer::Outbox;

/// Time between two holds: of three, two may be lost.
const HOLD_PERIOD: Duration = Duration::from_millis(50);

/// The button that keeps moves going in manual operation.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Button {
    pressed: bool,
    /// Time of the next hold.
    next: Instant,
}

impl Button {
    /// Presses it, or lets go of it.
    pub(super) fn press(&mut self, pressed: bool) {
        self.pressed = pressed;
    }

    fn is_due(&mut self, now: Instant) -> bool {
        let due = self.pressed && now >= self.next;
        if due {
            self.next = now + HOLD_PERIOD;
        }
        due
    }
}

impl Operator {
    /// What every poll begins with.
    pub(super) fn tick(&mut self, now: Instant, out: &mut Outbox) {
        self.next = now + self.period.duration();
        let heartbeat = Heartbeat {
            state: Mode::Ready,
            cause: Cause::None,
            reset: ResetReason::PowerOn,
        };
        let encoder = &mut self.encoder;
        self.heart
            .beat(now, (Node::Operator, heartbeat), encoder, out);
        if self.button.is_due(now) {
            out.extend(self.hold().map(|frame| (now, frame)));
        }
    }

    /// A hold. Nobody waits for its answer: its number is none of those that somebody waits for.
    pub(super) fn hold(&mut self) -> Option<CanFrame> {
        self.number(self.sequence.wrapping_add(128), MotionRequest::Hold)
    }

    /// A request whose answer the program does not wait for.
    pub(super) fn send(&mut self, request: MotionRequest) -> Option<CanFrame> {
        if let MotionRequest::SetOverride { pace } = request {
            self.pace = pace;
            self.least_pace = self.least_pace.min(pace);
            self.held = false;
        }
        self.sequence = self.sequence.wrapping_add(1);
        self.number(self.sequence, request)
    }

    fn number(&mut self, sequence: u8, request: MotionRequest) -> Option<CanFrame> {
        let message = Message::Motion(Motion { sequence, request });
        self.encoder.encode(&message).ok()
    }
}
