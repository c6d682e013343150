//! Moves, stops and starts in the whole loop, over places, loads and times; judged by the truth.

#![allow(
    clippy::expect_used,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use sim::observer::{Observer, Truth};
use sim::run::in_process;
use sim::scenario::{Joints, Jump, PayloadSpec, Scenario, Step};
use sim::setup::RunConfig;
use sim::summary::Summary;

/// The least that the true tool was above the chamfer of a gate with these ends.
struct Corners {
    ends: [[f64; 3]; 2],
    top: f64,
    margin: f64,
}

impl Observer for Corners {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let [x, y, z, _] = truth.plant.tool;
        let away = |end: &[f64; 3]| (x - end[0]).hypot(y - end[1]);
        let [a, b] = &self.ends;
        let near = if away(a) < away(b) { a } else { b };
        let chamfer = away(near).min(self.top - near[2]);
        self.margin = self.margin.min(z - near[2] - chamfer);
        Ok(())
    }
}

fn scenario(start: [f64; 4], kg: f64, cycle: Vec<Step>) -> Scenario {
    let mut scenario = Scenario::built_in("gate").expect("it comes with the program");
    scenario.cycles = 1;
    scenario.start = start;
    scenario.payload = Some(PayloadSpec::compact(kg));
    scenario.cycle = cycle;
    scenario
}

fn jump(to: [f64; 4], top: f64) -> Step {
    Step::Jump(Jump {
        to,
        elbow: None,
        turn: None,
        top,
        clearance: 0.0,
        speed: 1.0,
        zone: 0.0,
    })
}

fn joints(to: [f64; 4]) -> Step {
    Step::Joints(Joints {
        to,
        speed: 1.0,
        zone: 0.0,
    })
}

/// Runs without a fault; the error of the tool stays below `limit_mm`, and no motor is at its limit for longer than the
/// few samples in which a stop begins.
fn runs(scenario: Scenario, limit_mm: f64, what: &str) -> Summary {
    let summary = in_process(&RunConfig::new(scenario), &mut ()).expect("a run can begin");
    assert_eq!(summary.error, None, "{what}");
    assert!(summary.faults.is_empty(), "{what}: {:?}", summary.faults);
    let error = summary.tracking_error_mm.max;
    assert!(error < limit_mm, "{what}: {error} mm");
    let saturated = summary.longest_saturation_s;
    assert!(
        saturated.iter().all(|s| *s <= 0.006),
        "{what}: {saturated:?}"
    );
    summary
}

/// Free corners, at three places and strokes: the true tool keeps the chamfer but for its error of some hundredths of a
/// millimetre, and no motor saturates with any load.
#[test]
fn the_true_tool_keeps_the_chamfer() {
    for (from, to) in [
        ([0.494, 0.106], [0.706, -0.106]),
        ([0.70, -0.15], [0.70, 0.15]),
        ([0.45, -0.03], [0.45, 0.05]),
    ] {
        for kg in [0.5, 12.0, 22.0] {
            let (z, top) = (-0.2713, -0.2463);
            let start = [from[0], from[1], z, 0.0];
            let end = [to[0], to[1], z, 0.5];
            let cycle = vec![jump(end, top), jump(start, top), Step::Dwell(0.1)];
            let scenario = scenario(start, kg, cycle);
            let mut corners = Corners {
                ends: [start, end].map(|[x, y, z, _]| [x, y, z]),
                top,
                margin: f64::INFINITY,
            };
            let summary = in_process(&RunConfig::new(scenario), &mut corners).unwrap();
            assert_eq!(summary.error, None, "{kg} kg");
            assert!(corners.margin > -5e-5, "{kg} kg: {} m", corners.margin);
            let saturated = summary.longest_saturation_s;
            assert!(
                saturated.iter().all(|s| *s == 0.0),
                "{kg} kg: {saturated:?}"
            );
        }
    }
}

/// A stop at any time of a long lift, up or down, with any load, stays on the path: the lift brakes with what its load leaves.
#[test]
fn a_stop_on_the_way_up_or_down_stays_on_the_path() {
    let low = [0.494, 0.106, -0.41, 0.0];
    for kg in [0.5, 10.0, 22.0] {
        for after in [0.05, 0.11, 0.2, 0.26, 0.3, 0.32, 0.34, 0.37, 0.4, 0.44] {
            let cycle = vec![jump(low, -0.1214), Step::Stop(after), Step::Dwell(0.2)];
            runs(
                scenario(low, kg, cycle),
                0.1,
                &format!("{kg} kg, {after} s"),
            );
            let to = [0.706, -0.106, -0.41, 1.0];
            let cycle = vec![jump(to, -0.14), Step::Stop(after), Step::Dwell(0.2)];
            runs(
                scenario(low, kg, cycle),
                0.1,
                &format!("{kg} kg, across, {after} s"),
            );
        }
    }
}

/// A robot that stands on a limit, give or take half an encoder count, moves inside.
#[test]
fn a_move_may_start_on_a_limit() {
    for (start, to) in [
        ([0.5, 0.1, -0.1213, 0.0], [0.0, 1.0, 0.1, 0.0]),
        ([0.6, -0.2, -0.4213, 1.0], [0.3, 0.8, 0.0, 0.0]),
    ] {
        let cycle = vec![joints(to), Step::Dwell(0.1)];
        runs(scenario(start, 2.0, cycle), 0.1, &format!("{start:?}"));
    }
}

/// A move that is sent while the arm is stopping begins where it has stopped.
#[test]
fn a_move_may_follow_a_stop_at_once() {
    for after in [0.03, 0.12, 0.2] {
        let cycle = vec![
            joints([1.0, -0.8, 0.25, 1.5]),
            Step::Stop(after),
            joints([0.0, 1.0, 0.1, 0.0]),
            Step::Dwell(0.1),
        ];
        let start = [0.494, 0.106, -0.2713, 0.0];
        let summary = runs(scenario(start, 2.0, cycle), 0.3, &format!("{after} s"));
        assert!(summary.final_error_mm.max.unwrap() < 0.02);
    }
}

/// A jump whose top is as high as its ends is a jump without strokes, whatever rounding makes of the three heights.
#[test]
fn a_jump_may_be_flat() {
    for z in [-0.3, -0.2713, -0.15] {
        let start = [0.6, 0.3, z, 0.0];
        let cycle = vec![
            jump([0.7, 0.1, z, 0.0], z),
            jump(start, z),
            Step::Dwell(0.1),
        ];
        runs(scenario(start, 2.0, cycle), 0.1, &format!("{z}"));
    }
}
