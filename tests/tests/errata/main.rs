//! The errata of "In-Depth Analysis of Kinematic, Dynamic, and Control Aspects of a 4-Axis SCARA Robot Manipulator",
//! one test each: the printed formula is wrong by a stated amount, the controller's is right within a derived bound.
//!
//! `docs/errata.md` has the table of them. `cargo test -p tests --test errata -- --nocapture --test-threads=1` prints
//! the numbers in it. An oracle is never the controller and never the paper: the tables of Pinocchio, a derivative of
//! positions, a conservation law, or linear algebra.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod arm;
mod dynamic_control;
mod energy;
mod jacobian;
mod kinematic_control;
mod kinematics;
mod lagrange;
mod laws;
mod newton_euler;
mod ode;
mod paper;
mod product;
mod structure;
mod velocity;
