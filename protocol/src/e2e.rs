//! End-to-end protection: a counter and a CRC inside the payload.
//!
//! The bus CRC guards the wire; this one guards everything between two applications: drivers, mailboxes, gateways,
//! memory. The CAN identifier goes into the CRC as data id without being sent again, so a frame that turns up on another
//! identifier is refused. The CRC comes last and big-endian: only there does the code word keep the polynomial's
//! guarantee that every burst up to the width of the CRC is found.
//!
//! Layout: payload, zero padding, counter, CRC. Input of the CRC: data id (big-endian), then the frame's bytes up to
//! the CRC.

use crc::{CRC_8_AUTOSAR, Crc};

static CRC_8: Crc<u8> = Crc::<u8>::new(&CRC_8_AUTOSAR);

/// Which counter and CRC a frame carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Profile {
    /// Classical frames: 4-bit counter in the low half of a byte, `CRC_8_AUTOSAR` (polynomial 2Fh; all errors of up to
    /// three bits found in up to 119 bits).
    Classical,
    /// FD frames: 8-bit counter, `CRC_16_IBM_3740` (polynomial 1021h; all errors of up to three bits found in up to
    /// 32 751 bits).
    Fd,
}

impl Profile {
    /// Bytes that counter and CRC take at the end of a frame.
    #[must_use]
    pub const fn overhead(self) -> usize {
        match self {
            Self::Classical => 2,
            Self::Fd => 3,
        }
    }

    /// Greatest counter value; the next is 0. One less than a power of two.
    #[must_use]
    pub const fn counter_max(self) -> u8 {
        match self {
            Self::Classical => 0x0F,
            Self::Fd => 0xFF,
        }
    }

    /// Writes the counter, reduced to its width, and the CRC over the last bytes of `frame`. A frame too short to hold
    /// them is left unchanged.
    pub fn protect(self, data_id: u16, counter: u8, frame: &mut [u8]) {
        let counter = counter & self.counter_max();
        match self {
            Self::Classical => {
                if let Some((covered, crc)) = frame.split_last_chunk_mut::<1>()
                    && let Some(last) = covered.last_mut()
                {
                    *last = counter;
                    *crc = [crc8(data_id, covered)];
                }
            }
            Self::Fd => {
                if let Some(end) = frame.last_chunk_mut::<3>() {
                    *end = [counter, 0, 0];
                    let crc = remainder(data_id, frame);
                    if let Some(place) = frame.last_chunk_mut::<2>() {
                        *place = crc.to_be_bytes();
                    }
                }
            }
        }
    }

    /// Splits a frame into payload (with its padding) and counter byte, or `None` if the CRC does not match
    /// frame and data id, or the frame is too short to hold it.
    #[must_use]
    pub fn check(self, data_id: u16, frame: &[u8]) -> Option<(&[u8], u8)> {
        match self {
            Self::Classical => {
                let (covered, &[crc]) = frame.split_last_chunk()?;
                let (&counter, payload) = covered.split_last()?;
                (crc == crc8(data_id, covered)).then_some((payload, counter))
            }
            Self::Fd => {
                let (payload, &[counter, _, _]) = frame.split_last_chunk()?;
                (remainder(data_id, frame) == 0).then_some((payload, counter))
            }
        }
    }
}

fn crc8(data_id: u16, bytes: &[u8]) -> u8 {
    let mut digest = CRC_8.digest();
    digest.update(&data_id.to_be_bytes());
    digest.update(bytes);
    digest.finalize()
}

/// Remainder of data id and frame divided by the generator of `CRC_16_IBM_3740`, P = x^16 + x^12 + x^5 + 1. It is the CRC of
/// a frame that ends with two zeros in place of it, and 0 for one that ends with its CRC.
///
/// Without a table, since it runs over every frame of every sample. Bit k of a number is the coefficient of x^k.
fn remainder(data_id: u16, frame: &[u8]) -> u16 {
    let (bytes, words) = frame.as_rchunks::<4>();
    // The CRC begins with all ones, which meet the two bytes of the data id.
    let mut start = u64::from(0xFFFF ^ data_id);
    for byte in bytes {
        start = start << 8 ^ u64::from(*byte);
    }
    let mut rest = ((start >> 32) as u32, start as u32);
    // In pairs, so that what is high need not change places with what is low.
    let (first, pairs) = words.as_rchunks::<2>();
    for word in first {
        rest = append(rest, *word);
    }
    for [first, second] in pairs {
        rest = append(append(rest, *first), *second);
    }
    let (high, low) = rest;
    (remainder_16(remainder_16(high) ^ low >> 16) ^ low) as u16
}

/// Remainder of `high`·x^64 + `low`·x^32 + `word` in 64 bits. P divides x^64 + x^48 + x^20 + 1 as well, as squaring is linear modulo 2.
const fn append((high, low): (u32, u32), word: [u8; 4]) -> (u32, u32) {
    // The half of `high` that x^48 leaves at x^64 goes the same way.
    let high = high ^ high >> 16;
    let word = u32::from_be_bytes(word);
    (low ^ high << 16 ^ high >> 12, word ^ high << 20 ^ high)
}

/// Remainder of `a`·x^16.
///
/// The quotient is the integral part of `a` / (1 + f) with f = x^-4 + x^-11 + x^-16. Modulo 2 that is `a` times
/// (1 + f)(1 + f^2)(1 + f^4), since f^8 = x^-32 + ... shifts out all 32 bits and squaring doubles each exponent. The
/// remainder is the part of the quotient times P below x^16, where `a`·x^16 is zero.
const fn remainder_16(a: u32) -> u32 {
    let q = a ^ a >> 4 ^ a >> 11 ^ a >> 16;
    let q = q ^ q >> 8 ^ q >> 22;
    let q = q ^ q >> 16;
    (q ^ q << 5 ^ q << 12) & 0xFFFF
}

/// Counts the frames that go out under one identifier.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sender(u8);

impl Sender {
    /// Counter of the next frame; [`Profile::protect`] reduces it to its width.
    #[must_use]
    pub const fn next(&mut self) -> u8 {
        let counter = self.0;
        self.0 = counter.wrapping_add(1);
        counter
    }
}

/// Place of a received frame in the sequence, by its counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// First frame since the start or a reset: nothing to compare with, so its age is unknown. It may be a replay; do
    /// not act on an edge it carries.
    Initial,
    /// The next one.
    Fresh,
    /// New, after this many lost frames.
    Lost(u8),
    /// The previous one again: drop it.
    Duplicate,
    /// Older than the newest by this many frames: late, reordered or replayed. Drop it.
    Stale(u8),
}

impl Verdict {
    /// Whether the frame is newer than all before.
    #[must_use]
    pub const fn is_new(self) -> bool {
        matches!(self, Self::Initial | Self::Fresh | Self::Lost(_))
    }
}

/// Judges the counters of one identifier.
///
/// Half of the counter's range counts as ahead, the other half as behind. A run of lost frames longer than half the
/// range therefore looks stale: by then the receiver's watchdog must have expired, and the caller [resets](Self::reset).
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Receiver {
    profile: Profile,
    newest: Option<u8>,
}

impl Receiver {
    /// Receiver that has seen nothing.
    #[must_use]
    pub const fn new(profile: Profile) -> Self {
        Self {
            profile,
            newest: None,
        }
    }

    /// Forgets the sequence, as when a watchdog has expired or the peer has restarted.
    pub const fn reset(&mut self) {
        self.newest = None;
    }

    /// Checks the counter of a frame whose CRC is right. Only a new frame advances the sequence.
    #[must_use]
    pub fn check(&mut self, counter: u8) -> Verdict {
        let max = self.profile.counter_max();
        let verdict = match self.newest {
            None => Verdict::Initial,
            Some(newest) => match counter.wrapping_sub(newest) & max {
                0 => Verdict::Duplicate,
                1 => Verdict::Fresh,
                ahead if ahead <= max / 2 => Verdict::Lost(ahead - 1),
                ahead => Verdict::Stale(max - ahead + 1),
            },
        };
        if verdict.is_new() {
            self.newest = Some(counter & max);
        }
        verdict
    }
}
