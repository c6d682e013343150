//! Proof at every link that no panic is reachable.

use core::panic::PanicInfo;

/// Calls a function that does not exist: an image with a panic left after optimisation does not link.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached() -> !;
    }
    // SAFETY: it is never called: an image that calls it does not link.
    unsafe { a_panic_can_be_reached() }
}
