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

/// What one panel shows. The greater of two bars of a row is behind the smaller one.
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
            (|row| row.to_1_mm_ratio, "#2f5680", "to 1 mm"),
            (|row| row.to_0_1_mm_ratio, "#4f83b8", "to 0.1 mm"),
            (|row| row.to_0_01_mm_ratio, "#8fb8dd", "to 0.01 mm"),
            (|row| row.planned_ratio, "#c9ddf0", "planned"),
        ],
    },
    Panel {
        title: "tracking error, mm",
        from: 0.0,
        bars: &[
            (|row| row.tracking_rms_mm, "#a85a32", "root mean square"),
            (|row| row.tracking_max_mm, "#e3b7a0", "greatest"),
        ],
    },
    Panel {
        title: "effort over the continuous rating, without a pause",
        from: 0.0,
        bars: &[(|row| row.rms_share, "#7d6aa5", "root mean square")],
    },
    Panel {
        title: "round trip, s",
        from: 0.0,
        bars: &[
            (|row| row.planned_s, "#4e7d40", "at full speed"),
            (|row| row.continuous_cycle_s, "#a9cc9c", "for ever"),
        ],
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
    for (index, (_, colour, name)) in panel.bars.iter().enumerate() {
        let x = LEFT + WIDTH - 140.0 * (panel.bars.len() - index) as f64;
        page.rectangle([x, top - 18.0, 10.0, 10.0], &format!(r#"fill="{colour}""#));
        page.text(x + 16.0, top - 9.0, "", name);
    }
    for tick in ticks(panel.from, high, 4) {
        let at = y(tick.value);
        page.across(LEFT, LEFT + WIDTH, at, r##"stroke="#ddd""##);
        page.text(LEFT - 6.0, at + 4.0, r#"text-anchor="end""#, &tick.label);
    }
    for index in beginnings(rows) {
        page.down(slot(rows, index).0, top, bottom, r##"stroke="#999""##);
    }
    for (index, row) in rows.iter().enumerate() {
        let (left, width) = slot(rows, index);
        let bars = panel.bars.iter().filter_map(|(figure, colour, name)| {
            let value = figure(&row.figures)?;
            Some((value, colour, name))
        });
        let mut bars: Vec<_> = bars.collect();
        bars.sort_by(|(a, ..), (b, ..)| b.total_cmp(a));
        for (value, colour, name) in bars {
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

/// Rows that begin another payload or rate.
fn beginnings(rows: &[Row]) -> impl Iterator<Item = usize> {
    let kind = |index: usize| rows.get(index).map(|row| (row.payload_kg, row.rate_hz));
    (0..rows.len()).filter(move |index| {
        let before = index.checked_sub(1).and_then(kind);
        before != kind(*index)
    })
}

/// Places, payloads and rates under the bars.
fn names(page: &mut Svg, bottom: f64, rows: &[Row]) {
    for (index, row) in rows.iter().enumerate() {
        let (left, width) = slot(rows, index);
        let (x, y) = (left + width / 2.0 + 4.0, bottom + 8.0);
        let turned = format!(r#"transform="rotate(-90 {x:.1} {y:.1})""#);
        let style = format!(r#"font-size="10" text-anchor="end" {turned}"#);
        page.text(x, y, &style, &row.place);
    }
    for index in beginnings(rows) {
        let (left, _) = slot(rows, index);
        let row = &rows[index];
        let name = format!("{} kg, {} Hz", row.payload_kg, row.rate_hz);
        page.text(left + 4.0, bottom + 72.0, "", &name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::gate;
    use crate::chart::elements;

    /// By hand: two rows share 900 units, so bars are 360 wide and begin at 70 + 45 and 520 + 45; the greatest ratio, 1.2, is as
    /// high as the panel, 130, and 1.1 half of that.
    #[test]
    fn bars_are_where_and_as_high_as_the_figures_are() {
        let row = |planned, arrived| Row {
            place: "a".into(),
            radius_m: 0.7,
            stroke_deg: 0.0,
            payload_kg: 2.0,
            rate_hz: 1000.0,
            friction_factor: 1.0,
            payload_factor: 1.0,
            optimum_s: 0.3,
            fault: None,
            figures: Figures {
                planned_ratio: Some(planned),
                to_1_mm_ratio: arrived,
                ..Figures::default()
            },
        };
        let report = Report {
            robot: "<robot>".into(),
            law: gate::law().to_string(),
            rows: vec![row(1.2, Some(1.1)), row(1.1, None)],
            groups: Vec::new(),
            mismatched: Vec::new(),
            mismatched_groups: Vec::new(),
            others: super::super::Others::of(Vec::new()),
            repeatability: Vec::new(),
        };
        let bars: Vec<_> = elements(&picture(&report))
            .into_iter()
            .filter(|(name, numbers)| name == "rect" && numbers.get("width") == Some(&360.0))
            .map(|(_, numbers)| (numbers["x"], numbers["height"]))
            .collect();
        assert_eq!(bars, [(115.0, 130.0), (115.0, 65.0), (565.0, 65.0)]);
    }
}
