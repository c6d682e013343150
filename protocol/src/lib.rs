//! What is on the wire between the drive cabinet's controller, its drives and the operator, and nothing else.
//!
//! A frame comes from a [`Bus`](bus::Bus) that never blocks; the [`codec`] makes a message of it or says what is wrong
//! with it; a [`Receiver`](e2e::Receiver) judges its place in the sequence. The way back is [`codec::encode`]. What
//! identifiers and bytes mean stands in one [`table`].

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
pub mod codec;
pub mod codes;
pub mod counters;
pub mod e2e;
pub mod frame;
pub mod hash;
pub mod messages;
mod packed;
pub mod parameters;
pub mod schema;
mod signals;
pub mod slcan;
pub mod table;
pub mod time;
pub mod wire;
