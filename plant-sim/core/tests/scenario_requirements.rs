//! Requirements in a scenario: what cannot be judged is refused, with place and allowed values.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/scenario.rs"]
mod common;

use common::{BASE, said_of};
use sim::scenario::Scenario;

#[test]
fn a_requirement_that_cannot_be_judged_is_refused() {
    let good = "id = \"a\"\ntext = \"t\"\nquantity = \"torque_utilisation\"\nmax = 1\n";
    let with = |requirement: &str| format!("{BASE}[[requirements]]\n{requirement}");
    Scenario::parse(&with(good), "x.toml").unwrap();
    for (requirement, expected) in [
        (
            good.replace("\"a\"", "\"a b\""),
            "line 17, column 6: requirements[0].id is \"a b\"; allowed: 1 to 64 letters",
        ),
        (
            good.replace("\"t\"", "\" \""),
            "line 18, column 8: requirements[0].text is empty",
        ),
        (
            good.replace("torque_utilisation", "torque_utilization"),
            "did you mean torque_utilisation?",
        ),
        (
            good.replace("max = 1", "maximum = 1"),
            "unknown field `maximum`",
        ),
        (
            good.replace("max = 1", "max = -1"),
            "line 20, column 7: requirements[0].max is -1; allowed: a number >= 0",
        ),
        (
            good.replace("max = 1", "max = nan"),
            "requirements[0].max is NaN",
        ),
        (
            good.replace("max = 1", ""),
            "line 16, column 1: requirements[0] is without a limit; allowed: max, min or both",
        ),
        (
            good.replace("max = 1", "max = 1\nmin = 2"),
            "line 21, column 7: requirements[0].min is 2; allowed: at most max, 1",
        ),
        (
            format!("{good}axis = \"hip\""),
            "there is no axis \"hip\"; allowed: shoulder, elbow, lift, wrist",
        ),
        (
            format!("{good}state = \"fault\""),
            "line 21, column 9: requirements[0].state is fault; allowed: no state",
        ),
        (
            format!(
                "{}axis = \"elbow\"",
                good.replace("torque_utilisation", "faults")
            ),
            "requirements[0].axis is elbow; allowed: no axis: faults is not of an axis",
        ),
        (
            format!(
                "{}axis = \"lift\"",
                good.replace("torque_utilisation", "following_error_mrad")
            ),
            "requirements[0].axis is lift; allowed: an axis that turns; of the lift it is following_error_mm",
        ),
        (
            good.replace("torque_utilisation", "reached_s"),
            "requirements[0] is without a state",
        ),
        (
            format!(
                "{}state = \"estopped\"",
                good.replace("torque_utilisation", "reached_s")
            ),
            "there is no state \"estopped\"; allowed: boot",
        ),
        (
            format!("{good}during = [1, 1]"),
            "line 21, column 10: requirements[0].during is [1.0, 1.0]; allowed: an end after",
        ),
        (
            format!("{good}during = [1, 2, 3]"),
            "an array of 3; it must be an array of 2 numbers",
        ),
        (
            format!("{good}during = [-1, 2]"),
            "requirements[0].during[0] is -1; allowed: a number >= 0",
        ),
        (
            format!("{good}cycle = 3"),
            "line 21, column 9: requirements[0].cycle is 3; allowed: 1 to 2, the number of cycles",
        ),
        (
            format!(
                "{}cycle = 1",
                good.replace("torque_utilisation", "sim_time_s")
            ),
            "requirements[0].cycle is 1; allowed: no window: sim_time_s is of the whole run",
        ),
        (
            format!("{good}[[requirements]]\n{good}"),
            "line 22, column 6: requirements[1].id is a; allowed: a name that no other",
        ),
    ] {
        let message = said_of(&with(&requirement));
        assert!(message.starts_with("scenario x.toml: "), "{message}");
        assert!(
            message.contains(expected),
            "{message}\nshould say {expected}"
        );
    }
    let ends = said_of(&BASE.replace("cycles = 2", "cycles = 2\nends = \"stoped\""));
    assert!(
        ends.contains("line 3") && ends.contains("did you mean stopped?"),
        "{ends}"
    );
}
