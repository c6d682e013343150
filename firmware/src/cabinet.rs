//! What every board needs around the node, and no board should write again: pins, the clock of samples, the record of a stop
//! that survives a reset, and the log of changes.

#[cfg(feature = "defmt")]
pub mod journal;
pub mod pins;
pub mod reset;
pub mod sample_clock;
