//! The worst cases of a campaign as a picture: a field for each kind of fault and situation, the darker the worse.

use std::collections::BTreeSet;

use sim::campaign::tally::{Tally, Worst};

use crate::chart::Svg;

/// Height of a row and width of a field.
const ROW: f64 = 18.0;
const FIELD: f64 = 52.0;
/// Room for the names of faults, and of situations.
const LEFT: f64 = 310.0;
const TOP: f64 = 140.0;
/// Between the fields of two quantities.
const GAP: f64 = 24.0;

/// Takes a value of a worst case.
type Quantity = fn(&Worst) -> Option<f64>;

/// What is drawn, from left to right.
const QUANTITIES: [(&str, Quantity); 3] = [
    ("way until standstill, mm", |worst| worst.distance_mm),
    ("greatest energy, J", |worst| worst.energy_j),
    ("time until standstill, ms", |worst| worst.standstill_ms),
];

/// The picture, as a self-contained SVG document. Of a quantity the darkest field has the greatest value; fields without one are those of
/// cases that were survived.
#[must_use]
pub fn page(tally: &Tally) -> String {
    let worst: Vec<_> = tally.worst().collect();
    let kinds: BTreeSet<&str> = worst.iter().map(|(kind, ..)| *kind).collect();
    let situations: BTreeSet<&str> = worst.iter().map(|(_, situation, _)| *situation).collect();
    let block = situations.len() as f64 * FIELD + GAP;
    let width = LEFT + block * QUANTITIES.len() as f64 + GAP;
    let mut page = Svg::new(width, TOP + ROW * (kinds.len() as f64 + 0.5), 12);
    for (row, kind) in kinds.iter().enumerate() {
        let y = TOP + ROW * row as f64;
        page.text(LEFT - 8.0, y + 13.0, r#"text-anchor="end""#, kind);
        page.across(LEFT, width - 2.0 * GAP, y + ROW, r##"stroke="#eee""##);
    }
    for (index, (name, of)) in QUANTITIES.iter().enumerate() {
        let left = LEFT + block * index as f64;
        page.text(left, 18.0, r#"font-weight="bold""#, name);
        for (column, situation) in situations.iter().enumerate() {
            let x = left + FIELD * (column as f64 + 0.5);
            let style = format!(r#"transform="rotate(-60 {x:.1} {:.1})""#, TOP - 8.0);
            page.text(x, TOP - 8.0, &style, situation);
        }
        let values = worst.iter().filter_map(|(.., worst)| of(worst));
        let most = values.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        for (kind, situation, worst) in &worst {
            let Some(value) = of(worst) else { continue };
            let row = place(&kinds, kind);
            let column = place(&situations, situation);
            let (x, y) = (left + FIELD * column, TOP + ROW * row);
            let share = (value / most).clamp(0.0, 1.0);
            let fill = format!(r##"fill="#c33" fill-opacity="{share:.2}""##);
            let name = format!("{kind}, {situation}: {value:.1}");
            page.named_rectangle([x + 1.0, y + 1.0, FIELD - 2.0, ROW - 2.0], &fill, &name);
            let style = r#"text-anchor="end" font-size="11""#;
            page.text(x + FIELD - 6.0, y + 13.0, style, &format!("{value:.0}"));
        }
    }
    page.finish()
}

fn place(names: &BTreeSet<&str>, name: &str) -> f64 {
    names.iter().take_while(|before| **before < name).count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::elements;
    use sim::campaign::case::Case;
    use sim::campaign::tally::Outcome;
    use sim::campaign::verdict::Verdict;

    /// Two stops in one row, of which the worse counts, and a case that was survived: its energy only.
    #[test]
    fn a_field_shows_the_worst_of_its_cases() {
        let mut tally = Tally::default();
        for (fault, distance_mm) in [
            ("motor:lift:dead@0.1s", Some(10.0)),
            ("motor:elbow:dead@0.2s", Some(40.0)),
            ("feedback:loss@0.1s", None),
        ] {
            tally.add(&Outcome {
                case: Case {
                    case: 0,
                    situation: "gate & more".into(),
                    faults: vec![fault.parse().unwrap()],
                    seed: 0,
                },
                verdict: Verdict {
                    missed: BTreeSet::new(),
                    survived: distance_mm.is_none(),
                    never_began: false,
                    never_acted: false,
                    unseen: Vec::new(),
                    detected: None,
                    detection_ms: None,
                    standstill_ms: distance_mm,
                    distance_mm,
                    energy_j: Some(5.0),
                    drop_mm: None,
                },
            });
        }
        let svg = page(&tally);
        let fields: Vec<_> = elements(&svg)
            .into_iter()
            .filter_map(|(name, numbers)| (name == "rect").then_some(numbers))
            .filter(|numbers| numbers.contains_key("fill-opacity"))
            .map(|numbers| (numbers["x"], numbers["y"], numbers["fill-opacity"]))
            .collect();
        let (second, third) = (LEFT + FIELD + GAP + 1.0, LEFT + 2.0 * (FIELD + GAP) + 1.0);
        assert_eq!(
            fields,
            [
                (LEFT + 1.0, TOP + ROW + 1.0, 1.0),
                (second, TOP + 1.0, 1.0),
                (second, TOP + ROW + 1.0, 1.0),
                (third, TOP + ROW + 1.0, 1.0),
            ]
        );
        assert!(svg.contains("motor:dead, gate &amp; more: 40.0"));
        assert!(page(&Tally::default()).ends_with("</svg>\n"));
    }
}
