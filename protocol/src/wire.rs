//! A frame as bits on the wire: how many there are, and how long they take.

mod bits;
mod timing;

pub use bits::{FrameBits, INTERMISSION, arbitration_field};
pub use timing::{BitTiming, TimingError};
