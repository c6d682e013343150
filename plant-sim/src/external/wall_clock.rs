//! Real-time pace: samples at absolute deadlines of the machine's clock.

use std::cell::{Ref, RefCell};
use std::io;
use std::rc::Rc;
use std::time::Duration;

use link::realtime::{monotonic, sleep_until};
use protocol::time::{self, Instant, Period};
use sim::observer::Pace;

use super::timing::Timing;

/// Time between the end of the preparations and the first sample.
const RUN_UP: Duration = Duration::from_millis(5);

/// The pace of a real-time run, shared with the controller's end, which has until the next sample for its answer.
#[derive(Clone)]
pub struct WallClock(Rc<RefCell<Samples>>);

struct Samples {
    period: Duration,
    /// Time of sample 0 on the machine's clock.
    origin: Option<Duration>,
    /// Number of the present sample.
    number: u32,
    timing: Timing,
}

impl WallClock {
    /// A clock before the first sample.
    pub fn new(period: Period) -> Self {
        let period = period.duration().into();
        Self(Rc::new(RefCell::new(Samples {
            period,
            origin: None,
            number: 0,
            timing: Timing::new(period),
        })))
    }

    /// Measurements so far.
    pub fn timing(&self) -> Ref<'_, Timing> {
        Ref::map(self.0.borrow(), |samples| &samples.timing)
    }

    /// Number of the present sample.
    pub fn sample(&self) -> u32 {
        self.0.borrow().number
    }

    /// When the next sample is due.
    pub fn deadline(&self) -> Duration {
        let samples = self.0.borrow();
        samples.origin.unwrap_or_default() + samples.period * (samples.number + 1)
    }

    /// The command of the current sample arrived this long after its feedback; returns how long that is in the time of the run, of which no
    /// sample lasts longer than a period: after a longer pause of this process time slips.
    pub fn answered(&self, latency: Duration) -> time::Duration {
        let mut samples = self.0.borrow_mut();
        samples.timing.answered(latency);
        time::Duration::from_nanos(latency.min(samples.period).as_nanos() as u64)
    }

    /// The command of the current sample had not arrived when the next was due.
    pub fn missed(&self) {
        self.0.borrow_mut().timing.missed();
    }
}

impl Pace for WallClock {
    fn sample(&mut self, _: Instant) -> io::Result<()> {
        let mut samples = self.0.borrow_mut();
        let origin = match samples.origin {
            Some(origin) => {
                samples.number += 1;
                origin
            }
            None => *samples.origin.insert(monotonic() + RUN_UP),
        };
        let deadline = origin + samples.period * samples.number;
        sleep_until(deadline);
        let now = monotonic();
        samples.timing.woke(deadline, now);
        if now >= deadline + samples.period {
            // Missed samples are not made up for in a burst: time slips instead, which leaves the controller its time.
            samples.origin = Some(now.saturating_sub(samples.period * samples.number));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Else a process that was stopped while it waited for a command would hear nothing of the controller for as long again.
    #[test]
    fn an_answer_takes_no_longer_than_a_sample_however_long_this_process_has_stood() {
        let clock = WallClock::new(Period::of_rate(100.0));
        let answered = [3, 10, 1138].map(|ms| clock.answered(Duration::from_millis(ms)));
        assert_eq!(answered, [3, 10, 10].map(time::Duration::from_millis));
    }
}
