//! Scenario texts: what is refused before anything runs, with place and allowed values.

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
use sim::scenario::{Scenario, Source};
use sim::setup::RunConfig;

/// The refusal, before a run, of the text with one passage replaced.
fn refusal(from: &str, to: &str) -> String {
    assert_eq!(BASE.matches(from).count(), 1, "{from}");
    said_of(&BASE.replace(from, to))
}

#[test]
fn the_base_is_accepted() {
    let scenario = Scenario::parse(BASE, "x.toml").unwrap();
    RunConfig::new(scenario).rig().unwrap();
}

#[test]
fn what_does_not_fit_the_text_is_refused() {
    for (from, to, expected) in [
        (
            "cycles = 2",
            "cycles = 2\nspeeed = 1",
            "unknown field `speeed`",
        ),
        ("cycles = 2", "cycels = 2", "did you mean cycles?"),
        ("clearance", "clearence", "did you mean clearance?"),
        ("cycles = 2", "cycles = 2\ncycles = 3", "duplicate key"),
        (
            "computed-torque:observer",
            "magic",
            "no control law 'magic'",
        ),
        ("dwell = 0.1", "wait = 0.1", "unknown word `wait`"),
        ("dwell = 0.1", "dwel = 0.1", "did you mean dwell?"),
        (
            "cycles = 2",
            "cycles = -2",
            "a whole number from 0 to 4294967295",
        ),
        (
            "dwell = 0.1",
            "dwell = 0.1\nstop = 0.1",
            "expected one step",
        ),
        ("dwell = 0.1", "", "expected a step"),
        (
            "dwell = 0.1",
            "place = 1",
            "expected {}: a place has no values",
        ),
        (
            "cycles = 2",
            "cycles = 2.5",
            "number `2.5`, expected a whole",
        ),
        ("= 1000", "= \"1 kHz\"", "expected a number"),
        (
            "start = [0.5, 0.1, -0.2, 0.0]",
            "start = 0.5",
            "expected an array",
        ),
        ("cycles = 2", "cycles = 2\ngains = 1", "expected a table"),
        (
            "dwell = 0.1",
            "place = { now = 1 }",
            "expected {}: a place has no values, and this table has now",
        ),
        (
            "[0.5, 0.1, -0.2, 0.0]",
            "[0.5, 0.1, -0.2, 0.0, 9]",
            "an array of 5; it must be an array of 4 numbers",
        ),
        (
            "[0.0, 0.0, 0.05]",
            "[0.0, 0.05]",
            "an array of 2; it must be an array of 3 numbers",
        ),
        (
            "to = [0.6, 0.1, -0.2, 0.0]",
            "to = [0.6, 0.1, -0.2, 0.0, 1.57]",
            "an array of 5; it must be an array of 4 numbers",
        ),
    ] {
        let message = refusal(from, to);
        assert!(message.starts_with("scenario x.toml: "), "{message}");
        assert!(
            message.contains("line ") && message.contains(expected),
            "{message}"
        );
    }
}

#[test]
fn values_out_of_range_are_named_with_place_value_and_range() {
    for (from, to, expected) in [
        (
            "cycles = 2",
            "cycles = 0",
            "line 2, column 10: cycles is 0; allowed: 1 to 1000000",
        ),
        ("cycles = 2", "cycles = 1000000000", "allowed: 1 to 1000000"),
        ("= 1000", "= 1e300", "rate_hz is 1e300; allowed"),
        (
            "= 1000",
            "= 1",
            "line 3, column 11: rate_hz is 1; allowed: 100 to 10000 Hz",
        ),
        (
            "= 1000",
            "= nan",
            "rate_hz is NaN; allowed: 100 to 10000 Hz",
        ),
        (
            "dwell = 0.1",
            "dwell = nan",
            "line 15, column 9: cycle[1].dwell is NaN; allowed: a number >= 0, at most 3600 s",
        ),
        ("dwell = 0.1", "stop = -1", "cycle[1].stop is -1; allowed"),
        (
            "clearance = 0.005 }",
            "clearance = 0.005, speed = 2.0 }",
            "cycle[0].jump.speed is 2; allowed: a number from 0.0001 to 1 of full speed",
        ),
        (
            "clearance = 0.005",
            "clearance = -0.05",
            "line 13, column 63: cycle[0].jump.clearance is -0.05; allowed: a number >= 0, at most 1 m",
        ),
        (
            "clearance = 0.005 }",
            "clearance = 0.005, speed = 1e-9 }",
            "cycle[0].jump.speed is 0.000000001; allowed: a number from 0.0001",
        ),
        // Millimetres and degrees.
        (
            "to = [0.6, 0.1, -0.2, 0.0]",
            "to = [600, 100, -200, 0.0]",
            "line 13, column 16: cycle[0].jump.to[0] is 600; allowed: a number from -10 to 10 m; lengths are in m: 600 mm is 0.6",
        ),
        (
            "to = [0.6, 0.1, -0.2, 0.0]",
            "to = [0.6, 0.1, -0.2, 90.0]",
            "cycle[0].jump.to[3] is 90; allowed: a number from -12.566370614359172 to 12.566370614359172 rad; angles are in rad: 90 degrees is 1.570796",
        ),
        (
            "top = -0.15",
            "top = -150",
            "lengths are in m: -150 mm is -0.15",
        ),
        (
            "[0.5, 0.1, -0.2, 0.0]",
            "[500, 0.1, -0.2, 0.0]",
            "start[0] is 500",
        ),
        // Impossible bodies, and bodies that no request can carry.
        (
            "mass = 2.0",
            "mass = nan",
            "line 8, column 8: payload.mass is NaN; allowed: a number >= 0, at most 100 kg",
        ),
        (
            "mass = 2.0",
            "mass = -2.0",
            "payload.mass is -2; allowed: a number >= 0, at most 100 kg",
        ),
        (
            "mass = 2.0",
            "mass = 1000.0",
            "payload.mass is 1000; allowed: a number >= 0, at most 100 kg",
        ),
        (
            "[0.0, 0.0, 0.05]",
            "[0.0, inf, 0.05]",
            "payload.com_flange_frame[1] is inf; allowed: a number from -1 to 1 m",
        ),
        (
            "[0.0, 0.0, 0.05]",
            "[0.0, 0.0, 50.0]",
            "lengths are in m: 50 mm is 0.05",
        ),
        (
            "[0.008, 0.008, 0.01]",
            "[0.0, 0.0, 1.0]",
            "line 10, column 31: payload.inertia_com_diag[2] is 1; allowed: at most the sum of the other two moments, 0",
        ),
        (
            "[0.008, 0.008, 0.01]",
            "[0.008, 0.008, 1e300]",
            "payload.inertia_com_diag[2] is 1e300",
        ),
        (
            "[[cycle]]\ndwell",
            "[mismatch]\nfriction = -1\n[[cycle]]\ndwell",
            "mismatch.friction is -1; allowed: a number >= 0, at most 10",
        ),
    ] {
        let message = refusal(from, to);
        assert!(message.starts_with("scenario x.toml: "), "{message}");
        assert!(
            message.contains(expected),
            "{message}\nshould say {expected}"
        );
    }
}

#[test]
fn what_this_robot_cannot_do_is_refused_before_the_run() {
    for (from, to, expected) in [
        (
            "mass = 2.0",
            "mass = 23.0",
            "payload.mass is 23; allowed: a number >= 0, at most 22 kg",
        ),
        (
            "[payload]",
            "[gains]\nbandwidth = 2000\ndamping = 1\nobserver = 100\n[payload]",
            "line 8, column 13: gains.bandwidth is 2000; allowed: 1 to 250 at 1000 Hz",
        ),
        (
            "[payload]",
            "[gains]\nbandwidth = 100\ndamping = nan\nobserver = 100\n[payload]",
            "gains.damping is NaN; allowed: 0.1 to 5 at 1000 Hz",
        ),
        (
            "mass = 2.0",
            "mass = 0.0",
            "payload.inertia_com_diag is [0.008, 0.008, 0.01]; allowed: zeros, since it weighs nothing",
        ),
        // The gripper already holds the payload of the start.
        (
            "dwell = 0.1",
            "pick = { mass = 5, com_flange_frame = [0, 0, 0], inertia_com_diag = [0, 0, 0] }",
            "cycle[1].pick is a payload of 5 kg; allowed: an empty gripper; it holds 2 kg",
        ),
        // The second cycle begins with an empty gripper.
        (
            "dwell = 0.1",
            "place = {}",
            "cycle[1].place is nothing; allowed: a gripper that holds something",
        ),
    ] {
        let message = refusal(from, to);
        assert!(
            message.contains(expected),
            "{message}\nshould say {expected}"
        );
    }
}

/// The gripper begins a cycle with whatever the previous one left in it.
#[test]
fn a_hand_is_followed_from_cycle_to_cycle() {
    let empty = BASE
        .replace("mass = 2.0", "mass = 0.0")
        .replace("[0.008, 0.008, 0.01]", "[0, 0, 0]");
    let pick = "pick = { mass = 5, com_flange_frame = [0, 0, 0], inertia_com_diag = [0, 0, 0] }";
    let never_placed = empty.replace("dwell = 0.1", pick);
    assert!(said_of(&never_placed).contains("it holds 5 kg"));
    let once = never_placed.replace("cycles = 2", "cycles = 1");
    assert!(
        RunConfig::new(Scenario::parse(&once, "x").unwrap())
            .rig()
            .is_ok()
    );
    let placed = empty.replace("dwell = 0.1", &format!("{pick}\n[[cycle]]\nplace = {{}}"));
    assert!(
        RunConfig::new(Scenario::parse(&placed, "x").unwrap())
            .rig()
            .is_ok()
    );
}

#[test]
fn a_scenario_written_out_reads_back_as_it_is() {
    let every_step = format!(
        "{BASE}[gains]\nbandwidth = 100.1\ndamping = 0.7\nobserver = 1e1\n[mismatch]\nfriction = 1.25\n\
         [[cycle]]\nline = {{ to = [0.1, 0.3333333333333333, -1e-17, 5e-324], speed = 0.25 }}\n\
         [[cycle]]\njoints = {{ to = [0.0, 1.0, 0.1, -3.5] }}\n\
         [[cycle]]\nstop = 0.25\n[[cycle]]\nestop = 0.25\n[[cycle]]\nplace = {{}}\n\
         [[cycle]]\npick = {{ mass = 1, com_flange_frame = [0, 0, 0], inertia_com_diag = [0, 0, 0] }}\n\
         [[requirements]]\nid = \"a\"\ntext = \"t\"\nquantity = \"reached_s\"\nstate = \"quick-stop\"\nmax = 1\nmin = 0.1\n\
         during = [0, 0.1]\ncycle = 2\n\
         [[requirements]]\nid = \"b\"\ntext = \"t\"\nquantity = \"speed_utilisation\"\naxis = \"wrist\"\nmax = 1\n"
    );
    let every_step = format!("about = \"all\"\nends = \"stopped\"\n{every_step}");
    for text in [BASE, &every_step] {
        let mut scenario = Scenario::parse(text, "x.toml").unwrap();
        let written = scenario.to_toml();
        let mut again = Scenario::parse(&written, "x.toml").unwrap();
        for scenario in [&mut scenario, &mut again] {
            scenario.source = Source::default();
        }
        assert_eq!(format!("{scenario:?}"), format!("{again:?}"), "{written}");
    }
}

#[test]
fn every_wrong_value_is_named() {
    let text = BASE
        .replace("cycles = 2", "cycles = 0")
        .replace("mass = 2.0", "mass = -2.0")
        .replace("dwell = 0.1", "dwell = -1");
    let message = said_of(&text);
    let lines: Vec<&str> = message.lines().collect();
    assert_eq!(lines.len(), 3, "{message}");
    for (line, words) in
        lines
            .iter()
            .zip(["cycles is 0", "payload.mass is -2", "cycle[1].dwell is -1"])
    {
        assert!(
            line.starts_with("scenario x.toml: line ") && line.contains(words),
            "{line}"
        );
    }

    // What needs the robot: the payload, the start and the rate.
    let text = BASE
        .replace("mass = 2.0", "mass = 23.0")
        .replace("[0.5, 0.1, -0.2, 0.0]", "[2.5, 0.1, -0.2, 0.0]")
        .replace("= 1000", "= 5000");
    let message = said_of(&text);
    assert_eq!(message.lines().count(), 3, "{message}");
    for words in ["payload.mass is 23", "at 5000 Hz", "start pose x 2.5"] {
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_start_is_taken_at_the_side_and_in_the_turn_asked_for() {
    let start = |lines: &str| {
        let text = BASE.replace("start = [0.5, 0.1, -0.2, 0.0]", lines);
        RunConfig::new(Scenario::parse(&text, "x.toml").unwrap()).rig()
    };
    let at = |lines: &str| start(lines).unwrap().start;
    let usual = at("start = [0.5, 0.1, -0.2, 1.3]");
    assert!(usual[1] > 0.0);
    let positive = "start = [0.5, 0.1, -0.2, 1.3]\nstart_elbow = \"positive\"\nstart_turn = 0";
    assert_eq!(at(positive), usual);
    let other = at("start = [0.5, 0.1, -0.2, 1.3]\nstart_elbow = \"negative\"");
    assert!((other[1] + usual[1]).abs() < 1e-12);
    for (turn, number) in [("-1", -1.0), ("1", 1.0)] {
        let turned = at(&format!(
            "start = [0.5, 0.1, -0.2, 1.3]\nstart_turn = {turn}"
        ));
        assert!((turned[3] - usual[3] - number * std::f64::consts::TAU).abs() < 1e-12);
        assert_eq!(turned[..3], usual[..3]);
    }

    // Behind the base on one side: only the left arm reaches it.
    let behind = start("start = [-0.6, -0.75, -0.2, 0.0]")
        .unwrap_err()
        .to_string();
    assert!(
        behind.contains("axis shoulder")
            && behind.contains("With start_elbow = \"negative\" the robot reaches it"),
        "{behind}"
    );
    at("start = [-0.6, -0.75, -0.2, 0.0]\nstart_elbow = \"negative\"");
    let turn = start("start = [0.5, 0.1, -0.2, 0.0]\nstart_turn = 2")
        .unwrap_err()
        .to_string();
    assert!(
        turn.contains("axis wrist") && turn.contains("in start_turn = 2"),
        "{turn}"
    );

    for (lines, words) in [
        ("start_turn = 3", "start_turn is 3; allowed: -2 to 2"),
        ("start_turn = 0.5", "expected a whole number"),
        (
            "start_elbow = \"up\"",
            "unknown word `up`, expected `positive` or `negative`",
        ),
    ] {
        let message = refusal("rate_hz = 1000", &format!("rate_hz = 1000\n{lines}"));
        assert!(message.contains(words), "{message}");
    }
}
