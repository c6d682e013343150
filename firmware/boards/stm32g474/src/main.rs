//! The controller on an STM32G474, as on the Nucleo-G474RE.
//!
//! Only registers, clock and pins are here: the control code is the library's, byte for byte. On any other target than
//! the board this is an empty program.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;

#[cfg(not(target_os = "none"))]
fn main() {}
