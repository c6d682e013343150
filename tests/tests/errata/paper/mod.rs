//! The formulas of the paper exactly as printed, wrong or right, with their equation numbers.
//!
//! Paper: "In-Depth Analysis of Kinematic, Dynamic, and Control Aspects of a 4-Axis SCARA Robot Manipulator". Nothing
//! here may be corrected: without the defect in this module, the test that shows it is meaningless.

pub(crate) mod control;
pub(crate) mod kinematics;
pub(crate) mod lagrange;
pub(crate) mod newton_euler;
pub(crate) mod velocity;
