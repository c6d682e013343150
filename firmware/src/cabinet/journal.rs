//! Log of a controller: why it was started, and every change of its mode. The same on every board.

use protocol::messages::Mode;

use crate::cabinet::reset::Stop;
use crate::control::controller::Controller;

/// The log of one controller.
#[derive(Debug)]
pub struct Journal {
    mode: Mode,
}

impl Journal {
    /// Begins the log of a controller that was started after this stop.
    pub fn begin(last: &Stop) -> Self {
        defmt::info!("started: {}", last.reason);
        if last.status != 0 {
            let [found, left] = last.pins;
            defmt::warn!(
                "fault at {=u32:#010x}, status {=u32:#010x}, pins {=u8:04b}, then {=u8:04b}",
                last.at,
                last.status,
                found,
                left
            );
        }
        Self { mode: Mode::Boot }
    }

    /// Notes a change of mode, and its cause.
    pub fn note(&mut self, controller: &Controller) {
        if controller.mode() != self.mode {
            self.mode = controller.mode();
            defmt::info!("{} ({})", self.mode, controller.cause());
        }
    }
}
