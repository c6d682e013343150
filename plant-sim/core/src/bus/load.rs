//! Worst-case load of a set of periodic messages, computed in advance.

use protocol::frame::CanFrame;

use protocol::wire::{BitTiming, FrameBits};

/// Highest accepted worst-case load of a link profile, 0 to 1. Above it, low priorities wait for several periods
/// and no room is left to repeat a disturbed frame.
pub const MAX_LOAD: f64 = 0.8;

/// A periodic message.
#[derive(Clone, Copy, Debug)]
pub struct Traffic {
    /// Any frame of the message: only identifier width, kind and length matter.
    pub frame: CanFrame,
    /// Rate, Hz.
    pub rate: f64,
}

/// A link profile that overloads the bus.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "link profile loads the bus to {:.1} % in the worst case; at most {:.0} % is allowed",
    load * 100.0,
    MAX_LOAD * 100.0
)]
pub struct Overload {
    /// Worst-case load; above 1 the messages do not fit at all.
    pub load: f64,
}

/// Share of the bus that these messages take with worst-case stuffing, 0 to 1, including interframe space.
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

/// The worst-case load, if allowed.
///
/// # Errors
/// [`Overload`] if it is above [`MAX_LOAD`] or a rate is NaN.
pub fn admit(timing: &BitTiming, profile: &[Traffic]) -> Result<f64, Overload> {
    let load = worst_case_load(timing, profile);
    if load <= MAX_LOAD {
        Ok(load)
    } else {
        Err(Overload { load })
    }
}
