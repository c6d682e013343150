//! Zones in closed loop: the true tool beside corners written down here.

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
use sim::summary::Summary;

#[derive(Default)]
struct Truths(Vec<[f64; 4]>);

impl Observer for Truths {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.0.push(truth.plant.tool);
        Ok(())
    }
}

/// Up, across and down.
const CORNERS: &str = r#"
    name = "corners"
    cycles = 1
    rate_hz = 2000
    law = "computed-torque:observer"
    start = [0.5, -0.15, -0.35, 0.0]
    [[cycle]]
    line = { to = [0.5, -0.15, -0.15, 0.0], zone = 0.03 }
    [[cycle]]
    line = { to = [0.5, 0.25, -0.15, 0.0], zone = 0.03 }
    [[cycle]]
    joints = { to = [0.6, 1.2, 0.25, 0.0] }
"#;

/// Tool of every sample, and the summary.
fn run(text: &str) -> (Vec<[f64; 4]>, Summary) {
    let scenario = Scenario::parse(text, "test").unwrap();
    let mut truths = Truths::default();
    let summary = in_process(&RunConfig::new(scenario), &mut truths).unwrap();
    assert!(summary.completed && summary.faults.is_empty());
    (truths.0, summary)
}

fn away(tool: &[f64; 4], corner: [f64; 3]) -> f64 {
    (tool[0] - corner[0])
        .hypot(tool[1] - corner[1])
        .hypot(tool[2] - corner[2])
}

#[test]
fn the_tool_cuts_corners_within_their_zones_and_saves_time() {
    let (blended, summary) = run(CORNERS);
    let (stopped, longer) = run(&CORNERS.replace("zone = 0.03", "zone = 0.0"));
    let time = |summary: &Summary| summary.cycle_time_s.unwrap().mean;
    let (time, longer) = (time(&summary), time(&longer));
    assert!(time < longer - 0.02, "{time} {longer}");
    assert_eq!(summary.corners.len(), 2);
    let corners = [[0.5, -0.15, -0.15], [0.5, 0.25, -0.15]];
    for (corner, told) in corners.into_iter().zip(&summary.corners) {
        let nearest = |tools: &[[f64; 4]]| {
            let each = tools.iter().map(|tool| away(tool, corner));
            each.fold(f64::MAX, f64::min)
        };
        let (cut, met) = (nearest(&blended), nearest(&stopped));
        assert!(met < 2e-5, "{met}");
        assert!(cut > 1e-4 && cut < 0.03, "{cut}");
        let (passed, margin) = (told.passed_mm.unwrap(), told.margin_mm.unwrap());
        assert!((passed - 1e3 * cut).abs() < 1e-9, "{passed} {cut}");
        assert!((passed + margin - 30.0).abs() < 1e-9, "{told:?}");
    }
    // Until the last move it is on one of the lines, or within the zone of a corner.
    for tool in &blended {
        let [x, y, z, _] = *tool;
        let up = (x - 0.5).hypot(y + 0.15);
        let across = (x - 0.5).hypot(z + 0.15);
        let near = corners.map(|corner| away(tool, corner));
        let on_a_way = up.min(across) < 5e-5 || near[0].min(near[1]) < 0.03;
        assert!(on_a_way || away(tool, corners[0]) > 0.37, "{tool:?}");
    }
}

#[test]
fn a_zone_needs_a_move_after_it() {
    let refused = |text: &str| Scenario::parse(text, "test").unwrap_err().to_string();
    let last = CORNERS.replace("0.25, 0.0] }", "0.25, 0.0], zone = 0.01 }");
    assert!(
        refused(&last).contains("cycle[2].joints.zone"),
        "{}",
        refused(&last)
    );
    let waits = CORNERS.replacen(
        "    [[cycle]]\n    joints",
        "    [[cycle]]\n    dwell = 0.1\n    [[cycle]]\n    joints",
        1,
    );
    assert!(
        refused(&waits).contains("cycle[1].line.zone"),
        "{}",
        refused(&waits)
    );
    let far = CORNERS.replacen("zone = 0.03", "zone = 20", 1);
    assert!(refused(&far).contains("at most 1 m"), "{}", refused(&far));
}
