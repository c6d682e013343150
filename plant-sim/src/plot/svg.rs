//! Draws a [`Plot`] as SVG.

use std::fmt::Write as _;

use protocol::messages::Mode;

use super::series::Series;
use super::{Mark, Plot};

const WIDTH: f64 = 1200.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 150.0;
const TOP: f64 = 138.0;
const PANEL: f64 = 120.0;
const GAP: f64 = 30.0;
const STRIP: f64 = 20.0;

const AXES: [&str; 4] = ["shoulder", "elbow", "lift", "wrist"];
/// Distinguishable with every kind of colour vision (Okabe and Ito 2008).
const COLOURS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

/// Style of dots.
const DOT: &str = r##"stroke="#222" stroke-width="3.2" stroke-linecap="round""##;

/// A line of markup; writing to a string cannot fail.
macro_rules! line {
    ($text:expr, $($arg:tt)*) => {{
        let _ = writeln!($text, $($arg)*);
    }};
}

/// What a panel shows: curves in one unit.
struct Panel<'a> {
    title: &'static str,
    unit: &'static str,
    /// From the unit of the series to that of the panel.
    scale: f64,
    curves: Vec<Curve<'a>>,
}

struct Curve<'a> {
    series: &'a Series,
    name: &'static str,
    colour: &'static str,
    /// Dots instead of a line: values that come too seldom to join them.
    dots: bool,
}

/// The whole document, with all pictures.
pub fn page(plots: &[Plot]) -> String {
    let mut text = String::new();
    let mut height = 0.0;
    for plot in plots {
        line!(text, r#"<g transform="translate(0 {height})">"#);
        height += draw(&mut text, plot);
        line!(text, "</g>");
    }
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" font-family="sans-serif" font-size="12" fill="#222">
<rect width="100%" height="100%" fill="#fff"/>
{text}</svg>
"##
    )
}

/// One picture; gives its height.
fn draw(text: &mut String, plot: &Plot) -> f64 {
    let panels = panels(plot);
    let span = (plot.newest_us as f64).max(1.0);
    let height = TOP + panels.len() as f64 * (PANEL + GAP) + 30.0;
    line!(
        text,
        r#"<text x="{LEFT}" y="26" font-size="16" font-weight="bold">{}</text>"#,
        escape(&plot.title)
    );
    if plot.undrawn > 0 {
        line!(
            text,
            r#"<text x="{LEFT}" y="{height:.1}" dy="-8">{} further mode changes and events are not drawn</text>"#,
            plot.undrawn
        );
    }
    modes(text, plot, span);
    for (index, panel) in panels.iter().enumerate() {
        let top = TOP + index as f64 * (PANEL + GAP);
        draw_panel(text, panel, top, span);
    }
    let bottom = TOP + panels.len() as f64 * (PANEL + GAP) - GAP;
    marks(text, &plot.marks, bottom, span);
    time_axis(text, bottom, span);
    height
}

fn panels(plot: &Plot) -> Vec<Panel<'_>> {
    let turning = [0, 1, 3];
    let curve = |series, axis: usize, dots| Curve {
        series,
        name: AXES[axis],
        colour: COLOURS[axis],
        dots,
    };
    let positions = |axes: &[usize]| -> Vec<Curve<'_>> {
        let actual = axes
            .iter()
            .map(|&axis| curve(&plot.actual[axis], axis, false));
        let set = axes.iter().map(|&axis| curve(&plot.set[axis], axis, true));
        actual.chain(set).collect()
    };
    let errors = |axes: &[usize]| -> Vec<Curve<'_>> {
        axes.iter()
            .map(|&axis| curve(&plot.error[axis], axis, false))
            .collect()
    };
    vec![
        Panel {
            title: "position",
            unit: "deg",
            scale: 180.0 / std::f64::consts::PI,
            curves: positions(&turning),
        },
        Panel {
            title: "position",
            unit: "mm",
            scale: 1e3,
            curves: positions(&[2]),
        },
        Panel {
            title: "tracking error",
            unit: "mrad",
            scale: 1e3,
            curves: errors(&turning),
        },
        Panel {
            title: "tracking error",
            unit: "µm",
            scale: 1e6,
            curves: errors(&[2]),
        },
        Panel {
            title: "motor torque",
            unit: "% of limit",
            scale: 100.0,
            curves: (0..4)
                .map(|axis| curve(&plot.torque[axis], axis, false))
                .collect(),
        },
    ]
}

fn x(time_us: f64, span: f64) -> f64 {
    LEFT + time_us / span * (WIDTH - LEFT - RIGHT)
}

fn draw_panel(text: &mut String, panel: &Panel, top: f64, span: f64) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (_, bin) in panel.curves.iter().flat_map(|curve| curve.series.bins()) {
        low = low.min(f64::from(bin.min) * panel.scale);
        high = high.max(f64::from(bin.max) * panel.scale);
    }
    if low > high {
        (low, high) = (0.0, 0.0);
    }
    // A flat curve gets an axis too.
    let margin = ((high - low) * 0.06).max(1e-3).max(high.abs() * 1e-6);
    (low, high) = (low - margin, high + margin);
    let y = |value: f64| top + PANEL - (value - low) / (high - low) * PANEL;
    let right = WIDTH - RIGHT;

    for tick in ticks(low, high, 5) {
        let at = y(tick.value);
        line!(
            text,
            r##"<path d="M{LEFT} {at:.1}H{right}" stroke="#e4e4e4"/><text x="{:.1}" y="{:.1}" text-anchor="end" font-size="11">{}</text>"##,
            LEFT - 6.0,
            at + 4.0,
            tick.label
        );
    }
    line!(
        text,
        r##"<rect x="{LEFT}" y="{top}" width="{:.1}" height="{PANEL}" fill="none" stroke="#888"/>"##,
        right - LEFT
    );
    line!(
        text,
        r#"<text x="{LEFT}" y="{:.1}" font-weight="bold">{} / {}</text>"#,
        top - 6.0,
        panel.title,
        panel.unit
    );
    for curve in &panel.curves {
        let (x, y) = (|time| x(time, span), |value| y(value * panel.scale));
        if curve.dots {
            let dots = dots(curve.series, x, y);
            line!(text, r#"<path {DOT} d="{dots}"/>"#);
        } else {
            line!(
                text,
                r#"<polyline fill="none" stroke-width="1.3" stroke="{}" points="{}"/>"#,
                curve.colour,
                points(curve.series, x, y)
            );
        }
    }
    legend(text, panel, top);
}

fn legend(text: &mut String, panel: &Panel, top: f64) {
    let left = WIDTH - RIGHT + 10.0;
    let actual = panel.curves.iter().filter(|curve| !curve.dots);
    let mut row = 0.0;
    for curve in actual {
        let at = top + 12.0 + row * 17.0;
        line!(
            text,
            r#"<path d="M{left} {:.1}h22" stroke="{}" stroke-width="2"/><text x="{:.1}" y="{:.1}">{}</text>"#,
            at - 4.0,
            curve.colour,
            left + 28.0,
            at,
            curve.name
        );
        row += 1.0;
    }
    if panel.curves.iter().any(|curve| curve.dots) {
        let at = top + 12.0 + row * 17.0;
        line!(
            text,
            r#"<path {DOT} d="M{:.1} {:.1}h0m9 0h0m9 0h0"/><text x="{:.1}" y="{at:.1}">set</text>"#,
            left + 2.0,
            at - 4.0,
            left + 28.0
        );
    }
}

/// A dot is a line of no length with round ends.
fn dots(series: &Series, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let mut text = String::new();
    for (time, bin) in series.bins() {
        let middle = (f64::from(bin.min) + f64::from(bin.max)) / 2.0;
        let _ = write!(text, "M{:.1} {:.1}h0", x(time), y(middle));
    }
    text
}

/// The envelope as one line: of each bin the extreme that is nearer to the last point comes first.
fn points(series: &Series, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let mut text = String::new();
    let mut last = None;
    for (time, bin) in series.bins() {
        let (x, near, far) = (x(time), f64::from(bin.min), f64::from(bin.max));
        let falling = last.is_some_and(|last: f64| (last - far).abs() < (last - near).abs());
        let (first, second) = if falling { (far, near) } else { (near, far) };
        let _ = write!(text, "{x:.1},{:.1} ", y(first));
        if first != second {
            let _ = write!(text, "{x:.1},{:.1} ", y(second));
        }
        last = Some(second);
    }
    text
}

/// A strip of the modes over time.
fn modes(text: &mut String, plot: &Plot, span: f64) {
    let top = TOP - STRIP - 22.0;
    line!(
        text,
        r#"<text x="{:.1}" y="{:.1}" text-anchor="end" font-weight="bold">mode</text>"#,
        LEFT - 6.0,
        top + 14.0
    );
    line!(
        text,
        r##"<text x="{:.1}" y="{:.1}" text-anchor="end" font-size="10" fill="#555">requests</text>"##,
        LEFT - 6.0,
        top - 2.0
    );
    let ends = plot
        .modes
        .iter()
        .skip(1)
        .map(|(time, _)| *time as f64)
        .chain([span]);
    for ((start, mode), end) in plot.modes.iter().zip(ends) {
        let (left, right) = (x(*start as f64, span), x(end, span));
        let width = right - left;
        line!(
            text,
            r##"<rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{STRIP}" fill="{}" stroke="#fff" stroke-width="0.5"><title>{mode} from {:.3} s</title></rect>"##,
            colour(*mode),
            *start as f64 / 1e6
        );
        // A name that would not fit is left to the tooltip: letters of this size take 7 units.
        if width > 7.0 * mode.name().len() as f64 {
            line!(
                text,
                r#"<text x="{:.1}" y="{:.1}" font-size="11" text-anchor="middle">{mode}</text>"#,
                left + width / 2.0,
                top + 14.0
            );
        }
    }
}

fn colour(mode: Mode) -> &'static str {
    match mode {
        Mode::Boot | Mode::SelfTest | Mode::PreOperational => "#e0e0e0",
        Mode::Ready => "#fff1b8",
        Mode::Enabling | Mode::Disabling => "#ffdca8",
        Mode::Enabled => "#cfe6f7",
        Mode::Moving => "#bfe5cf",
        Mode::QuickStop | Mode::FaultReaction => "#f7b89c",
        Mode::Fault | Mode::EStop => "#f19a9a",
    }
}

/// Faults as red lines with their names, requests as grey ticks above the panels.
fn marks(text: &mut String, marks: &[Mark], bottom: f64, span: f64) {
    for (index, mark) in marks.iter().filter(|mark| mark.grave).enumerate() {
        let at = x(mark.time_us as f64, span);
        // Neighbouring names take turns on three lines.
        let height = 46.0 + (index % 3) as f64 * 14.0;
        let (anchor, shift) = if at > WIDTH - RIGHT - 150.0 {
            ("end", -4.0)
        } else {
            ("start", 4.0)
        };
        line!(
            text,
            r##"<path d="M{at:.1} {:.1}V{bottom:.1}" stroke="#c00" stroke-width="1.2"/><text x="{:.1}" y="{height:.1}" fill="#c00" text-anchor="{anchor}">{} at {:.3} s</text>"##,
            height - 10.0,
            at + shift,
            escape(&mark.text),
            mark.time_us as f64 / 1e6
        );
    }
    for mark in marks.iter().filter(|mark| !mark.grave) {
        let at = x(mark.time_us as f64, span);
        line!(
            text,
            r##"<path d="M{at:.1} {:.1}v-5" stroke="#555" stroke-width="1.5"><title>{} at {:.3} s</title></path>"##,
            TOP - STRIP - 23.0,
            escape(&mark.text),
            mark.time_us as f64 / 1e6
        );
    }
}

fn time_axis(text: &mut String, bottom: f64, span: f64) {
    for tick in ticks(0.0, span / 1e6, 10) {
        let at = x(tick.value * 1e6, span);
        line!(
            text,
            r##"<path d="M{at:.1} {bottom:.1}v5M{at:.1} {TOP}V{bottom:.1}" stroke="#888" stroke-opacity="0.3"/><text x="{at:.1}" y="{:.1}" text-anchor="middle" font-size="11">{}</text>"##,
            bottom + 18.0,
            tick.label
        );
    }
    line!(
        text,
        r#"<text x="{:.1}" y="{:.1}">time / s</text>"#,
        WIDTH - RIGHT + 10.0,
        bottom + 18.0
    );
}

struct Tick {
    value: f64,
    label: String,
}

/// Round values between two bounds, about `count` of them: steps of 1, 2 or 5 times a power of ten.
fn ticks(low: f64, high: f64, count: u32) -> Vec<Tick> {
    let rough = (high - low) / f64::from(count);
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|step| *step >= rough)
        .unwrap_or(10.0 * power);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last)
        .map(|number| {
            let value = number as f64 * step;
            Tick {
                value,
                label: format!("{value:.decimals$}"),
            }
        })
        .collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
