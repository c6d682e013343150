//! What is on the wire between the drive cabinet's controller, its drives and the operator, and nothing else.
//!
//! A frame comes from a [`Bus`](bus::Bus) that never blocks, and goes back to one.

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing
    )
)]

pub mod bus;
pub mod codes;
pub mod frame;
pub mod messages;
