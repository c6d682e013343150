//! The robot that is not there: rigid-body plant, drives, bit-timed CAN bus, traces.

#![forbid(unsafe_code)]

pub mod bus;
pub mod model;
pub mod plant;
pub mod trace;
