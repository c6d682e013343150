//! What refusals say beyond the range of a value: the unit that was meant, the default that is in the way, the rate that would do.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/scenario.rs"]
mod scenario;

use scenario::{BASE, said_of};
use sim::scenario::{Change, Scenario, built_in};

#[test]
fn the_unit_that_was_meant_is_named() {
    for (step, hint) in [
        (
            "line = { to = [0.6, 0.1, -0.2, 0.0], tool_speed = 250 }",
            "speeds are in m/s: 250 mm/s is 0.25",
        ),
        (
            "line = { to = [0.6, 0.1, -0.2, 0.0], speed = 50 }",
            "speeds are shares of 1: 50 % is 0.5",
        ),
        (
            "override = { after = 0.1, to = 20 }",
            "speeds are shares of 1: 20 % is 0.2",
        ),
    ] {
        let said = said_of(&format!("{BASE}[[cycle]]\n{step}\n"));
        assert!(said.contains(hint), "{said}");
    }
}

#[test]
fn a_default_that_is_in_the_way_is_told_as_one() {
    let with = |gains: &str| {
        let text = BASE.replace("computed-torque:observer", "pid");
        said_of(&format!("{text}[gains]\n{gains}\n"))
    };
    let said = with("bandwidth = 5.0");
    assert!(
        said.contains("it is the default: give one as well"),
        "{said}"
    );
    let said = with("bandwidth = 5.0\nobserver = 100.0");
    assert!(
        said.contains("gains.observer") && !said.contains("default"),
        "{said}"
    );
}

/// The bus is the oracle: at the rate that is named it carries everything, and at one more it does not.
#[test]
fn the_greatest_rate_is_named() {
    let at = |rate: u32| BASE.replace("rate_hz = 1000", &format!("rate_hz = {rate}"));
    let said = said_of(&at(4000));
    let (_, most) = said.split_once("lower the rate, to ").unwrap();
    let most: u32 = most.split_once(" Hz").unwrap().0.parse().unwrap();
    let rig = |rate| {
        let scenario = Scenario::parse(&at(rate), "x.toml").unwrap();
        sim::setup::RunConfig::new(scenario).rig().is_ok()
    };
    assert!(rig(most) && !rig(most + 1), "{said}");
}

#[test]
fn a_start_just_outside_is_told_with_enough_digits() {
    // The lift is at 0 for z = 0.0487 - 0.2, say: found by what is said of one that is far outside.
    let start = |z: f64| {
        BASE.replace(
            "-0.2, 0.0]\n\n[payload]",
            &format!("{z}, 0.0]\n\n[payload]"),
        )
    };
    let said = said_of(&start(0.5));
    let highest = said.split_once(", which is z from ").unwrap().1;
    let highest = highest.split_once(" to ").unwrap().1;
    let highest: f64 = highest.split_once(" m").unwrap().0.parse().unwrap();
    let said = said_of(&start(highest + 1.2e-7));
    assert!(said.contains("-0.00000012"), "{said}");
}

#[test]
fn a_change_of_another_step_names_the_one_that_is_there() {
    let change: Change = "cycle[0].line.speed=0.5".parse().unwrap();
    let error = Scenario::parse_with(built_in("gate").unwrap(), "gate", &[change]).unwrap_err();
    let said = error.to_string();
    assert!(said.contains("cycle[0] is no line, but a jump"), "{said}");
}
