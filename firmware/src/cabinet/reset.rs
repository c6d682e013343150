//! Record that a failing controller leaves for its restart.

use core::sync::atomic::{AtomicU32, Ordering};

use protocol::messages::ResetReason;

/// How a controller ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Reason of the next start.
    pub reason: ResetReason,
    /// Outputs as found, and as read back after switching torque off, in the bits of
    /// [`TORQUE_OFF`](crate::cabinet::pins::TORQUE_OFF).
    pub pins: [u8; 2],
    /// Address of the failing instruction; 0 if there was none or it is unknown.
    pub at: u32,
    /// Fault status of the core (CFSR of Armv7-M); 0 without a fault.
    pub status: u32,
}

impl Stop {
    /// Nothing failed.
    #[must_use]
    pub const fn without_fault(reason: ResetReason) -> Self {
        Self {
            reason,
            pins: [0; 2],
            at: 0,
            status: 0,
        }
    }
}

/// Seed of the check word, so that memory filled with one value does not pass as a record.
const SEED: u32 = 0x5CA7_A571;

/// A [`Stop`] in memory that a reset preserves. After power-on it may hold anything, and a reset may interrupt writing:
/// an incomplete record counts as none.
#[derive(Debug)]
pub struct Record([AtomicU32; 4]);

impl Record {
    /// A record of these words: reason and pins, address, status, check word.
    #[must_use]
    pub const fn from_words([cause, at, status, check]: [u32; 4]) -> Self {
        Self([
            AtomicU32::new(cause),
            AtomicU32::new(at),
            AtomicU32::new(status),
            AtomicU32::new(check),
        ])
    }

    /// Keeps `stop` across the next reset.
    pub fn keep(&self, stop: &Stop) {
        let [found, left] = stop.pins;
        let cause = u32::from_le_bytes([stop.reason.code(), found, left, 0]);
        let words = [
            cause,
            stop.at,
            stop.status,
            check(cause, stop.at, stop.status),
        ];
        for (place, word) in self.0.iter().zip(words) {
            place.store(word, Ordering::Relaxed);
        }
    }

    /// Takes the kept record, once: the next reset will have its own reason.
    pub fn take(&self) -> Option<Stop> {
        let [cause, at, status, word] =
            self.0.each_ref().map(|place| place.load(Ordering::Relaxed));
        let [.., last] = &self.0;
        last.store(!word, Ordering::Relaxed);
        let [reason, found, left, 0] = cause.to_le_bytes() else {
            return None;
        };
        let reason = ResetReason::try_from(reason).ok()?;
        (word == check(cause, at, status)).then_some(Stop {
            reason,
            pins: [found, left],
            at,
            status,
        })
    }
}

/// Check word: any change of one word changes it, since every step is a bijection.
const fn check(cause: u32, at: u32, status: u32) -> u32 {
    const ODD: u32 = 0x9E37_79B1;
    let mixed = (SEED ^ cause).wrapping_mul(ODD).rotate_left(13);
    let mixed = (mixed ^ at).wrapping_mul(ODD).rotate_left(13);
    (mixed ^ status).wrapping_mul(ODD).rotate_left(13)
}
