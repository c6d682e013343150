//! Arcs in closed loop: the true tool against circles written down here.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use sim::observer::{Observer, Truth};
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

#[derive(Default)]
struct Truths(Vec<Truth>);

impl Observer for Truths {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.0.push(*truth);
        Ok(())
    }
}

/// From 300 mm in front of the arm a half circle of 100 mm around (0.6, 0), to the left.
const HALF: &str = r#"
    name = "half"
    cycles = 1
    rate_hz = 1000
    law = "computed-torque:observer"
    start = [0.6, -0.1, -0.25, 0.0]
    [[cycle]]
    arc = { via = [0.7, 0.0, -0.25], to = [0.6, 0.1, -0.25, 1.0] }
"#;

/// Tool of every sample: x, y, z, yaw.
fn run(text: &str) -> Vec<[f64; 4]> {
    let scenario = Scenario::parse(text, "test").unwrap();
    let mut truths = Truths::default();
    let summary = in_process(&RunConfig::new(scenario), &mut truths).unwrap();
    assert!(summary.faults.is_empty());
    truths.0.iter().map(|it| it.plant.tool).collect()
}

/// Distance from the circle of radius 0.1 around (0.6, 0) at z = -0.25.
fn aside([x, y, z, _]: &[f64; 4]) -> f64 {
    let across = (x - 0.6).hypot(*y) - 0.1;
    across.hypot(z + 0.25)
}

/// Angle on it from the start on.
fn angle([x, y, _, _]: &[f64; 4]) -> f64 {
    // A start or an end that is missed by a micrometre is not a whole turn away.
    (y.atan2(x - 0.6) + std::f64::consts::FRAC_PI_2).max(-0.1)
}

#[test]
fn the_tool_follows_the_circle_and_turns_evenly() {
    let tool = run(HALF);
    let worst = tool.iter().map(aside).fold(0.0, f64::max);
    assert!(worst < 3e-5, "{worst} m aside");
    for at in &tool {
        let wanted = angle(at) / std::f64::consts::PI;
        assert!((at[3] - wanted).abs() < 1e-3, "{at:?}");
    }
    let last = tool.last().unwrap();
    for (found, wanted) in last.iter().zip([0.6, 0.1, -0.25, 1.0]) {
        assert!((found - wanted).abs() < 1e-5, "{last:?}");
    }
}

/// A stop in mid-arc ends on the circle, at another pace too; the move that follows begins there.
#[test]
fn a_stop_and_another_pace_stay_on_the_circle() {
    let stop = format!("{HALF}\n[[cycle]]\nstop = 0.12\n");
    let pace = format!("{HALF}\n[[cycle]]\noverride = {{ after = 0.08, to = 0.2 }}\n");
    for (text, ends) in [(stop, false), (pace, true)] {
        let tool = run(&text);
        let worst = tool.iter().map(aside).fold(0.0, f64::max);
        assert!(worst < 3e-5, "{worst} m aside");
        let last = angle(tool.last().unwrap());
        assert_eq!(last > 3.1, ends, "{last}");
        assert!(last > 0.2, "{last}");
    }
}

/// 250 mm/s are kept from end to end, but for the ramps.
#[test]
fn the_speed_of_the_tool_is_the_one_asked_for() {
    let slow = HALF.replace("1.0] }", "1.0], tool_speed = 0.25 }");
    let tool = run(&slow);
    let speeds: Vec<f64> = tool
        .windows(11)
        .map(|pair| (angle(&pair[10]) - angle(&pair[0])) * 0.1 / 0.01)
        .collect();
    let even = speeds
        .iter()
        .filter(|it| (*it - 0.25).abs() < 0.002)
        .count();
    let fastest = speeds.iter().copied().fold(0.0, f64::max);
    assert!(fastest < 0.252, "{fastest}");
    // 314 mm take 1.257 s.
    assert!((1200..1257).contains(&even), "{even} ms");
}

/// By name, with what is wrong about which parameter.
#[test]
fn points_on_one_line_are_refused_in_words() {
    let line = HALF.replace("[0.7, 0.0, -0.25]", "[0.6, 0.02, -0.25]");
    let scenario = Scenario::parse(&line, "test").unwrap();
    let summary = in_process(&RunConfig::new(scenario), &mut ()).unwrap();
    let text = summary.error.unwrap();
    assert!(
        text.contains("lie on one line")
            && text.contains("parameter via: ")
            && text.contains(" m, limit 0.0001 m"),
        "{text}"
    );
}
