//! The arm: its data, where it is, how fast, and what moving it takes.
//!
//! [`arm`] holds geometry, inertia, limits and drives; [`kinematics`] and [`jacobian`] say where the tool is and how fast;
//! [`dynamics`] what efforts a motion takes, and [`body`] does so for one payload. Everything is a pure function in `f32`,
//! on the elementary functions of [`math`], which give the same bits on every machine. Leans on nothing else in this crate.

pub mod arm;
pub mod body;
pub mod dynamics;
pub mod jacobian;
pub mod kinematics;
pub mod math;
pub mod velocity;
