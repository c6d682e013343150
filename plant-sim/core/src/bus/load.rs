//! Worst-case load of a set of periodic messages, known before the first frame is sent.

use protocol::frame::CanFrame;

use protocol::wire::{BitTiming, FrameBits};

/// Highest worst-case load of a link profile that is accepted, of 1. Above it, low priorities wait for several periods
/// and no room is left to repeat a disturbed frame.
pub const MAX_LOAD: f64 = 0.8;

/// A message that is sent again and again.
#[derive(Clone, Copy, Debug)]
pub struct Traffic {
    /// Any frame of the message: identifier width, kind and length count, the content does not.
    pub frame: CanFrame,
    /// How often, Hz.
    pub rate: f64,
}

/// A link profile that does not fit the bus.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "link profile loads the bus to {:.1} % in the worst case; at most {:.0} % is allowed",
    load * 100.0,
    MAX_LOAD * 100.0
)]
pub struct Overload {
    /// Worst-case load, of 1; above 1 the messages do not fit at all.
    pub load: f64,
}

/// Share of the bus these messages take with worst-case stuffing, of 1; interframe space included.
#[must_use]
pub fn worst_case_load(timing: &BitTiming, profile: &[Traffic]) -> f64 {
    profile
        .iter()
        .map(|traffic| {
            let bits = FrameBits::worst_case(&traffic.frame);
            timing.duration(bits).seconds() * traffic.rate
        })
        .sum()
}

/// The worst-case load, if a bus may carry it.
///
/// # Errors
/// [`Overload`] with the number above [`MAX_LOAD`], or when a rate is not a number.
pub fn admit(timing: &BitTiming, profile: &[Traffic]) -> Result<f64, Overload> {
    let load = worst_case_load(timing, profile);
    if load <= MAX_LOAD {
        Ok(load)
    } else {
        Err(Overload { load })
    }
}
