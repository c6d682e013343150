//! The safe state, by registers alone: drivers may depend on what has failed.

use core::panic::PanicInfo;

use cortex_m_rt::exception;
use embassy_stm32::pac;
use firmware::cabinet::pins::TORQUE_OFF;
use firmware::cabinet::reset::Stop;
use protocol::messages::ResetReason;

/// Switches torque off and lets the brake close; returns brake, torque and stack light, pins 0 to 3 of port C, as found
/// and as read back.
#[unsafe(no_mangle)]
fn board_torque_off() -> [u8; 2] {
    let read = || (pac::GPIOC.idr().read().0 & 0xF) as u8;
    let found = read();
    for pin in 0..4 {
        let high = TORQUE_OFF & 1 << pin != 0;
        pac::GPIOC.bsrr().write(|pins| {
            pins.set_bs(pin, high);
            pins.set_br(pin, !high);
        });
    }
    // A microsecond for the levels to settle.
    cortex_m::asm::delay(160);
    [found, read()]
}

/// The control code cannot panic; the drivers below it have checks at their start that can.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    cortex_m4::restart(ResetReason::Panic)
}

/// An unexpected interrupt.
#[exception]
unsafe fn DefaultHandler(_: i16) {
    cortex_m4::restart(ResetReason::HardFault)
}

/// How the board stopped before this start. Clears it, so that the next start has its own reason.
pub(crate) fn last_stop() -> Stop {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|csr| csr.set_rmvf(true));
    let kept = cortex_m4::last_stop();
    // The pin's flag is set with every other one: the chip pulls its own reset pin.
    let reason = if flags.iwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        // The reason of a software reset is in the record.
        if let Some(stop) = kept {
            return stop;
        }
        ResetReason::Software
    } else if flags.borrstf() {
        // Power-on and brown-out share one flag (RM0440, 7.4.28); the first is the usual case.
        ResetReason::PowerOn
    } else {
        ResetReason::Pin
    };
    Stop::without_fault(reason)
}
