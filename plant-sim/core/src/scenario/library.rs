//! Scenarios that come with the program.

use crate::text::allowed;

macro_rules! built_in {
    ($($name:literal),+) => {
        [$(($name, include_str!(concat!("../../../scenarios/", $name, ".toml")))),+]
    };
}

/// Scenarios that come with the program: name and text.
const BUILT_IN: [(&str, &str); 21] = built_in![
    "gate",
    "gate-mismatch",
    "gate-vertical",
    "gate-22kg",
    "heavier-load",
    "override",
    "square",
    "arc",
    "blend",
    "pick-place",
    "palletise",
    "screw",
    "payload-change",
    "far-reach",
    "near-singular",
    "long-run",
    "link-loss",
    "bus-off",
    "bus-off-stays",
    "encoder-fault",
    "estop-descent"
];

/// The text of the scenario of this name that comes with the program.
pub fn built_in(name: &str) -> Option<&'static str> {
    let (_, text) = BUILT_IN.iter().find(|(known, _)| *known == name)?;
    Some(text)
}

/// Names of the scenarios that come with the program.
pub fn names() -> [&'static str; BUILT_IN.len()] {
    BUILT_IN.map(|(name, _)| name)
}

/// Those names, for a message that none is called `name`, and the one most likely meant.
pub fn instead_of(name: &str) -> String {
    allowed(name, &names())
}

#[cfg(test)]
mod tests {
    use super::super::Scenario;
    use super::BUILT_IN;

    #[test]
    fn built_in_scenarios_are_valid_and_named_as_listed() {
        for (name, text) in BUILT_IN {
            let scenario = Scenario::parse(text, name).unwrap();
            assert_eq!(scenario.name, name);
        }
    }

    #[test]
    fn there_is_no_scenario_of_another_name() {
        assert!(Scenario::built_in("nowhere").is_none());
    }
}
