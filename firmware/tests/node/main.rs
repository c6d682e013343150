//! The node on a bus of the test's own: what it answers, what it refuses, and what it ignores.

mod bench;
mod faults;
mod parameters;
mod reports;
mod requests;
mod stops;
mod switching;
