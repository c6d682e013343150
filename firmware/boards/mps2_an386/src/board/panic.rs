//! Proof, at every link, that no panic can be reached.

use core::panic::PanicInfo;

/// Calls a function that exists nowhere: an image in which a panic is left after optimisation does not link.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached() -> !;
    }
    // SAFETY: it is never called; the linker sees to it.
    unsafe { a_panic_can_be_reached() }
}
