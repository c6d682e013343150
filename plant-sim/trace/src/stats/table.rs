//! Statistics as text.

use std::fmt;

use super::{BusStatistics, IdStatistics, Statistics};

/// A step of time worth mentioning, s.
const STEP_S: f64 = 1.0;
/// Signs of the longest bar of a histogram.
const BAR: u64 = 40;

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} frames in {:.6} s; load for {} Mbit/s, data {} Mbit/s",
            self.frames,
            self.span_s,
            f64::from(self.bitrate) / 1e6,
            f64::from(self.data_bitrate) / 1e6,
        )?;
        if self.backwards > 0 {
            writeln!(
                f,
                "{} records are earlier than the one before, by up to {:.6} s; time counts on from there",
                self.backwards, self.largest_step_back_s
            )?;
        }
        if self.skipped_steps > 0 {
            writeln!(
                f,
                "{} gaps, {:.6} s in total, are left out, the largest {:.6} s",
                self.skipped_steps, self.skipped_s, self.largest_step_s
            )?;
        } else if self.largest_step_s > STEP_S {
            writeln!(
                f,
                "the largest step between two records is {:.6} s; --skip-gaps leaves such steps out",
                self.largest_step_s
            )?;
        }
        self.interfaces.iter().try_for_each(|bus| bus.fmt(f))
    }
}

impl fmt::Display for BusStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n{}: {} frames; bus load {:.1} % mean, {:.1} % in the busiest 100 ms",
            self.interface,
            self.frames,
            self.load * 100.0,
            self.peak_load * 100.0
        )?;
        if self.load.max(self.peak_load) > 1.0 {
            writeln!(
                f,
                "no bus carries more than 100 %: --bitrate is not its rate, or times and frames of this trace are not those of one bus"
            )?;
        }
        if self.error_frames > 0 {
            let classes: Vec<String> = self
                .errors
                .iter()
                .map(|(class, count)| format!("{count} {class}"))
                .collect();
            writeln!(
                f,
                "{} error frames: {}",
                self.error_frames,
                classes.join(", ")
            )?;
        }
        if self.ids.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "{:>8} {:<26} {:>9} {:>9} {:>10} {:>10} {:>10} {:>9} {:>21} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>6}",
            "id",
            "message",
            "frames",
            "rate/Hz",
            "min/ms",
            "mean/ms",
            "max/ms",
            "jitter/ms",
            "90 % of periods/ms",
            "gaps",
            "lost",
            "twice",
            "stale",
            "CRC",
            "refused",
            "load/%"
        )?;
        self.ids.iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

impl fmt::Display for IdStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:>8} {:<26} {:>9} {:>9.2} ",
            self.id, self.name, self.frames, self.rate_hz
        )?;
        match &self.period {
            Some(period) => {
                let [low, high] = period.range_90_ms;
                write!(
                    f,
                    "{:>10.3} {:>10.3} {:>10.3} {:>9.3} {:>21}",
                    period.min_ms,
                    period.mean_ms,
                    period.max_ms,
                    period.jitter_ms,
                    format!("{low:.3} to {high:.3}")
                )?;
            }
            None => write!(
                f,
                "{:>10} {:>10} {:>10} {:>9} {:>21}",
                "-", "-", "-", "-", "-"
            )?,
        }
        write!(
            f,
            " {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>6.2}",
            self.gaps,
            self.lost,
            self.duplicate,
            self.stale,
            self.crc,
            self.refused,
            self.load * 100.0
        )
    }
}

impl Statistics {
    /// Histograms of the periods of every identifier, as bars.
    #[must_use]
    pub fn histograms(&self) -> String {
        let mut text = String::new();
        for bus in &self.interfaces {
            for (line, period) in bus
                .ids
                .iter()
                .filter_map(|id| Some((id, id.period.as_ref()?)))
            {
                text += &format!(
                    "\nperiods of {} {} on {}, ms\n",
                    line.id, line.name, bus.interface
                );
                let most = period
                    .histogram
                    .iter()
                    .map(|bin| bin.count)
                    .max()
                    .unwrap_or(1);
                for bin in &period.histogram {
                    // A bin that is not empty shows.
                    let bar = "#".repeat((bin.count * BAR).div_ceil(most) as usize);
                    let range = format!("{:.3} to {:.3}", bin.from_ms, bin.to_ms);
                    text += &format!("{range:>24} {:>9} {bar}\n", bin.count);
                }
            }
        }
        text
    }
}
