//! Bit rates of the bus, and how long frames take.

use core::fmt;

use super::bits::{FrameBits, INTERMISSION};
use crate::time::Duration;

/// Highest nominal bit rate, bit/s (ISO 11898-2).
const MAX_NOMINAL: u32 = 1_000_000;
/// Highest data bit rate, bit/s: that of the fastest transceivers (CAN FD SIC).
const MAX_DATA: u32 = 8_000_000;

/// Bit rates and nominal sample point, the same in every node.
///
/// The sample point of the data phase is left out: it moves the two instants of the rate switch by the same amount in
/// opposite directions (see [`FrameBits`]), and nothing observable happens between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    nominal: u32,
    data: u32,
    sample_point: u16,
}

/// Bit timing that no CAN controller has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimingError {
    /// Nominal bit rate, bit/s, out of range.
    Nominal(u32),
    /// Data bit rate, bit/s, out of range.
    Data {
        /// The rate requested.
        data: u32,
        /// Nominal bit rate.
        nominal: u32,
    },
    /// Sample point, per mille of the bit, outside the bit.
    SamplePoint(u16),
}

impl fmt::Display for TimingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nominal(rate) => write!(
                f,
                "nominal bit rate is {rate} bit/s; allowed: 1 to {MAX_NOMINAL}"
            ),
            Self::Data { data, nominal } => write!(
                f,
                "data bit rate is {data} bit/s; allowed: {nominal} (the nominal one) to {MAX_DATA}"
            ),
            Self::SamplePoint(point) => write!(
                f,
                "sample point is at {point} per mille of the bit; allowed: 1 to 999"
            ),
        }
    }
}

impl core::error::Error for TimingError {}

impl Default for BitTiming {
    /// 1 Mbit/s, data phase 5 Mbit/s, sample point at 80 %.
    fn default() -> Self {
        Self {
            nominal: 1_000_000,
            data: 5_000_000,
            sample_point: 800,
        }
    }
}

impl BitTiming {
    /// Bit timing of `nominal` and `data` bit/s, sampled at `sample_point` per mille of a nominal bit.
    ///
    /// # Errors
    /// Names the first value out of range and what is allowed.
    pub fn new(nominal: u32, data: u32, sample_point: u16) -> Result<Self, TimingError> {
        if !(1..=MAX_NOMINAL).contains(&nominal) {
            return Err(TimingError::Nominal(nominal));
        }
        if !(nominal..=MAX_DATA).contains(&data) {
            return Err(TimingError::Data { data, nominal });
        }
        if !(1..=999).contains(&sample_point) {
            return Err(TimingError::SamplePoint(sample_point));
        }
        Ok(Self {
            nominal,
            data,
            sample_point,
        })
    }

    /// Nominal bit rate, bit/s.
    #[must_use]
    pub const fn nominal(&self) -> u32 {
        self.nominal
    }

    /// Data bit rate, bit/s.
    #[must_use]
    pub const fn data(&self) -> u32 {
        self.data
    }

    /// Duration of these bits; each phase is rounded up to a whole ns.
    #[must_use]
    pub fn duration(&self, bits: FrameBits) -> Duration {
        time_of(u64::from(bits.nominal) * 1000, self.nominal)
            + time_of(u64::from(bits.data) * 1000, self.data)
    }

    /// Time from the instant a frame is valid for its receivers to the end of the intermission.
    ///
    /// Receivers accept a frame as valid at the sample point of the last but one bit of the end of frame: they ignore
    /// the value of the last one (ISO 11898-1, frame validation).
    #[must_use]
    pub fn after_valid(&self) -> Duration {
        let whole_bits = u64::from(INTERMISSION + 1);
        time_of(
            whole_bits * 1000 + 1000 - u64::from(self.sample_point),
            self.nominal,
        )
    }
}

/// Time of `thousandths` of a bit at `rate` bit/s, rounded up.
fn time_of(thousandths: u64, rate: u32) -> Duration {
    Duration::from_nanos((thousandths * 1_000_000).div_ceil(u64::from(rate)))
}
