//! When a CAN controller that has gone bus-off is told to take part again.
//!
//! A disturbance is mostly over in milliseconds, and a node that gives up is lost to the cabinet: the first attempts follow at once. What
//! takes a node off its bus again and again is near by, such as its own transceiver, and every return costs the others 32 destroyed
//! frames: further attempts are rare, but never the last (as in AUTOSAR's CAN state manager).

use protocol::time::{Duration, Instant};

/// Attempts in a row that follow at once.
pub const AT_ONCE: u8 = 3;
/// Time before each further one, in which the rest of the bus works: at most 1 % of it goes to this node's attempts.
pub const PAUSE: Duration = Duration::from_millis(250);
/// Time without a bus-off after which the next one is the first again.
pub const CALM: Duration = Duration::from_secs(1);

/// Attempts of a CAN controller to take part in its bus again.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rejoin {
    /// Number in a row, saturating, and the time of the last.
    attempts: u8,
    last: Instant,
}

impl Rejoin {
    /// How long to wait after a bus-off at `now` before the CAN controller is told to recover. That then takes 128 times 11 recessive
    /// bits (ISO 11898-1).
    pub fn after_bus_off(&mut self, now: Instant) -> Duration {
        if now.since(self.last) >= CALM {
            self.attempts = 0;
        }
        self.last = now;
        self.attempts = self.attempts.saturating_add(1);
        if self.attempts > AT_ONCE {
            PAUSE
        } else {
            Duration::ZERO
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waits after bus-offs at these times, ms.
    fn waits<const N: usize>(times: [u64; N]) -> [u64; N] {
        let mut rejoin = Rejoin::default();
        times.map(|ms| {
            let now = Instant::ORIGIN + Duration::from_millis(ms);
            rejoin.after_bus_off(now).nanos() / 1_000_000
        })
    }

    #[test]
    fn three_attempts_follow_at_once_and_the_others_after_a_quarter_of_a_second() {
        assert_eq!(waits([0, 3, 6, 9, 262, 515]), [0, 0, 0, 250, 250, 250]);
        let mut rejoin = Rejoin::default();
        let wait = (0..1000).map(|_| rejoin.after_bus_off(Instant::ORIGIN));
        assert_eq!(wait.filter(|wait| *wait == Duration::ZERO).count(), 3);
    }

    #[test]
    fn after_a_second_of_calm_they_begin_anew() {
        assert_eq!(
            waits([5, 8, 11, 14, 1013, 2013, 2016, 2019, 2022]),
            [0, 0, 0, 250, 250, 0, 0, 0, 250]
        );
    }
}
