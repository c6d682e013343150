//! Simulated robot cell: plant, drives, bit-timed CAN bus, operator and controller in lock-step.

#![forbid(unsafe_code)]
#![deny(clippy::disallowed_methods)]

mod allowed;
pub mod bus;
pub mod controller;
mod convert;
pub mod drives;
mod maths;
pub mod metrics;
pub mod model;
pub mod observer;
pub mod operator;
pub mod peer;
pub mod plant;
pub mod record;
pub mod rig;
pub mod run;
pub mod scenario;
pub mod selection;
pub mod setup;
pub mod summary;
mod text;
