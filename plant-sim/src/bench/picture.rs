//! The benchmark as a picture: bars by rate, payload and place.

use super::{Figures, Report, Row};
use crate::chart::{Svg, ticks};

const LEFT: f64 = 70.0;
const WIDTH: f64 = 900.0;
const TOP: f64 = 70.0;
/// Height of a panel, and what is between two.
const HEIGHT: f64 = 130.0;
const GAP: f64 = 40.0;
/// Under the lowest panel: names of places, written upwards.
const NAMES: f64 = 90.0;

/// A bar of a panel: its figure, colour and name.
type Bar = (fn(&Figures) -> Option<f64>, &'static str, &'static str);

/// What one panel shows. Bars are drawn one over the other, the first one undermost.
struct Panel {
    title: &'static str,
    /// Where bars begin.
    from: f64,
    bars: &'static [Bar],
}

const PANELS: [Panel; 4] = [
    Panel {
        title: "round trip over the optimum",
        from: 1.0,
        bars: &[
            (|row| row.to_0_01_mm_ratio, "#c9ddf0", "to 0.01 mm"),
            (|row| row.to_0_1_mm_ratio, "#8fb8dd", "to 0.1 mm"),
            (|row| row.planned_ratio, "#3b6ea5", "planned"),
        ],
    },
    Panel {
        title: "tracking error, mm",
        from: 0.0,
        bars: &[
            (|row| row.tracking_max_mm, "#e3b7a0", "greatest"),
            (|row| row.tracking_rms_mm, "#a85a32", "root mean square"),
        ],
    },
    Panel {
        title: "settling to 0.01 mm, ms",
        from: 0.0,
        bars: &[(|row| row.settling_ms, "#6a9a5b", "longest")],
    },
    Panel {
        title: "effort over the continuous rating, no pause",
        from: 0.0,
        bars: &[(|row| row.rms_share, "#7d6aa5", "root mean square")],
    },
];

/// The picture of every gate without mismatch.
pub fn picture(report: &Report) -> String {
    let bottom = TOP + (HEIGHT + GAP) * PANELS.len() as f64;
    let mut page = Svg::new(LEFT + WIDTH + 30.0, bottom + NAMES, 12);
    let title = format!("Gates of 25, 300, 25 mm: {}, {}", report.robot, report.law);
    page.text(LEFT, 24.0, r#"font-size="16""#, &title);
    for (index, panel) in PANELS.iter().enumerate() {
        draw(
            &mut page,
            TOP + (HEIGHT + GAP) * index as f64,
            panel,
            &report.rows,
        );
    }
    names(&mut page, bottom - GAP, &report.rows);
    page.finish()
}

/// Left edge and width of the bar of a row.
fn slot(rows: &[Row], index: usize) -> (f64, f64) {
    let width = WIDTH / rows.len().max(1) as f64;
    (LEFT + width * index as f64, width)
}

fn draw(page: &mut Svg, top: f64, panel: &Panel, rows: &[Row]) {
    let values = || {
        let figures = panel.bars.iter().map(|(figure, ..)| figure);
        figures.flat_map(|figure| rows.iter().filter_map(|row| figure(&row.figures)))
    };
    // A panel without values still has an axis.
    let most = values().fold(panel.from, f64::max);
    let high = if most > panel.from {
        most
    } else {
        panel.from + 1.0
    };
    let bottom = top + HEIGHT;
    let y = |value: f64| bottom - HEIGHT * (value - panel.from) / (high - panel.from);
    page.text(LEFT, top - 8.0, r#"font-weight="bold""#, panel.title);
    for (index, (_, colour, name)) in panel.bars.iter().rev().enumerate() {
        let x = LEFT + WIDTH - 130.0 * (panel.bars.len() - index) as f64;
        page.rectangle([x, top - 18.0, 10.0, 10.0], &format!(r#"fill="{colour}""#));
        page.text(x + 16.0, top - 9.0, "", name);
    }
    for tick in ticks(panel.from, high, 4) {
        let at = y(tick.value);
        page.across(LEFT, LEFT + WIDTH, at, r##"stroke="#ddd""##);
        page.text(LEFT - 6.0, at + 4.0, r#"text-anchor="end""#, &tick.label);
    }
    for (index, row) in rows.iter().enumerate() {
        let (left, width) = slot(rows, index);
        for (figure, colour, name) in panel.bars {
            let Some(value) = figure(&row.figures) else {
                continue;
            };
            let place = [left + width * 0.1, y(value), width * 0.8, bottom - y(value)];
            let name = format!(
                "{}, {} kg, {} Hz: {name} {value:.4}",
                row.place, row.payload_kg, row.rate_hz
            );
            page.named_rectangle(place, &format!(r#"fill="{colour}""#), &name);
        }
    }
    page.across(LEFT, LEFT + WIDTH, bottom, r#"stroke="black""#);
}

/// Places under the bars, and where another payload or rate begins.
fn names(page: &mut Svg, bottom: f64, rows: &[Row]) {
    let kind = |row: &Row| (row.payload_kg, row.rate_hz);
    let mut last = None;
    for (index, row) in rows.iter().enumerate() {
        let (left, width) = slot(rows, index);
        let (x, y) = (left + width / 2.0 + 4.0, bottom + 8.0);
        let style =
            format!(r#"font-size="10" text-anchor="end" transform="rotate(-90 {x:.1} {y:.1})""#);
        page.text(x, y, &style, &row.place);
        if last != Some(kind(row)) {
            last = Some(kind(row));
            page.down(left, TOP, bottom + 70.0, r##"stroke="#999""##);
            let (kg, hz) = kind(row);
            page.text(left + 4.0, bottom + 72.0, "", &format!("{kg} kg, {hz} Hz"));
        }
    }
}
