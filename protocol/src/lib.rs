//! The wire protocol between the drive cabinet's controller, its drives and the operator.
//!
//! # Contents
//!
//! ```text
//! codec ----> table ----> hash          one table describes every message; codec, hash and DBC derive from it
//!   |           |
//!   v           v
//! messages    schema, signals           the same messages as Rust types, and as offsets, ranges and units
//!   |
//!   v
//! codes                                 enumerations on the wire
//!
//! e2e, counters                         place of a frame in its sequence; counts of refused frames, by cause
//! frame, bus                            a CAN frame, and a controller that sends and receives without blocking
//! wire, slcan                           bits and times of a frame; frames as lines of text
//! ```
//!
//! # The path of one Feedback frame
//!
//! The drives call [`codec::encode`]: fields of [`Feedback`](messages::Feedback) to bytes, followed by counter and CRC.
//! The receiver takes the [`CanFrame`](frame::CanFrame) from its [`Bus`](bus::Bus) and calls [`codec::decode`], which
//! finds the message in the [`table`] and checks length, CRC, canonical form and ranges, in this order; then
//! [`Receiver`](e2e::Receiver) judges the counter. Only frames that pass both are used; the rest are
//! counted in [`Counters`](counters::Counters) by cause and change nothing.
//!
//! Nothing here allocates, panics, reads a clock or knows a robot.

#![no_std]
#![forbid(unsafe_code)]

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
