//! Measurements of a real-time loop: lateness of samples, response time of the controller, late commands.

use std::fmt::Write as _;
use std::time::Duration;

use firmware::control::fault::MAX_GAP_MS;
use firmware::node::PEER_TIMEOUT;

use sim::drives::hold_samples;

/// Width of a class of the histogram, ns.
const CLASS_NS: u64 = 1_000;
/// Number of classes, up to 50 ms; the last holds everything above, where only the greatest value matters.
const CLASSES: usize = 50_000;

/// Times in classes of 1 us: bounded memory for a run of any length.
#[derive(Clone, Debug)]
pub struct Distribution {
    classes: Vec<u64>,
    count: u64,
    max: Duration,
}

impl Default for Distribution {
    fn default() -> Self {
        Self {
            classes: vec![0; CLASSES],
            count: 0,
            max: Duration::ZERO,
        }
    }
}

impl Distribution {
    /// Adds a time.
    pub fn add(&mut self, time: Duration) {
        let class = (time.as_nanos() as u64 / CLASS_NS) as usize;
        self.classes[class.min(CLASSES - 1)] += 1;
        self.count += 1;
        self.max = self.max.max(time);
    }

    /// Number of times.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Greatest time.
    pub fn max(&self) -> Duration {
        self.max
    }

    /// Time that this share of all (0 to 1) does not exceed, to the upper end of its class and never above the
    /// greatest; 0 when nothing was measured.
    pub fn quantile(&self, share: f64) -> Duration {
        let rank = (share * self.count as f64).ceil().max(1.0) as u64;
        let mut seen = 0;
        for (class, &count) in self.classes.iter().enumerate().take(CLASSES - 1) {
            seen += count;
            if seen >= rank {
                return Duration::from_nanos((class as u64 + 1) * CLASS_NS).min(self.max);
            }
        }
        self.max
    }

    /// Occupied classes: lower end and number.
    pub fn classes(&self) -> impl Iterator<Item = (Duration, u64)> {
        self.classes
            .iter()
            .enumerate()
            .filter(|(_, count)| **count > 0)
            .map(|(class, &count)| (Duration::from_nanos(class as u64 * CLASS_NS), count))
    }
}

/// Timing of one run.
#[derive(Clone, Debug)]
pub struct Timing {
    period: Duration,
    last: Option<Duration>,
    /// Sample taken after its deadline, by this much.
    pub lateness: Distribution,
    /// Difference of the time between two samples from the period.
    pub jitter: Distribution,
    /// Feedback out to command in.
    pub latency: Distribution,
    /// Sample due to command in, of each sample: the age of a measurement when its command begins to act, since drives apply
    /// a command when it arrives. A sample without a command counts with the time that passed without one.
    pub age: Distribution,
    /// By how much the present sample was late.
    late: Duration,
    /// Samples in a row without a command.
    unanswered: u32,
    /// Longest time between two samples.
    gap: Duration,
    missed: u64,
    overruns: u64,
}

impl Timing {
    /// Empty statistics for samples every `period`.
    pub fn new(period: Duration) -> Self {
        Self {
            period,
            last: None,
            lateness: Distribution::default(),
            jitter: Distribution::default(),
            latency: Distribution::default(),
            age: Distribution::default(),
            late: Duration::ZERO,
            unanswered: 0,
            gap: Duration::ZERO,
            missed: 0,
            overruns: 0,
        }
    }

    /// A sample was due at `deadline` and taken at `now`.
    pub fn woke(&mut self, deadline: Duration, now: Duration) {
        let late = now.saturating_sub(deadline);
        self.late = late;
        self.lateness.add(late);
        if late >= self.period {
            self.overruns += 1;
        }
        if let Some(last) = self.last.replace(now) {
            let gap = now.saturating_sub(last);
            self.gap = self.gap.max(gap);
            self.jitter.add(gap.abs_diff(self.period));
        }
    }

    /// The command of a sample arrived this long after its feedback.
    pub fn answered(&mut self, latency: Duration) {
        self.latency.add(latency);
        self.age.add(self.late + latency);
        self.unanswered = 0;
    }

    /// The command of a sample had not arrived when the next was due.
    pub fn missed(&mut self) {
        self.missed += 1;
        self.unanswered += 1;
        self.age
            .add(self.late.max(self.period) + self.period * (self.unanswered - 1));
    }

    /// Samples taken.
    pub fn samples(&self) -> u64 {
        self.lateness.count()
    }

    /// Samples whose command had not arrived when the next was due.
    pub fn missed_commands(&self) -> u64 {
        self.missed
    }

    /// Samples taken a whole period late or more.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Nominal period.
    pub fn period(&self) -> Duration {
        self.period
    }

    /// Watchdogs of the loop and their limits.
    pub fn limits(&self) -> [(&'static str, Duration); 4] {
        let held = hold_samples(self.period.as_secs_f32());
        [
            ("command before the next sample", self.period),
            ("drives hold the last torque", self.period * held),
            (
                "controller bridges missing samples",
                Duration::from_millis(u64::from(MAX_GAP_MS)),
            ),
            ("controller finds drives silent", PEER_TIMEOUT.into()),
        ]
    }

    /// Percentiles, and the measurement beside each watchdog limit.
    pub fn report(&self) -> String {
        let mut text = String::new();
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        let _ = writeln!(
            text,
            "timing of {} samples of {:.0} us          50 %       99 %     99.9 %        max  us",
            self.samples(),
            us(self.period)
        );
        for (name, times) in [
            ("sample after its deadline", &self.lateness),
            ("period minus its nominal value", &self.jitter),
            ("feedback to command", &self.latency),
            ("sample due to command, age at use", &self.age),
        ] {
            if times.count() == 0 {
                continue;
            }
            let [half, most, nearly] = [0.5, 0.99, 0.999].map(|share| us(times.quantile(share)));
            let _ = writeln!(
                text,
                "  {name:<33}{half:10.0} {most:10.0} {nearly:10.0} {:10.0}",
                us(times.max())
            );
        }
        // A controller in this process answers at once.
        if self.age.count() == 0 {
            let _ = writeln!(text, "  overruns {}", self.overruns);
            return text;
        }
        let _ = writeln!(
            text,
            "  late commands {}, overruns {}",
            self.missed, self.overruns
        );
        let _ = writeln!(
            text,
            "watchdogs                             limit   measured     margin  us"
        );
        let (worst, gap) = (self.age.max(), self.gap);
        for ((name, limit), measured) in self.limits().into_iter().zip([worst, worst, gap, gap]) {
            let (limit, measured) = (us(limit), us(measured));
            let _ = writeln!(
                text,
                "  {name:<34} {limit:8.0} {measured:10.0} {:10.0}{}",
                limit - measured,
                if measured >= limit { "  exceeded" } else { "" }
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: Duration = Duration::from_micros(1);

    #[test]
    fn quantiles_are_those_of_the_sorted_times_to_a_class() {
        let mut times = Distribution::default();
        assert_eq!(times.quantile(0.5), Duration::ZERO);
        // 1 to 1000 us, and one far outside the classes.
        for k in (1..=1000).rev() {
            times.add(US * k);
        }
        times.add(Duration::from_secs(1));
        for (share, rank) in [(0.5, 501), (0.99, 991), (0.999, 1000)] {
            // Nearest rank, up to the upper end of a class of 1 us.
            let found = times.quantile(share);
            assert!(
                found >= US * rank && found <= US * (rank + 1),
                "{share}: {found:?}"
            );
        }
        assert_eq!(times.quantile(1.0), Duration::from_secs(1));
        assert_eq!(times.classes().map(|(_, count)| count).sum::<u64>(), 1001);
    }

    #[test]
    fn late_samples_missing_commands_and_jitter_are_counted() {
        let mut timing = Timing::new(US * 1000);
        // On time, 300 us late, on time again, 2500 us late.
        for (sample, late) in [(0, 0), (1, 300), (2, 0), (3, 2500)] {
            timing.woke(US * 1000 * sample, US * (1000 * sample + late));
        }
        timing.answered(US * 200);
        timing.missed();
        assert_eq!((timing.samples(), timing.overruns()), (4, 1));
        assert_eq!(timing.missed_commands(), 1);
        assert_eq!(timing.lateness.max(), US * 2500);
        assert_eq!(timing.jitter.max(), US * 2500);
        let report = timing.report();
        assert!(report.contains("late commands 1, overruns 1"), "{report}");
        // The last sample was 2500 us late and has its answer 200 us after that; then one has none within its 1000 us.
        assert_eq!(timing.age.max(), US * 2700);
        assert!(report.contains("-1700  exceeded"), "{report}");
    }

    #[test]
    fn what_was_late_in_one_sample_is_not_added_to_what_was_late_in_another() {
        let mut timing = Timing::new(US * 1000);
        // 600 us late and answered within 100 us; on time and answered after 700 us: 700 us either way.
        timing.woke(US * 1000, US * 1600);
        timing.answered(US * 100);
        timing.woke(US * 2000, US * 2000);
        timing.answered(US * 700);
        assert_eq!(timing.age.max(), US * 700);
        // The samples were 400 us apart, so nothing was ever silent for longer than that.
        let report = timing.report();
        assert!(!report.contains("exceeded"), "{report}");
        assert!(report.contains("late commands 0"), "{report}");
    }

    #[test]
    fn a_controller_that_is_silent_for_many_samples_is_as_old_as_all_of_them() {
        let mut timing = Timing::new(US * 1000);
        for sample in 0..4 {
            timing.woke(US * 1000 * sample, US * 1000 * sample);
            timing.missed();
        }
        assert_eq!(timing.age.max(), US * 4000);
    }
}
