//! Simulated robot cell: plant, drives, bit-timed CAN bus, operator and controller in lock-step.
//!
//! Pure: no file, clock, thread, print or socket. A run is a function of its configuration, the same on every machine.
//!
//! # What lives here
//!
//! ```text
//! run, setup, summary    a run from configuration to verdict
//! scenario, selection    what is asked for: motions, law, mismatch
//! rig                    the time line from event to event
//! peer                   a node on it: controller (in process or elsewhere), and the two others of a cabinet, drives and
//!                        operator, which know messages and not the controller
//! world                  what peers share besides the bus: the robot, and what each lets the run know
//! observer, record       what a run shows, and its trace and truth as text
//! bus                    arbitration and exact frame times
//! plant, model           the robot in f64, by a derivation of its own, and its data
//! metrics                errors, settling, utilisation
//! ```
//!
//! The plant names neither the controller nor the bus.
//!
//! # The way of one Feedback frame
//!
//! At a sample [`rig`] lets the [`plant`] latch what its sensors see; [`drives`] encodes it and gives it to the [`bus`],
//! which says when the last bit has arrived. Then the rig delivers it, to observers as well, and the controller's answer,
//! a Command, travels back as late as computing time and arbitration make it. The drives apply it: the plant is integrated
//! up to that instant with the old torques and from there with the new ones. [`metrics`] judges the sample by the truth.

#![forbid(unsafe_code)]
#![deny(clippy::disallowed_methods, clippy::print_stdout, clippy::print_stderr)]

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
pub mod world;
