//! The controller on the emulated Cortex-M4F, in lock-step with the host.
//!
//! Only registers and the channel are here: the control code is the library's, byte for byte. On any other target than
//! the board this is an empty program.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
#[path = "board/panic.rs"]
mod panic;

/// The plain controller.
#[cfg(target_os = "none")]
struct Image;

#[cfg(target_os = "none")]
impl board::Image for Image {
    type Meter = ();
}

#[cfg(not(target_os = "none"))]
fn main() {}
