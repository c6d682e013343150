//! Verdicts about requirements in words, and in the formats of other programs: JUnit XML, needs.json, Markdown.

mod junit;
mod markdown;
mod needs;

use sim::requirements::Verdict;
use sim::scenario::{Ending, Requirement};
use sim::summary::Summary;

pub use junit::junit;
pub use markdown::markdown;
pub use needs::needs;

/// How the run ended, and whether that is how it was to end.
pub fn ending(summary: &Summary) -> Result<String, String> {
    match (&summary.error, summary.recipe.ends) {
        (None, Ending::Completed) => Ok("the run was completed".into()),
        (None, Ending::Stopped) => {
            Err("the run was completed, but the controller was to stop the arm".into())
        }
        (Some(error), Ending::Stopped) if summary.stopped => {
            Ok(format!("the run ended in a stop, as it was to: {error}"))
        }
        (Some(error), Ending::Stopped) => Err(format!("the run did not end in a stop: {error}")),
        (Some(error), Ending::Completed) => Err(format!("the run was not completed: {error}")),
    }
}

/// Why a run has not passed; `None` for one that has.
pub fn failure(summary: &Summary) -> Option<String> {
    if let Err(why) = ending(summary) {
        return Some(why);
    }
    let all = &summary.requirements;
    let missed = all.iter().filter(|verdict| !verdict.met);
    let ids: Vec<&str> = missed.map(|verdict| &*verdict.requirement.id).collect();
    (!ids.is_empty()).then(|| {
        format!(
            "{} of {} requirements missed: {}",
            ids.len(),
            all.len(),
            ids.join(", ")
        )
    })
}

/// What was found: `0.02 mm at 0.412 s, margin 0.08 mm`.
pub fn finding(verdict: &Verdict) -> String {
    let unit = unit(&verdict.requirement);
    match (verdict.value, verdict.margin, verdict.time_s) {
        (Some(value), Some(margin), Some(time)) => {
            let (value, margin) = (number(value), number(margin));
            format!("{value}{unit} at {time:.3} s, margin {margin}{unit}")
        }
        (_, _, Some(time)) => format!("never, in the cycle of {time:.3} s"),
        _ => "nothing was measured".into(),
    }
}

/// What is allowed: `tracking_error_mm at most 0.1 mm in cycle 2`.
pub fn limit(requirement: &Requirement) -> String {
    let unit = unit(requirement);
    let mut text = requirement.quantity.name().to_owned();
    if let Some(axis) = requirement.axis {
        let axis: &str = axis.into();
        text += &format!(" of the {axis}");
    }
    if let Some(state) = requirement.state {
        let state: &str = state.into();
        text += &format!(" of {state}");
    }
    text += &match (requirement.min, requirement.max) {
        (Some(min), Some(max)) => format!(" {} to {}{unit}", number(min), number(max)),
        (Some(min), None) => format!(" at least {}{unit}", number(min)),
        (None, max) => format!(" at most {}{unit}", number(max.unwrap_or_default())),
    };
    if let Some(cycle) = requirement.cycle {
        text += &format!(" in cycle {cycle}");
    }
    if let Some([from, until]) = requirement.during {
        text += &format!(" from {} to {} s", number(from), number(until));
    }
    text
}

/// The unit with a blank before it, if there is one.
fn unit(requirement: &Requirement) -> String {
    match requirement.quantity.unit() {
        "" => String::new(),
        unit => format!(" {unit}"),
    }
}

/// About four digits, without zeros at the end.
fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && size < 1e-4 {
        return format!("{value:.2e}");
    }
    let decimals = match size {
        1000.0.. => 0,
        100.0.. => 1,
        10.0.. => 2,
        1.0.. => 3,
        _ => 4,
    };
    let text = format!("{value:.decimals$}");
    if decimals == 0 {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').into()
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_have_about_four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-0.08, "-0.08"),
            (0.123_456, "0.1235"),
            (12.345_67, "12.35"),
            (100.0, "100"),
            (123_456.7, "123457"),
            (2000.0, "2000"),
            (0.000_012_3, "1.23e-5"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
