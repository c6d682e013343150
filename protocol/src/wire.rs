//! A frame as bits on the wire: their number and duration.

mod bits;
mod timing;

pub use bits::{FrameBits, INTERMISSION, arbitration_field};
pub use timing::{BitTiming, TimingError};
