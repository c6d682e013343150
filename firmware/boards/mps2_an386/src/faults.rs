//! The controller with faults that the host can plant: proof that each of them ends with torque off and its reason
//! reported. On any other target than the board this is an empty program.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
mod planted {
    use core::hint::black_box;
    use core::panic::PanicInfo;

    use channel::Fault;
    use cortex_m::asm;
    use cortex_m::peripheral::SCB;
    use cortex_m_rt::exception;
    use protocol::messages::ResetReason;

    use crate::board::{self, End};

    pub(crate) struct Image;

    impl board::Image for Image {
        type Meter = ();

        /// Causes the fault that the host requests.
        fn plant(fault: Fault) -> Result<(), End> {
            defmt::warn!("planted: {=str}", fault.name());
            match fault {
                Fault::HardFault => asm::udf(),
                #[expect(clippy::panic, reason = "this is the planted one")]
                Fault::Panic => panic!("planted"),
                Fault::StackOverflow => {
                    overflow(0);
                }
                Fault::OverflowInInterrupt => {
                    SCB::set_pendsv();
                    asm::isb();
                }
            }
            // Reaching this line means the fault did not trap.
            Err(End)
        }
    }

    #[exception]
    fn PendSV() {
        overflow(0);
    }

    /// Calls itself without end. Each call has work left after the next one, so that the compiler cannot turn it into a
    /// loop.
    #[inline(never)]
    #[expect(unconditional_recursion)]
    fn overflow(depth: u32) -> u32 {
        let words = black_box([depth; 16]);
        overflow(depth.wrapping_add(1)) ^ black_box(words)[0]
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        cortex_m4::restart(ResetReason::Panic)
    }
}

#[cfg(target_os = "none")]
use planted::Image;

#[cfg(not(target_os = "none"))]
fn main() {}
