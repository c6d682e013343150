//! Campaigns: many short runs with a fault each, and a judge who holds every one to what [`expect`] and [`bounds`] promise.
//!
//! ```text
//! case      situations x faults x windows, and each case of them
//! expect    by when a fault has to be detected, and which ones a sound system survives (what each may be told as in causes; what is
//!           promised of an arm with and without torque, and what one fault hides of another, in due)
//! bounds    how far, fast and deep the arm may go, from the robot's own limits
//! spells    the faults of a case, each with its time
//! judge     the observer who compares a run with both (what the drives obey in newest, the operator's last
//!           request in request, the way to standstill in course, of the lift in lift)
//! verdict   what a case is held to, and what became of it
//! trial     one case: the run, what follows it, and the verdict
//! prelude   what many cases have in common: the run up to their first fault
//! tally     worst cases by fault and situation, and the bound of the miss rate
//! ```
//!
//! The judge knows the robot's truth and what is on the bus. It does not read the controller's table of faults: `expect` is
//! written by hand from the documents, so that an error in one of them shows.

pub mod bounds;
pub mod case;
mod causes;
mod course;
mod due;
pub mod expect;
pub mod judge;
mod lift;
mod newest;
pub mod prelude;
mod reports;
mod request;
pub mod spells;
pub mod tally;
pub mod trial;
pub mod verdict;
