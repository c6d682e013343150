//! Histogram of a timing as SVG: one row per quantity, both axes logarithmic, watchdog limits as lines.

use std::time::Duration;

use super::timing::{Distribution, Timing};
use crate::chart::Svg;

/// Decades of the time axis, from 1 us up.
const DECADES: f64 = 5.0;
/// Bars per decade.
const BARS: usize = 20;
const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 150.0;
const LEFT: f64 = 70.0;
const TOP: f64 = 60.0;
const ROW: f64 = HEIGHT + 70.0;
/// Lines of text under the rows, one per limit.
const LEGEND: f64 = 18.0;
/// Colour of limits.
const LIMIT: &str = "#c0392b";

/// The picture.
pub fn histogram(timing: &Timing) -> String {
    let rows = [
        ("sample after its deadline", &timing.lateness),
        ("period minus its nominal value", &timing.jitter),
        ("sample due to command, age at use", &timing.age),
    ];
    let legend = TOP + ROW * rows.len() as f64;
    let limits = timing.limits();
    let (width, height) = (WIDTH + LEFT + 30.0, legend + LEGEND * limits.len() as f64);
    let mut page = Svg::new(width, height, 13);
    let title = format!(
        "Real-time loop: {} samples of {:.0} us, {} commands late, {} overruns",
        timing.samples(),
        micros(timing.period()),
        timing.missed_commands(),
        timing.overruns()
    );
    page.text(LEFT, 24.0, r#"font-size="16""#, &title);
    for (index, (name, times)) in rows.into_iter().enumerate() {
        row(&mut page, TOP + ROW * index as f64, name, times, timing);
    }
    for (index, (name, limit)) in limits.into_iter().enumerate() {
        let line = format!("{} ms: {name}", micros(limit) / 1000.0);
        let style = format!(r#"fill="{LIMIT}""#);
        page.text(LEFT, legend + LEGEND * index as f64, &style, &line);
    }
    page.finish()
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

/// Position of a time on its axis; below 1 us it is at the start.
fn x(us: f64) -> f64 {
    LEFT + WIDTH * (libm::log10(us.max(1.0)) / DECADES).min(1.0)
}

fn row(page: &mut Svg, top: f64, name: &str, times: &Distribution, timing: &Timing) {
    let bottom = top + HEIGHT;
    let right = LEFT + WIDTH;
    let mut bars = vec![0u64; BARS * DECADES as usize + 1];
    for (time, count) in times.classes() {
        let bar = libm::log10(micros(time).max(1.0)) * BARS as f64;
        bars[(bar as usize).min(BARS * DECADES as usize)] += count;
    }
    // Scaled so that a single sample is still a visible bar.
    let most = bars.iter().copied().max().unwrap_or(0).max(1) as f64;
    let decades = (libm::log10(most).floor() + 1.0).max(1.0);
    let y = |count: f64| bottom - HEIGHT * (libm::log10(count) + 0.3).max(0.0) / (decades + 0.3);
    page.text(LEFT, top - 8.0, r#"font-weight="bold""#, name);
    let quantiles = format!(
        "50 % {:.0} us, 99.9 % {:.0} us, max {:.0} us",
        micros(times.quantile(0.5)),
        micros(times.quantile(0.999)),
        micros(times.max())
    );
    page.text(right, top - 8.0, r#"text-anchor="end""#, &quantiles);
    for decade in 0..=decades as i32 {
        let count = 10f64.powi(decade);
        let at = y(count);
        page.across(LEFT, right, at, r##"stroke="#ddd""##);
        let style = r#"text-anchor="end""#;
        page.text(LEFT - 6.0, at + 4.0, style, &count.to_string());
    }
    for (bar, &count) in bars.iter().enumerate().filter(|(_, count)| **count > 0) {
        let left = x(libm::pow(10.0, bar as f64 / BARS as f64));
        let (top, width) = (y(count as f64), WIDTH / DECADES / BARS as f64 - 1.0);
        let style = r##"fill="#3b6ea5""##;
        page.rectangle([left, top, width, bottom - top], style);
    }
    let black = r#"stroke="black""#;
    for (decade, label) in ["1 us", "10 us", "100 us", "1 ms", "10 ms", "100 ms"]
        .iter()
        .enumerate()
    {
        let at = x(10f64.powi(decade as i32));
        page.down(at, bottom, bottom + 5.0, black);
        page.text(at, bottom + 20.0, r#"text-anchor="middle""#, label);
    }
    page.across(LEFT, right, bottom, black);
    for (_, limit) in timing.limits() {
        let style = format!(r#"stroke="{LIMIT}" stroke-dasharray="4 3""#);
        page.down(x(micros(limit)), top, bottom, &style);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::elements;

    /// Left edge and height of every bar below `top`, without the page itself.
    fn bars(svg: &str, top: f64) -> Vec<(f64, f64)> {
        let elements = elements(svg).into_iter();
        elements
            .filter(|(name, numbers)| name == "rect" && numbers.contains_key("x"))
            .map(|(_, numbers)| (numbers["x"], numbers["y"], numbers["height"]))
            .filter(|(_, y, height)| (top..=top + HEIGHT).contains(&(y + height)))
            .map(|(x, _, height)| (x, height))
            .collect()
    }

    /// Bars by hand: five decades on 800 units from 70 on, so 10 us begin at 230 and 1 ms at 550. The greatest count is
    /// 20: heights are (log10 n + 0.3) / 2.3 of 150.
    #[test]
    fn bars_are_where_and_as_high_as_the_times_are() {
        let mut timing = Timing::new(Duration::from_millis(1));
        for (us, count) in [(10, 20), (1_000, 1)] {
            for _ in 0..count {
                timing.answered(Duration::from_nanos(us * 1_000 + 500));
            }
        }
        let svg = histogram(&timing);
        assert_eq!(bars(&svg, TOP + 2.0 * ROW), [(230.0, 104.4), (550.0, 19.6)]);
        assert_eq!(bars(&svg, TOP + ROW), []);
        assert_eq!(
            bars(&histogram(&Timing::new(Duration::from_millis(1))), TOP),
            []
        );
    }

    /// Times beyond either end of the axis are drawn at that end, not lost.
    #[test]
    fn times_beyond_the_axis_are_in_its_outer_bars() {
        let mut timing = Timing::new(Duration::from_millis(1));
        timing.answered(Duration::ZERO);
        timing.answered(Duration::from_secs(10));
        let left: Vec<_> = bars(&histogram(&timing), TOP + 2.0 * ROW)
            .into_iter()
            .map(|(left, _)| left)
            .collect();
        assert_eq!((left[0], left.len()), (LEFT, 2));
        assert!(left[1] > LEFT + WIDTH * 0.9, "{left:?}");
    }
}
