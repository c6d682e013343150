//! The arm: its data, kinematics and dynamics.
//!
//! [`arm`] holds geometry, inertia, limits and drives; [`kinematics`] and [`jacobian`] give position and
//! velocity of the tool; [`dynamics`] the efforts of a motion, and [`body`] the same for one payload. Everything is a
//! pure function in `f32`, built on the elementary functions of [`math`], which give the same bits on every machine.
//! Depends on nothing else in this crate.

pub mod arm;
pub mod body;
pub mod dynamics;
pub mod jacobian;
pub mod kinematics;
pub mod math;
pub mod velocity;
