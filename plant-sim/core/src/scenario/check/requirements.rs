//! Checks of requirements: each of them can be judged.

use super::{AMOUNT, Findings, MOMENT};
use crate::allowed::schema::Each;
use crate::model::AXES;
use crate::scenario::{Axis, Measured, Quantity, Requirement};
use crate::text;

/// Longest name of a requirement.
const LONGEST_ID: usize = 64;
/// The axis that does not turn.
const LIFT: usize = 2;

impl Findings<'_> {
    pub(super) fn requirements(&mut self) {
        let requirements = &self.scenario.requirements;
        for (index, requirement) in requirements.iter().enumerate() {
            let key = format!("requirements[{index}]");
            let Requirement { id, text, .. } = requirement;
            let is_allowed = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
            let before = &requirements[..index];
            if !(1..=LONGEST_ID).contains(&id.len()) || !id.chars().all(is_allowed) {
                let allowed = format!("1 to {LONGEST_ID} letters, digits, - _ and .");
                self.wrong(&format!("{key}.id"), format!("{id:?}"), allowed);
            } else if before.iter().any(|other| other.id == *id) {
                let allowed = "a name that no other requirement has";
                self.wrong(&format!("{key}.id"), id, allowed);
            }
            if text.trim().is_empty() {
                let allowed = "what is required, in a sentence";
                self.wrong(&format!("{key}.text"), "empty", allowed);
            }
            self.limits(requirement, &key);
            self.part(requirement, &key);
            self.window(requirement, &key);
        }
    }

    fn limits(&mut self, requirement: &Requirement, key: &str) {
        let Requirement { max, min, .. } = requirement;
        for (name, limit) in [("max", max), ("min", min)] {
            if let Some(limit) = limit {
                self.number(&format!("{key}.{name}"), *limit, AMOUNT);
            }
        }
        match (min, max) {
            (None, None) => self.wrong(key, "without a limit", "max, min or both"),
            (Some(min), Some(max)) if min > max => {
                let allowed = format!("at most max, {max}");
                self.wrong(&format!("{key}.min"), text::number(*min), allowed);
            }
            _ => {}
        }
    }

    /// What the quantity is of.
    fn part(&mut self, requirement: &Requirement, key: &str) {
        let quantity = requirement.quantity;
        let name = quantity.name();
        if let Some(Axis(axis)) = requirement.axis {
            let allowed = match quantity.measured() {
                Measured::Axis => None,
                Measured::Turning => (axis == LIFT).then(|| {
                    format!("an axis that turns; of the lift it is following_error_mm, not {name}")
                }),
                Measured::Arm | Measured::Part | Measured::Run => {
                    Some(format!("no axis: {name} is not of an axis"))
                }
            };
            if let Some(allowed) = allowed {
                self.wrong(&format!("{key}.axis"), AXES[axis], allowed);
            }
        }
        match (quantity, requirement.state) {
            (Quantity::Reached, None) => {
                let allowed = "a state that is to be reached, such as state = \"fault\"";
                self.wrong(key, "without a state", allowed);
            }
            (Quantity::Reached, Some(_)) | (_, None) => {}
            (_, Some(state)) => {
                let state: &str = state.into();
                let allowed = format!("no state: {name} is not of a state");
                self.wrong(&format!("{key}.state"), state, allowed);
            }
        }
    }

    fn window(&mut self, requirement: &Requirement, key: &str) {
        let name = requirement.quantity.name();
        let whole = requirement.quantity.measured() == Measured::Run;
        let no_window = || format!("no window: {name} is of the whole run");
        if let Some(during) = &requirement.during {
            let key = format!("{key}.during");
            self.numbers(&key, during, Each([MOMENT; 2]));
            let [from, until] = during;
            if whole {
                self.wrong(&key, format!("{during:?}"), no_window());
            } else if from >= until {
                let allowed = "an end after the beginning";
                self.wrong(&key, format!("{during:?}"), allowed);
            }
        }
        if let Some(cycle) = requirement.cycle {
            let (key, cycles) = (format!("{key}.cycle"), self.scenario.cycles);
            if whole {
                self.wrong(&key, cycle, no_window());
            } else if !(1..=cycles).contains(&cycle) {
                let allowed = format!("1 to {cycles}, the number of cycles");
                self.wrong(&key, cycle, allowed);
            }
        }
    }
}
