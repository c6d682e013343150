//! The safe state, by registers alone: whatever has failed may be what a driver needs.

use core::panic::PanicInfo;

use cortex_m_rt::exception;
use embassy_stm32::pac;
use firmware::cabinet::pins::TORQUE_OFF;
use firmware::cabinet::reset::Stop;
use protocol::messages::ResetReason;

/// Takes torque away and lets the brake close; returns brake, torque and the stack light, on pins 0 to 3 of port C, as
/// found and as read back.
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
    // A microsecond until the levels are there.
    cortex_m::asm::delay(160);
    [found, read()]
}

/// The control code has no panic; the drivers below it check themselves when they start.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    cortex_m4::restart(ResetReason::Panic)
}

/// An interrupt that nobody asked for.
#[exception]
unsafe fn DefaultHandler(_: i16) {
    cortex_m4::restart(ResetReason::HardFault)
}

/// How the board has been stopped before this start. Forgets it, so that the next start tells its own reason.
pub(crate) fn last_stop() -> Stop {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|csr| csr.set_rmvf(true));
    let kept = cortex_m4::last_stop();
    // The pin's flag comes with every other: the chip pulls its own reset pin.
    let reason = if flags.iwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        // Why software has asked is in the record.
        if let Some(stop) = kept {
            return stop;
        }
        ResetReason::Software
    } else if flags.borrstf() {
        // One flag for a supply switched on and one that has sagged (RM0440, 7.4.28); the first is daily life.
        ResetReason::PowerOn
    } else {
        ResetReason::Pin
    };
    Stop::without_fault(reason)
}
