//! Common to the boards with a Cortex-M4F: a stack guard, fault handlers that stop safely, copies of memory.
//!
//! The stack is at the bottom of RAM and grows down. Below it the memory protection unit denies all access: an overflow
//! faults before anything is overwritten. Every fault ends here, as do panics and requested resets: torque off, the
//! reason kept in memory that survives the reset, reset.
//!
//! A board provides the function `board_torque_off`, and a stack between the symbols `_stack_end` and `_stack_start`.

#![cfg_attr(target_os = "none", no_std)]

#[cfg(target_os = "none")]
mod fault;
#[cfg(target_os = "none")]
mod guard;
#[cfg(target_os = "none")]
mod memory;

#[cfg(target_os = "none")]
pub use fault::{last_stop, restart};
#[cfg(target_os = "none")]
pub use guard::guard;
