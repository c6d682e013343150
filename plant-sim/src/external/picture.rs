//! Histogram of a timing as SVG: one row a quantity, both axes logarithmic, watchdog limits as lines.

use std::fmt::Write as _;
use std::time::Duration;

use super::timing::{Distribution, Timing};

/// Decades of the time axis, from 1 us on.
const DECADES: f64 = 5.0;
/// Bars a decade.
const BARS: usize = 20;
const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 150.0;
const LEFT: f64 = 70.0;
const TOP: f64 = 60.0;
const ROW: f64 = HEIGHT + 70.0;
/// Lines of text under the rows, one a limit.
const LEGEND: f64 = 18.0;
/// Colour of limits.
const LIMIT: &str = "#c0392b";

/// The picture.
pub fn histogram(timing: &Timing) -> String {
    let rows = [
        ("sample after its deadline", &timing.lateness),
        ("period minus its nominal value", &timing.jitter),
        ("feedback to command, age at use", &timing.latency),
    ];
    let legend = TOP + ROW * rows.len() as f64;
    let limits = timing.limits();
    let (width, height) = (WIDTH + LEFT + 30.0, legend + LEGEND * limits.len() as f64);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"24\" font-size=\"16\">Real-time loop: {} samples of {:.0} us, {} commands late, {} overruns</text>\n",
        timing.samples(),
        micros(timing.period()),
        timing.missed_commands(),
        timing.overruns()
    );
    for (index, (name, times)) in rows.into_iter().enumerate() {
        row(&mut svg, TOP + ROW * index as f64, name, times, timing);
    }
    for (index, (name, limit)) in limits.into_iter().enumerate() {
        let _ = writeln!(
            svg,
            "<text x=\"{LEFT}\" y=\"{}\" fill=\"{LIMIT}\">{} ms: {name}</text>",
            legend + LEGEND * index as f64,
            micros(limit) / 1000.0
        );
    }
    svg.push_str("</svg>\n");
    svg
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

/// Place of a time on its axis; what is below 1 us stands at its beginning.
fn x(us: f64) -> f64 {
    LEFT + WIDTH * (us.max(1.0).log10() / DECADES).min(1.0)
}

fn row(svg: &mut String, top: f64, name: &str, times: &Distribution, timing: &Timing) {
    let bottom = top + HEIGHT;
    let mut bars = vec![0u64; BARS * DECADES as usize + 1];
    for (time, count) in times.classes() {
        let bar = micros(time).max(1.0).log10() * BARS as f64;
        bars[(bar as usize).min(BARS * DECADES as usize)] += count;
    }
    // One above the largest count's decade, so that a single sample is still a visible bar.
    let most = bars.iter().copied().max().unwrap_or(0).max(1) as f64;
    let decades = (most.log10().floor() + 1.0).max(1.0);
    let y = |count: f64| bottom - HEIGHT * (count.log10() + 0.3).max(0.0) / (decades + 0.3);
    let _ = writeln!(
        svg,
        "<text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{name}</text>\n\
         <text x=\"{}\" y=\"{}\" text-anchor=\"end\">50 % {:.0} us, 99.9 % {:.0} us, max {:.0} us</text>",
        top - 8.0,
        LEFT + WIDTH,
        top - 8.0,
        micros(times.quantile(0.5)),
        micros(times.quantile(0.999)),
        micros(times.max())
    );
    for decade in 0..=decades as i32 {
        let count = 10f64.powi(decade);
        let _ = writeln!(
            svg,
            "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{1:.1}\" y2=\"{1:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{2}\" y=\"{3:.1}\" text-anchor=\"end\">{count}</text>",
            LEFT + WIDTH,
            y(count),
            LEFT - 6.0,
            y(count) + 4.0
        );
    }
    for (bar, &count) in bars.iter().enumerate().filter(|(_, count)| **count > 0) {
        let left = x(10f64.powf(bar as f64 / BARS as f64));
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#3b6ea5\"/>",
            y(count as f64),
            WIDTH / DECADES / BARS as f64 - 1.0,
            bottom - y(count as f64)
        );
    }
    for (decade, label) in ["1 us", "10 us", "100 us", "1 ms", "10 ms", "100 ms"]
        .iter()
        .enumerate()
    {
        let at = x(10f64.powi(decade as i32));
        let _ = writeln!(
            svg,
            "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{bottom}\" y2=\"{}\" stroke=\"black\"/>\
             <text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{label}</text>",
            bottom + 5.0,
            bottom + 20.0
        );
    }
    let _ = writeln!(
        svg,
        "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{bottom}\" y2=\"{bottom}\" stroke=\"black\"/>",
        LEFT + WIDTH
    );
    for (_, limit) in timing.limits() {
        let at = x(micros(limit));
        let _ = writeln!(
            svg,
            "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{top}\" y2=\"{bottom}\" stroke=\"{LIMIT}\" stroke-dasharray=\"4 3\"/>"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_is_in_a_bar_and_the_picture_is_well_formed() {
        let ms = Duration::from_millis(1);
        let mut timing = Timing::new(ms);
        for sample in 0..1000 {
            timing.woke(
                ms * sample,
                ms * sample + Duration::from_nanos(u64::from(sample) * 77),
            );
            timing.answered(Duration::from_micros(u64::from(sample)));
        }
        timing.answered(Duration::from_secs(10));
        let svg = histogram(&timing);
        assert_eq!(svg.matches('<').count(), svg.matches('>').count());
        // Three latencies are far apart: at 0 and 1 us, up to 1 ms, and beyond the axis.
        assert!(svg.matches("<rect").count() > 3, "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let empty = histogram(&Timing::new(ms));
        assert!(!empty.contains("NaN") && !empty.contains("inf"), "{empty}");
    }
}
