//! The safe state, by registers alone: whatever has failed may be what a driver needs.

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;
use protocol::messages::ResetReason;

/// Brake and torque of the cabinet, on port C.
const BRAKE: usize = 0;
const TORQUE: usize = 1;

/// Takes torque away and lets the brake close.
pub fn torque_off() {
    pac::GPIOC.bsrr().write(|pins| {
        pins.set_br(BRAKE, true);
        pins.set_br(TORQUE, true);
    });
}

/// Interrupts off, torque off, until the watchdog resets the board. Nothing is logged: the logger may be what has failed.
fn stop() -> ! {
    cortex_m::interrupt::disable();
    loop {
        torque_off();
    }
}

/// The control code has no panic; the drivers below it check themselves when they start.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    stop()
}

/// A fault of the core.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    stop()
}

/// An interrupt that nobody asked for.
#[exception]
unsafe fn DefaultHandler(_: i16) {
    stop()
}

/// Why the board has started. Forgets it, so that the next start tells its own reason.
pub fn reset_reason() -> ResetReason {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|csr| csr.set_rmvf(true));
    // The pin's flag comes with every other: the chip pulls its own reset pin.
    if flags.iwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        ResetReason::Software
    } else if flags.borrstf() {
        // One flag for a supply switched on and one that has sagged (RM0440, 7.4.28); the first is daily life.
        ResetReason::PowerOn
    } else {
        ResetReason::Pin
    }
}
