//! Draws a [`Plot`] as SVG.

use std::fmt::Write as _;

use protocol::messages::Mode;
use sim::model::AXES;

use crate::chart::{Svg, ticks};

use super::series::Series;
use super::{Mark, Plot};

const WIDTH: f64 = 1200.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 150.0;
const TOP: f64 = 138.0;
const PANEL: f64 = 120.0;
const GAP: f64 = 30.0;
const STRIP: f64 = 20.0;

/// Distinguishable with every kind of colour vision (Okabe and Ito 2008).
const COLOURS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

/// Style of dots.
const DOT: &str = r##"stroke="#222" stroke-width="3.2" stroke-linecap="round""##;

/// A panel: curves in one unit.
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
    /// Dots instead of a line, for values too sparse to join.
    dots: bool,
}

/// The whole document, with all pictures one below the other.
pub(crate) fn page(plots: &[Plot]) -> String {
    let height = plots.iter().map(height).sum();
    let mut page = Svg::new(WIDTH, height, 12);
    let mut top = 0.0;
    for plot in plots {
        page.begin_group(top);
        draw(&mut page, plot);
        page.end_group();
        top += self::height(plot);
    }
    page.finish()
}

fn height(plot: &Plot) -> f64 {
    TOP + panels(plot).len() as f64 * (PANEL + GAP) + 30.0
}

/// One picture.
fn draw(page: &mut Svg, plot: &Plot) {
    let panels = panels(plot);
    let span = (plot.newest_us as f64).max(1.0);
    let heading = r#"font-size="16" font-weight="bold""#;
    page.text(LEFT, 26.0, heading, &plot.title);
    if plot.undrawn > 0 {
        let note = format!(
            "{} further mode changes and events are not drawn",
            plot.undrawn
        );
        page.text(LEFT, height(plot) - 8.0, "", &note);
    }
    modes(page, plot, span);
    for (index, panel) in panels.iter().enumerate() {
        let top = TOP + index as f64 * (PANEL + GAP);
        draw_panel(page, panel, top, span);
    }
    let bottom = TOP + panels.len() as f64 * (PANEL + GAP) - GAP;
    marks(page, &plot.marks, bottom, span);
    time_axis(page, bottom, span);
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

fn draw_panel(page: &mut Svg, panel: &Panel, top: f64, span: f64) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (_, bin) in panel.curves.iter().flat_map(|curve| curve.series.bins()) {
        low = low.min(f64::from(bin.min) * panel.scale);
        high = high.max(f64::from(bin.max) * panel.scale);
    }
    if low > high {
        (low, high) = (0.0, 0.0);
    }
    // Even a flat curve gets an axis.
    let margin = ((high - low) * 0.06).max(1e-3).max(high.abs() * 1e-6);
    (low, high) = (low - margin, high + margin);
    let y = |value: f64| top + PANEL - (value - low) / (high - low) * PANEL;
    let right = WIDTH - RIGHT;

    for tick in ticks(low, high, 5) {
        let at = y(tick.value);
        page.across(LEFT, right, at, r##"stroke="#e4e4e4""##);
        let style = r#"text-anchor="end" font-size="11""#;
        page.text(LEFT - 6.0, at + 4.0, style, &tick.label);
    }
    let frame = r##"fill="none" stroke="#888""##;
    page.rectangle([LEFT, top, right - LEFT, PANEL], frame);
    let title = format!("{} / {}", panel.title, panel.unit);
    page.text(LEFT, top - 6.0, r#"font-weight="bold""#, &title);
    for curve in &panel.curves {
        let (x, y) = (|time| x(time, span), |value| y(value * panel.scale));
        if curve.dots {
            page.path(&dots(curve.series, x, y), DOT);
        } else {
            let style = format!(r#"stroke-width="1.3" stroke="{}""#, curve.colour);
            page.polyline(&points(curve.series, x, y), &style);
        }
    }
    legend(page, panel, top);
}

fn legend(page: &mut Svg, panel: &Panel, top: f64) {
    let left = WIDTH - RIGHT + 10.0;
    let mut at = top + 12.0;
    for curve in panel.curves.iter().filter(|curve| !curve.dots) {
        let style = format!(r#"stroke="{}" stroke-width="2""#, curve.colour);
        page.across(left, left + 22.0, at - 4.0, &style);
        page.text(left + 28.0, at, "", curve.name);
        at += 17.0;
    }
    if panel.curves.iter().any(|curve| curve.dots) {
        let dots = format!("M{:.1} {:.1}h0m9 0h0m9 0h0", left + 2.0, at - 4.0);
        page.path(&dots, DOT);
        page.text(left + 28.0, at, "", "set");
    }
}

/// Dots as lines of zero length with round ends.
fn dots(series: &Series, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let mut text = String::new();
    for (time, bin) in series.bins() {
        let middle = (f64::from(bin.min) + f64::from(bin.max)) / 2.0;
        let _ = write!(text, "M{:.1} {:.1}h0", x(time), y(middle));
    }
    text
}

/// The envelope as one line: in each bin the extreme nearer to the last point comes first.
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
fn modes(page: &mut Svg, plot: &Plot, span: f64) {
    let top = TOP - STRIP - 22.0;
    let bold = r#"text-anchor="end" font-weight="bold""#;
    page.text(LEFT - 6.0, top + 14.0, bold, "mode");
    let small = r##"text-anchor="end" font-size="10" fill="#555""##;
    page.text(LEFT - 6.0, top - 2.0, small, "requests");
    let ends = plot
        .modes
        .iter()
        .skip(1)
        .map(|(time, _)| *time as f64)
        .chain([span]);
    for ((start, mode), end) in plot.modes.iter().zip(ends) {
        let (left, right) = (x(*start as f64, span), x(end, span));
        let width = right - left;
        let style = format!(
            r##"fill="{}" stroke="#fff" stroke-width="0.5""##,
            colour(*mode)
        );
        let name = format!("{mode} from {:.3} s", *start as f64 / 1e6);
        page.named_rectangle([left, top, width, STRIP], &style, &name);
        // A name that does not fit is only in the tooltip: letters of this size take 7 units.
        if width > 7.0 * mode.name().len() as f64 {
            let style = r#"font-size="11" text-anchor="middle""#;
            page.text(left + width / 2.0, top + 14.0, style, mode.name());
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
fn marks(page: &mut Svg, marks: &[Mark], bottom: f64, span: f64) {
    let name = |mark: &Mark| format!("{} at {:.3} s", mark.text, mark.time_us as f64 / 1e6);
    for (index, mark) in marks.iter().filter(|mark| mark.grave).enumerate() {
        let at = x(mark.time_us as f64, span);
        // Neighbouring names take turns on three lines.
        let height = 46.0 + (index % 3) as f64 * 14.0;
        let (anchor, shift) = if at > WIDTH - RIGHT - 150.0 {
            ("end", -4.0)
        } else {
            ("start", 4.0)
        };
        let stroke = r##"stroke="#c00" stroke-width="1.2""##;
        page.down(at, height - 10.0, bottom, stroke);
        let style = format!(r##"fill="#c00" text-anchor="{anchor}""##);
        page.text(at + shift, height, &style, &name(mark));
    }
    for mark in marks.iter().filter(|mark| !mark.grave) {
        let (at, foot) = (x(mark.time_us as f64, span), TOP - STRIP - 23.0);
        let stroke = r##"stroke="#555" stroke-width="1.5""##;
        page.named_down(at, foot, foot - 5.0, stroke, &name(mark));
    }
}

fn time_axis(page: &mut Svg, bottom: f64, span: f64) {
    for tick in ticks(0.0, span / 1e6, 10) {
        let at = x(tick.value * 1e6, span);
        let stroke = r##"stroke="#888" stroke-opacity="0.3""##;
        page.down(at, TOP, bottom + 5.0, stroke);
        let style = r#"text-anchor="middle" font-size="11""#;
        page.text(at, bottom + 18.0, style, &tick.label);
    }
    page.text(WIDTH - RIGHT + 10.0, bottom + 18.0, "", "time / s");
}
