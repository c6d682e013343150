//! The log: defmt over UART 1, which the emulator writes to a file, separate from the UART of the frames.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cortex_m::register::primask;
use defmt::{Encoder, Logger};

use super::uart::LOG;

/// Time of the controller, ms.
pub(crate) static NOW: AtomicU32 = AtomicU32::new(0);

defmt::timestamp!("{=u32:ms}", NOW.load(Ordering::Relaxed));

#[defmt::global_logger]
struct Log;

struct Shared(UnsafeCell<Encoder>);

// SAFETY: used between `acquire` and `release` only, when interrupts are off on a single core.
unsafe impl Sync for Shared {}

static ENCODER: Shared = Shared(UnsafeCell::new(Encoder::new()));

/// Whether to enable interrupts again after the message.
static RESUME: AtomicBool = AtomicBool::new(false);

/// # Safety
/// Only between `acquire` and `release`, like the logger's functions themselves.
unsafe fn encode(what: impl FnOnce(&mut Encoder)) {
    // SAFETY: nothing interrupts a message, and no message is written while another one is.
    what(unsafe { &mut *ENCODER.0.get() });
}

// SAFETY: `acquire` excludes every other writer of a message until `release`.
unsafe impl Logger for Log {
    fn acquire() {
        let resume = primask::read().is_active();
        cortex_m::interrupt::disable();
        RESUME.store(resume, Ordering::Relaxed);
        // SAFETY: just acquired.
        unsafe { encode(|encoder| encoder.start_frame(|bytes| LOG.send(bytes))) };
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: acquired, as the caller has promised. Interrupts are enabled only if they were before.
        unsafe {
            encode(|encoder| encoder.end_frame(|bytes| LOG.send(bytes)));
            if RESUME.load(Ordering::Relaxed) {
                cortex_m::interrupt::enable();
            }
        }
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: acquired, as the caller has promised.
        unsafe { encode(|encoder| encoder.write(bytes, |bytes| LOG.send(bytes))) };
    }
}
