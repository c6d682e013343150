//! What the boards with a Cortex-M4F have in common: a guard below the stack, and an end for whatever fails.
//!
//! The stack lies at the bottom of RAM and grows down. Below it the memory protection unit allows nothing: an overflow is
//! a fault before anything has been overwritten. Every fault ends here, and so do panics and resets asked for: torque off,
//! the reason kept where a reset leaves it alone, reset.
//!
//! A board provides the function `board_torque_off`, and a stack between the symbols `_stack_end` and `_stack_start`.

#![cfg_attr(target_os = "none", no_std)]

#[cfg(target_os = "none")]
mod fault;
#[cfg(target_os = "none")]
mod guard;

#[cfg(target_os = "none")]
pub use fault::{last_stop, restart};
#[cfg(target_os = "none")]
pub use guard::guard;
