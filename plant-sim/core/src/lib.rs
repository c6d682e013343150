//! Simulated robot cell: plant, drives, bit-timed CAN bus, operator and controller in lock-step.
//!
//! Pure: no file, clock, thread, print or socket. A run is a function of its configuration, the same on every machine.
//!
//! # Contents
//!
//! ```text
//! run, setup, summary    a run from configuration to verdict
//! scenario, selection    what to run: motions, law, mismatch
//! live                   a run that goes on after its scenario, as a person asks
//! rig                    the time line from event to event
//! peer                   a node on it: controller (in process or elsewhere), drives and operator; the latter two
//!                        know the controller by its messages alone
//! world                  what peers share besides the bus: the robot, and what each reports to the run
//! observer, record       observers of a run, and its trace and truth as text
//! curves                 what a page draws of a run, in bounded memory
//! bus                    arbitration and exact frame times
//! plant, model           the robot in f64, derived independently, and its data
//! metrics                errors, settling, utilisation
//! requirements           what is required of a run, judged with its margin
//! clock                  what can be wrong with the clock of the drives
//! rehearsal              a scenario as the controller plans it, without a robot
//! faults, campaign       what breaks in a run; many runs with faults, judged
//! ```
//!
//! The plant names neither the controller nor the bus.
//!
//! # The path of one Feedback frame
//!
//! At a sample [`rig`] calls the [`drives`], which latch the sensors of the [`plant`] and encode them for the [`bus`];
//! it determines when the last bit has arrived. Then the rig delivers the frame to the peers and observers, and the
//! controller's answer, a Command, travels back, delayed by computing time and arbitration. The drives apply it: the
//! plant is integrated up to that instant with the old torques and from there with the new ones. [`metrics`] evaluates
//! the true state of the sample.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "an index or an expectation names an invariant of this crate; one that breaks is its own fault"
)]
#![forbid(unsafe_code)]
#![deny(clippy::disallowed_methods, clippy::print_stdout, clippy::print_stderr)]

mod allowed;
pub mod bus;
pub mod campaign;
pub mod clock;
pub mod controller;
mod convert;
pub mod curves;
pub mod drives;
pub mod faults;
mod heart;
pub mod live;
mod maths;
pub mod metrics;
pub mod model;
pub mod observer;
pub mod operator;
pub mod peer;
pub mod plant;
pub mod record;
mod refusal;
pub mod rehearsal;
pub mod requirements;
pub mod rig;
pub mod run;
pub mod scenario;
pub mod selection;
pub mod setup;
pub mod summary;
pub mod text;
pub mod world;
