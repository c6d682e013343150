//! The controller with a meter at every phase border. Reading the timer costs a handful of instructions per phase,
//! which is why the image used for runs has no meter. On any other target than the board this is an empty program.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
#[path = "board/panic.rs"]
mod panic;

#[cfg(target_os = "none")]
mod metered {
    use channel::Measured;
    use cortex_m::peripheral::SYST;
    use firmware::control::phase::{Phase, Probe};

    use crate::board;

    pub(crate) struct Image;

    impl board::Image for Image {
        type Meter = Meter;
    }

    /// Timer ticks of each phase.
    pub struct Meter {
        measured: Measured,
        /// Timer value at the end of the last phase.
        last: u32,
    }

    impl Default for Meter {
        fn default() -> Self {
            Self {
                measured: Measured::default(),
                last: SYST::get_current(),
            }
        }
    }

    impl Probe for Meter {
        fn end(&mut self, phase: Phase) {
            let ticks = board::ticks_since(self.last);
            if let Some(place) = self.measured.phases.get_mut(phase as usize) {
                *place += ticks;
            }
            self.last = SYST::get_current();
        }
    }

    impl From<Meter> for Measured {
        fn from(meter: Meter) -> Self {
            meter.measured
        }
    }
}

#[cfg(target_os = "none")]
use metered::Image;

#[cfg(not(target_os = "none"))]
fn main() {}
