//! What every board needs around the node: pins, the sample clock, the way back onto the bus, the record of a stop that survives a reset, and the
//! log of changes.

#[cfg(feature = "defmt")]
pub mod journal;
pub mod pins;
pub mod rejoin;
pub mod reset;
pub mod sample_clock;
