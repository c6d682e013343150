//! Time in nanoseconds: instants, durations, and the sampling period.
//!
//! One resolution for controller, bus and plant; 64 bits of it last for centuries. Sums saturate.

use core::ops::{Add, AddAssign, Mul};

use serde::{Deserialize, Serialize};

/// A point in time, from an origin that everything on one time line shares.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instant(u64);

/// A length of time.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Duration(u64);

/// Time between two samples: a whole number of ns, up to 4 s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Period(u32);

impl Instant {
    /// Where the time line begins.
    pub const ORIGIN: Self = Self(0);
    /// Later than anything that happens.
    pub const MAX: Self = Self(u64::MAX);

    /// This many ns after the origin.
    #[must_use]
    pub const fn from_nanos(ns: u64) -> Self {
        Self(ns)
    }

    /// This many us after the origin.
    #[must_use]
    pub const fn from_micros(us: u64) -> Self {
        Self(us.saturating_mul(1_000))
    }

    /// Time since the origin, ns.
    #[must_use]
    pub const fn nanos(self) -> u64 {
        self.0
    }

    /// Time since the origin, whole us.
    #[must_use]
    pub const fn micros(self) -> u64 {
        self.0 / 1_000
    }

    /// Time since the origin, whole ms.
    #[must_use]
    pub const fn millis(self) -> u64 {
        self.0 / 1_000_000
    }

    /// Time since the origin, s.
    #[must_use]
    pub fn seconds(self) -> f64 {
        Duration(self.0).seconds()
    }

    /// Time since `earlier`; zero if that is later.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Duration {
        Duration(self.0.saturating_sub(earlier.0))
    }
}

impl Duration {
    /// No time at all.
    pub const ZERO: Self = Self(0);
    /// Longer than anything takes.
    pub const MAX: Self = Self(u64::MAX);

    /// This many ns.
    #[must_use]
    pub const fn from_nanos(ns: u64) -> Self {
        Self(ns)
    }

    /// This many us.
    #[must_use]
    pub const fn from_micros(us: u64) -> Self {
        Self(us.saturating_mul(1_000))
    }

    /// This many ms.
    #[must_use]
    pub const fn from_millis(ms: u64) -> Self {
        Self(ms.saturating_mul(1_000_000))
    }

    /// This many s.
    #[must_use]
    pub const fn from_secs(s: u64) -> Self {
        Self(s.saturating_mul(1_000_000_000))
    }

    /// This many s, truncated to whole ns; zero if negative or NaN.
    #[must_use]
    pub const fn from_seconds(s: f64) -> Self {
        // `as` saturates.
        Self((s * 1e9) as u64)
    }

    /// ns.
    #[must_use]
    pub const fn nanos(self) -> u64 {
        self.0
    }

    /// Whole us.
    #[must_use]
    pub const fn micros(self) -> u64 {
        self.0 / 1_000
    }

    /// s.
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// What is left after `other`; zero if that is longer.
    #[must_use]
    pub const fn saturating_sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Period {
    /// Period of `hz` samples per second, rounded to a whole ns.
    #[must_use]
    pub const fn of_rate(hz: f64) -> Self {
        // `as` saturates; positive, so the half rounds to the nearest.
        Self((1e9 / hz + 0.5) as u32)
    }

    /// As a length of time.
    #[must_use]
    pub const fn duration(self) -> Duration {
        Duration(self.0 as u64)
    }

    /// s, the `f32` nearest to it.
    #[must_use]
    pub fn seconds(self) -> f32 {
        // Dividend (below 2^24 ns; rounded above) and divisor are exact, so the quotient is rounded once.
        self.0 as f32 / 1e9
    }

    /// When sample `number` is taken, the first one being at the origin.
    #[must_use]
    pub const fn sample(self, number: u64) -> Instant {
        Instant(self.duration().0.saturating_mul(number))
    }
}

impl Add<Duration> for Instant {
    type Output = Self;

    fn add(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(duration.0))
    }
}

impl AddAssign<Duration> for Instant {
    fn add_assign(&mut self, duration: Duration) {
        *self = *self + duration;
    }
}

impl Add for Duration {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl AddAssign for Duration {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl core::iter::Sum for Duration {
    fn sum<I: Iterator<Item = Self>>(durations: I) -> Self {
        durations.fold(Self::ZERO, Add::add)
    }
}

impl Mul<u32> for Duration {
    type Output = Self;

    fn mul(self, times: u32) -> Self {
        Self(self.0.saturating_mul(times as u64))
    }
}

impl From<Duration> for core::time::Duration {
    fn from(duration: Duration) -> Self {
        Self::from_nanos(duration.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Periods by hand; 1/3000 s is 333 333.3 ns.
    #[test]
    fn a_period_is_rounded_to_whole_nanoseconds() {
        for (hz, ns, seconds) in [
            (100.0, 10_000_000, 0.01_f32),
            (1000.0, 1_000_000, 0.001),
            (2000.0, 500_000, 0.0005),
            (3000.0, 333_333, 333_333e-9),
            (7000.0, 142_857, 142_857e-9),
        ] {
            let period = Period::of_rate(hz);
            assert_eq!(period.duration().nanos(), ns);
            assert_eq!(period.seconds(), seconds);
        }
        assert_eq!(
            Period::of_rate(3000.0).sample(60),
            Instant::from_nanos(19_999_980)
        );
        assert_eq!(Period::of_rate(f64::NAN).duration(), Duration::ZERO);
    }

    #[test]
    fn units_are_told_apart() {
        let instant = Instant::from_nanos(3_004_005_006);
        assert_eq!(instant.nanos(), 3_004_005_006);
        assert_eq!((instant.micros(), instant.millis()), (3_004_005, 3_004));
        // The unit, the product and the number here are rounded, each by half of EPSILON at most.
        let near = |s: f64| (s - 3.004_005_006).abs() <= 1.5 * f64::EPSILON * s;
        assert!(near(instant.seconds()));
        let duration = Duration::from_nanos(3_004_005_006);
        assert_eq!(
            (duration.nanos(), duration.micros()),
            (3_004_005_006, 3_004_005)
        );
        assert!(near(duration.seconds()));
        assert_eq!(Duration::from_secs(3), Duration::from_millis(3_000));
        assert_eq!(Instant::from_micros(7), Instant::from_nanos(7_000));
    }

    #[test]
    fn sums_saturate_and_differences_are_not_negative() {
        let (early, late) = (Instant::from_micros(1), Instant::from_micros(3));
        assert_eq!(late.since(early), Duration::from_micros(2));
        assert_eq!(early.since(late), Duration::ZERO);
        assert_eq!(late + Duration::MAX, Instant::MAX);
        assert_eq!(Duration::from_millis(2) * 3, Duration::from_micros(6_000));
        assert_eq!(Duration::from_seconds(-1.0), Duration::ZERO);
        assert_eq!(Duration::from_seconds(0.25), Duration::from_millis(250));
        let parts = [1, 20, 300].map(Duration::from_micros);
        assert_eq!(parts.into_iter().sum::<Duration>().micros(), 321);
        let (mut then, mut long) = (late, Duration::from_micros(40));
        then += long;
        assert_eq!(then.micros(), 43);
        long += Duration::from_micros(2);
        assert_eq!(long.micros(), 42);
        long += Duration::MAX;
        assert_eq!(long, Duration::MAX);
        let std = core::time::Duration::from(Duration::from_nanos(7));
        assert_eq!(std.as_nanos(), 7);
    }
}
