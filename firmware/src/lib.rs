//! Controller of a SCARA drive cabinet, in fixed memory and in `f32`.
//!
//! The crate is the control code alone: no clock, no heap, no operating system, no bus driver. The same
//! code runs on a host against a simulated robot and on a Cortex-M4F.
//!
//! # Contents
//!
//! Five modules; each depends only on those below it.
//!
//! ```text
//! cabinet      what every board needs around the node: pins, reset record, log, sample clock
//! node         the controller on the bus: frames in, frames out
//! control      one sample: readings, monitor, state, reference, law, limits
//! trajectory   from a request to a reference for every sample
//! mechanics    the arm: kinematics, dynamics, drives
//! ```
//!
//! # The path of one Feedback frame
//!
//! A board or the simulator calls [`Node::poll`](node::Node::poll) when a frame has arrived. The node decodes and
//! checks it, counts it if it is refused, and turns a fresh Feedback into [`Readings`](control::readings::Readings).
//! One call of [`Controller::step`](control::controller::Controller::step) follows:
//!
//! ```text
//! counts -> joints      mechanics::dynamics::drive
//! monitor, state        control::monitor, control::states: may the arm move, must it stop
//! reference             trajectory::queue: where the arm should be now, and when the command will act
//! law                   control::laws: kinematics and dynamics at the measured position, joint efforts
//! observer              control::laws::observer: what the model does not explain
//! limits                control::limits: cut to what the motors can give
//! ```
//!
//! The motor torques leave as a Command at once. The rest of the call goes to a report or to one bounded step of
//! planning; [`phase`](control::phase) lets a board measure every part.
//!
//! # Conventions
//!
//! * SI units throughout: m, rad, kg, s, N, N m. *Effort* is at a joint, *torque* is a motor's.
//! * Joint vectors are `[theta1, theta2, d3, theta4]`: shoulder, elbow, lift, wrist. The third effort is a force,
//!   positive down like the lift itself.
//! * Frames follow the standard (distal) Denavit-Hartenberg table of the arm. Frame 0 has z up; frame 4, the tool flange,
//!   has z down. Yaw is `theta1 + theta2 - theta4`.
//! * Equation numbers in the comments are those of "In-Depth Analysis of Kinematic, Dynamic, and Control Aspects of a
//!   4-Axis SCARA Robot Manipulator", the paper this controller implements; errors of the paper are noted where they
//!   are corrected.

#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::disallowed_methods)]

pub mod cabinet;
pub mod control;
pub mod mechanics;
pub mod node;
pub mod trajectory;
