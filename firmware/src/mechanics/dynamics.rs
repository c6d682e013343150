//! Rigid-body dynamics, twice, and the drive train that turns joint efforts into motor torques.
//!
//! [`lagrange`] is the closed form that a control tick evaluates. [`newton_euler`] is the recursion over the links, ten
//! times the work and derived from nothing but Newton's and Euler's laws: each checks the other. Both cover links and
//! payload alone, `tau = M(q) qdd + C(q, qd) qd + g(q)`. [`drive`] adds the rotor inertia and friction of the motors:
//!
//! ```text
//! tau_joint = M qdd + C qd + g + A^T Jm A qdd + friction(qd)        tau_motor = A^-T tau_joint
//! ```

pub mod drive;
pub mod lagrange;
pub mod newton_euler;
