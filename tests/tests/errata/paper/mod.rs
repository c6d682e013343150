//! The formulas of the paper exactly as they stand in print, wrong or right, with their equation numbers.
//!
//! Paper: "In-Depth Analysis of Kinematic, Dynamic, and Control Aspects of a 4-Axis SCARA Robot Manipulator". Nothing here may be
//! repaired: a defect that disappears from this module takes the meaning out of the test that shows it.

pub mod control;
pub mod kinematics;
pub mod lagrange;
pub mod newton_euler;
pub mod velocity;
