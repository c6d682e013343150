//! What the controller decides in one sample: its state, the motion it follows, the law that follows it, and what it trips on.
//!
//! [`controller`] joins the parts; each of the others is pure: [`mode`] the states, [`laws`] the control laws, [`limits`] what
//! a motor can give, [`monitor`] what counts as a fault. [`phase`] is the probe that measures what each part costs. Leans on
//! [`mechanics`](crate::mechanics) and [`trajectory`](crate::trajectory).

pub mod controller;
pub mod laws;
pub mod limits;
pub mod mode;
pub mod monitor;
pub mod phase;
pub(crate) mod self_test;
