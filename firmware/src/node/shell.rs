//! What the shell around the node reports: its CAN controller, and its time.

use protocol::messages::{Cause, Fault};

use super::Node;
use crate::control::fault::OVERRUNS;

impl Node {
    /// For a shell to report that its CAN controller has gone bus-off (ISO 11898-1), each time; recovery from it is the shell's
    /// ([`Rejoin`](crate::cabinet::rejoin::Rejoin)).
    /// What was sent may not have arrived, and whatever keeps a controller off its bus is unlikely to be gone for good.
    // Out of line: rare.
    #[inline(never)]
    pub fn bus_off(&mut self) {
        self.controller.fail(Fault::because(Cause::BusOff));
    }

    /// For a shell to report a tick that ended after its deadline. Those of as many samples in a row as [`OVERRUNS`] stop the arm.
    // Out of line: rare.
    #[inline(never)]
    pub fn count_overrun(&mut self) {
        self.overruns = self.overruns.saturating_add(1);
        self.overruns_in_a_row = match self.samples.wrapping_sub(self.overrun) {
            0 if self.overruns_in_a_row > 0 => self.overruns_in_a_row,
            1 => self.overruns_in_a_row.saturating_add(1),
            _ => 1,
        };
        self.overrun = self.samples;
        if self.overruns_in_a_row >= OVERRUNS {
            let (value, limit) = (self.overruns_in_a_row, OVERRUNS);
            let fault = Fault::value(Cause::Overrun, f32::from(value), f32::from(limit));
            self.controller.fail(fault);
        }
    }

    /// For a shell to report the core cycles of a tick, if it can measure them; the maximum is kept.
    pub fn note_tick(&mut self, cycles: u32) {
        self.worst_tick = self.worst_tick.max(cycles);
    }

    /// Whether network management has requested a reset: the shell then has to start a new node. This one sends nothing
    /// more.
    pub fn reset_asked(&self) -> bool {
        self.reset_asked
    }
}
