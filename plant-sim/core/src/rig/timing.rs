//! Times and loads of the bus that follow from the table of messages, before anything runs.

use protocol::schema::{MessageInfo, Rate};
use protocol::table;
use protocol::time::Duration;
use protocol::wire::{BitTiming, FrameBits};

use crate::bus::{Overload, Traffic};
use crate::controller::COMPUTE;

/// Time from a sample until its command acts: two frames and the computing time, on an
/// otherwise idle bus with about half of the possible stuff bits.
pub(crate) fn command_delay(timing: &BitTiming) -> Duration {
    let frame = |info: &MessageInfo| timing.duration(FrameBits::exact(&info.specimen()));
    frame(&table::FEEDBACK) + COMPUTE + frame(&table::COMMAND)
}

/// Longest time from a sample until its command is there, with one frame of another kind in the way and as many stuff bits as there
/// can be. Where samples are nearer to each other, a command may come after the next one.
#[must_use]
pub fn slowest_answer(timing: &BitTiming) -> Duration {
    let frame = |info: &MessageInfo| timing.duration(FrameBits::worst_case(&info.specimen()));
    // One that is under way when the sample is taken, whatever its priority.
    let others = table::TABLE
        .iter()
        .filter(|info| info.rate != Rate::EverySample);
    let in_the_way = others
        .map(|info| frame(info))
        .max()
        .unwrap_or(Duration::ZERO);
    in_the_way + frame(&table::FEEDBACK) + COMPUTE + frame(&table::COMMAND)
}

/// Worst-case load of the bus at a control rate.
///
/// # Errors
/// [`Overload`] if it is more than allowed.
pub fn admit(timing: &BitTiming, rate_hz: f64) -> Result<f64, Overload> {
    let traffic: Vec<Traffic> = table::TABLE
        .iter()
        .filter_map(|info| {
            let rate = match info.rate {
                Rate::EverySample => rate_hz,
                Rate::Hertz(hertz) => f64::from(hertz),
                Rate::Event => return None,
            };
            Some(Traffic {
                frame: info.specimen(),
                rate,
            })
        })
        .collect();
    crate::bus::admit(timing, &traffic)
}
