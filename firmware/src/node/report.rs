//! What the node sends besides the command and its answers to parameter requests.

use protocol::bus::Transmit;
use protocol::messages::{Heartbeat, Message, Node as Name, State};
use protocol::time::{Duration, Instant};

use super::Node;

/// Period of the state message.
const STATE_PERIOD: Duration = Duration::from_millis(20);
/// Period of the heartbeat.
const HEARTBEAT_PERIOD: Duration = Duration::from_millis(100);

impl Node {
    /// Sends what is due: a reply, an emergency, state and heartbeat.
    pub(super) fn report<B: Transmit>(&mut self, now: Instant, bus: &mut B) {
        // One per call: requests refused together are answered sample by sample.
        if let Some(reply) = self.controller.take_reply() {
            self.send(&Message::MotionReply(reply), bus);
        }
        // One that finds no room waits for it.
        if let Some(alarm) = *self.controller.alarm()
            && self.send(&Message::Emergency(Name::Controller, alarm), bus)
        {
            self.controller.take_alarm();
            // The state that follows at once names the axis.
            self.next_state = now;
        }
        if now >= self.next_state {
            self.next_state = now + STATE_PERIOD;
            let state = self.state();
            self.send(&Message::State(state), bus);
        }
        if now >= self.next_heartbeat {
            self.next_heartbeat = now + HEARTBEAT_PERIOD;
            let heartbeat = Heartbeat {
                state: self.controller.mode(),
                cause: self.controller.cause(),
                reset: self.reset,
            };
            self.send(&Message::Heartbeat(Name::Controller, heartbeat), bus);
        }
    }

    /// The report; takes the limits that have acted since the last one.
    fn state(&mut self) -> State {
        let limits = self.controller.take_limits();
        let controller = &self.controller;
        let fault = controller.fault();
        let selection = controller.selection();
        State {
            mode: controller.mode(),
            cause: fault.cause,
            limits,
            queue: controller.queued(),
            completed: controller.completed(),
            overruns: self.overruns,
            rejected: self.received.dropped(),
            worst_tick: self.worst_tick,
            law: selection.law,
            compensation: selection.compensation,
            tracking_error: (*controller.following_error()).into(),
            fault_axis: fault.axis,
            fault_value: fault.value,
            fault_limit: fault.limit,
            pace: (controller.pace() * 100.0 + 0.5) as u8,
            operation: controller.operation(),
            burden: (controller.burden() * 100.0) as i16,
        }
    }
}
