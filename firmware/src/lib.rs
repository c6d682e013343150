//! Controller of a SCARA drive cabinet, in fixed memory and in `f32`.
//!
//! The crate is the control code and nothing around it: no clock, no heap, no operating system, no bus driver. The same
//! code runs on a host against a simulated robot and on a Cortex-M4F.
//!
//! # Conventions
//!
//! * SI units throughout: m, rad, kg, s, N, N m.
//! * Joint vectors are `[theta1, theta2, d3, theta4]`: shoulder, elbow, lift, wrist. The third effort is a force,
//!   positive down like the lift itself.
//! * Frames follow the standard (distal) Denavit-Hartenberg table of the arm. Frame 0 has z up; frame 4, the tool flange,
//!   has z down. Yaw is `theta1 + theta2 - theta4`.
//! * Equation numbers in the comments are those of "In-Depth Analysis of Kinematic, Dynamic, and Control Aspects of a
//!   4-Axis SCARA Robot Manipulator", the paper this controller implements; what is wrong in print is said where it is put
//!   right.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::disallowed_methods)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing
    )
)]

pub mod cabinet;
pub mod control;
pub mod mechanics;
pub mod node;
pub mod trajectory;
