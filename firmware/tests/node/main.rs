//! The node on a simulated bus: what it answers, refuses and ignores.

mod bench;
mod faults;
mod parameters;
mod reports;
mod requests;
mod stops;
mod switching;
