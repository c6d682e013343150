//! The robot that is not there: rigid-body plant, drives, bit-timed CAN bus, traces, and the rig that joins them with the controller.

#![forbid(unsafe_code)]

pub mod bus;
mod convert;
pub mod dbc;
pub mod drives;
pub mod endpoint;
pub mod eval;
pub mod external;
pub mod faults;
pub mod metrics;
pub mod model;
pub mod monitor;
pub mod operator;
pub mod plant;
pub mod qemu;
pub mod rig;
pub mod run;
pub mod scenario;
pub mod selection;
pub mod trace;
