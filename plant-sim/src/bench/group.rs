//! Means and worst of the gates of one payload, rate and mismatch.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Figures, Row};

/// The gates of one payload, rate and mismatch, over the places.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Group {
    /// Payload as announced to the controller, kg.
    pub payload_kg: f64,
    /// Control rate, Hz.
    pub rate_hz: f64,
    /// True friction over the one that the controller believes in.
    pub friction_factor: f64,
    /// True payload over the announced one.
    pub payload_factor: f64,
    /// Gates.
    pub gates: usize,
    /// How many of them were not completed; they are in neither of the following.
    pub faults: usize,
    /// Mean of each figure; `null` where one of the gates has none.
    pub mean: Figures,
    /// The worst of each figure: the least of `gate_margin_mm` and `continuous_speed`, the greatest of the others.
    pub worst: Figures,
}

/// The groups of `rows`, in the order in which they appear.
pub(super) fn groups(rows: &[Row]) -> Vec<Group> {
    let mut kinds: Vec<[f64; 4]> = Vec::new();
    for row in rows {
        if !kinds.contains(&kind(row)) {
            kinds.push(kind(row));
        }
    }
    kinds.into_iter().map(|of| group(rows, of)).collect()
}

fn kind(row: &Row) -> [f64; 4] {
    [
        row.rate_hz,
        row.payload_kg,
        row.friction_factor,
        row.payload_factor,
    ]
}

fn group(rows: &[Row], of: [f64; 4]) -> Group {
    let all = || rows.iter().filter(|row| kind(row) == of);
    let complete: Vec<Figures> = all()
        .filter(|row| row.fault.is_none())
        .map(|row| row.figures)
        .collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let [rate_hz, payload_kg, friction_factor, payload_factor] = of;
    Group {
        payload_kg,
        rate_hz,
        friction_factor,
        payload_factor,
        gates: all().count(),
        faults: all().count() - complete.len(),
        mean: each(&complete, mean),
        worst: Figures {
            gate_margin_mm: each(&complete, least).gate_margin_mm,
            continuous_speed: each(&complete, least).continuous_speed,
            ..each(&complete, greatest)
        },
    }
}

/// Each figure by itself; none where one of the rows has none, or there are none.
fn each(rows: &[Figures], how: impl Fn(&[f64]) -> f64) -> Figures {
    let of = |figure: fn(&Figures) -> Option<f64>| {
        let values: Vec<f64> = rows.iter().map(figure).collect::<Option<_>>()?;
        (!values.is_empty()).then(|| how(&values))
    };
    Figures {
        planned_s: of(|row| row.planned_s),
        to_1_mm_s: of(|row| row.to_1_mm_s),
        to_0_1_mm_s: of(|row| row.to_0_1_mm_s),
        to_0_01_mm_s: of(|row| row.to_0_01_mm_s),
        planned_ratio: of(|row| row.planned_ratio),
        to_1_mm_ratio: of(|row| row.to_1_mm_ratio),
        to_0_1_mm_ratio: of(|row| row.to_0_1_mm_ratio),
        to_0_01_mm_ratio: of(|row| row.to_0_01_mm_ratio),
        tracking_max_mm: of(|row| row.tracking_max_mm),
        tracking_rms_mm: of(|row| row.tracking_rms_mm),
        settling_ms: of(|row| row.settling_ms),
        overshoot_mm: of(|row| row.overshoot_mm),
        gate_margin_mm: of(|row| row.gate_margin_mm),
        torque_share: of(|row| row.torque_share),
        torque_rate_share: of(|row| row.torque_rate_share),
        speed_share: of(|row| row.speed_share),
        rms_share: of(|row| row.rms_share),
        continuous_speed: of(|row| row.continuous_speed),
        continuous_cycle_s: of(|row| row.continuous_cycle_s),
        pause_s: of(|row| row.pause_s),
        saturation_ms: of(|row| row.saturation_ms),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(place: &str, payload_kg: f64, tracking: f64, settling: Option<f64>) -> Row {
        Row {
            place: place.into(),
            radius_m: 0.7,
            stroke_deg: 0.0,
            payload_kg,
            rate_hz: 1000.0,
            friction_factor: 1.0,
            payload_factor: 1.0,
            optimum_s: 0.3,
            fault: None,
            figures: Figures {
                tracking_max_mm: Some(tracking),
                gate_margin_mm: Some(-tracking),
                settling_ms: settling,
                ..Figures::default()
            },
        }
    }

    /// By hand.
    #[test]
    fn groups_have_means_and_the_worst_of_what_was_completed() {
        let mut rows = vec![
            row("a", 2.0, 1.0, Some(3.0)),
            row("b", 2.0, 4.0, Some(1.0)),
            row("a", 0.0, 5.0, Some(1.0)),
            row("b", 0.0, 6.0, None),
            row("c", 2.0, 9.0, Some(9.0)),
        ];
        rows[4].fault = Some("over".into());
        let groups = groups(&rows);
        let [two, none] = groups.as_slice() else {
            panic!("{groups:?}")
        };
        assert_eq!((two.gates, two.faults), (3, 1));
        assert_eq!(two.mean.tracking_max_mm, Some(2.5));
        assert_eq!(two.worst.tracking_max_mm, Some(4.0));
        assert_eq!(two.worst.gate_margin_mm, Some(-4.0));
        assert_eq!(two.worst.settling_ms, Some(3.0));
        assert_eq!((none.payload_kg, none.faults), (0.0, 0));
        assert_eq!(none.worst.settling_ms, None);
        assert_eq!(none.mean.tracking_max_mm, Some(5.5));
    }
}
