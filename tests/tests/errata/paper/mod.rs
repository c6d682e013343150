//! The formulas of the paper exactly as they stand in print, wrong or right, with their equation numbers.
//!
//! Paper: "In-Depth Analysis of Kinematic, Dynamic, and Control Aspects of a 4-Axis SCARA Robot Manipulator". Nothing here may be
//! repaired: a defect that disappears from this module takes the meaning out of the test that shows it.

pub(crate) mod control;
pub(crate) mod kinematics;
pub(crate) mod lagrange;
pub(crate) mod newton_euler;
pub(crate) mod velocity;
