//! The summary of a run compared with its truth and its configuration.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use sim::model::RobotModel;
use sim::observer::{Observer, Truth};
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;

const HEAD: &str = r#"
name = "short"
cycles = 1
rate_hz = 1000
law = "computed-torque:observer"
start = [0.5, 0.1, -0.2, 0.0]
"#;

/// A scenario that starts at x 0.5, y 0.1, z -0.2, yaw 0.
fn scenario(rest: &str) -> Scenario {
    Scenario::parse(&format!("{HEAD}{rest}"), "test").unwrap()
}

fn run(scenario: Scenario) -> Summary {
    in_process(&RunConfig::new(scenario), &mut ()).unwrap()
}

/// Longest time for which each joint had this share of its peak effort, samples.
struct Effort {
    limit: [f64; 4],
    now: [u64; 4],
    longest: [u64; 4],
}

impl Observer for Effort {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        for axis in 0..4 {
            let at_limit = truth.plant.tau[axis].abs() > 0.999_99 * self.limit[axis];
            self.now[axis] = if at_limit { self.now[axis] + 1 } else { 0 };
            self.longest[axis] = self.longest[axis].max(self.now[axis]);
        }
        Ok(())
    }
}

#[test]
fn a_motor_at_its_limit_is_seen_as_long_as_it_is_there() {
    let mut scenario = scenario(
        "[payload]\nmass = 2.0\ncom_flange_frame = [0.0, 0.0, 0.05]\ninertia_com_diag = [0.008, 0.008, 0.01]\n\
         [mismatch]\nfriction = 6\npayload = 6\n\
         [[cycle]]\nline = { to = [0.6, 0.1, -0.2, 0.0] }\n",
    );
    scenario.rate_hz = 1000.0;
    let mut effort = Effort {
        limit: RobotModel::irb_930_22_105().limits.effort,
        now: [0; 4],
        longest: [0; 4],
    };
    let summary = in_process(&RunConfig::new(scenario), &mut effort).unwrap();
    assert!(effort.longest[1] > 10, "the elbow is overloaded");
    assert_eq!(
        summary.longest_saturation_s,
        effort.longest.map(|samples| samples as f64 / 1000.0)
    );
    // It arrives all the same, at another pace.
    assert_eq!((summary.cycles, summary.cycles_asked), (1, 1));
    assert!(summary.pace < 0.9, "{}", summary.pace);
}

/// The wrist turns by 3 rad no faster than its limit of speed (29.7 rad/s) and its torque allow: 30 N m, and 0.0204 kg m2 of shaft
/// and rotors, which is less than it has to turn.
#[test]
fn a_turn_on_the_spot_takes_the_time_that_the_wrist_needs() {
    let summary = run(scenario(
        "[[cycle]]\nline = { to = [0.5, 0.1, -0.2, 3.0] }\n[[cycle]]\ndwell = 0.1\n",
    ));
    let fastest = 3.0 / 29.670597283903604 + 29.670597283903604 * 0.0204 / 30.0;
    let time = summary.cycle_time_s.unwrap().mean;
    let [cycle] = summary.each_cycle[..] else {
        panic!("one cycle")
    };
    assert!(time > fastest && time < cycle.commanded_s + 0.02, "{time}");
    let yaw = summary.tracking_error_mrad;
    assert!(yaw.max > yaw.rms && yaw.rms > 0.0, "{yaw:?}");
    assert!(summary.final_error_mrad.max.unwrap() < 0.1);
    assert!(summary.final_error_mm.max.unwrap() < 0.01);
}

#[test]
fn cycles_that_do_nothing_are_counted_and_have_no_times() {
    let mut scenario =
        scenario("[[cycle]]\nline = { to = [0.6, 0.1, -0.2, 0.0] }\n[[cycle]]\ndwell = 0.1\n");
    scenario.cycles = 3;
    let summary = run(scenario);
    assert_eq!((summary.cycles, summary.cycles_still), (3, 2));
    let time = summary.cycle_time_s.unwrap();
    assert!(time.min > 0.05 && time.min == time.max, "{time:?}");

    let nothing = run(self::scenario("[[cycle]]\ndwell = 0.1\n"));
    assert_eq!((nothing.cycles, nothing.cycles_still), (1, 1));
    assert_eq!((nothing.cycle_time_s, nothing.settle_time_s), (None, None));
}

#[test]
fn a_stop_on_the_path_leaves_nothing_to_arrive_at() {
    let summary = run(scenario(
        "[[cycle]]\nline = { to = [0.7, 0.1, -0.2, 0.0] }\n[[cycle]]\nstop = 0.05\n[[cycle]]\ndwell = 0.1\n",
    ));
    assert_eq!((summary.cycles, summary.cycles_still), (1, 0));
    assert_eq!(summary.cycle_time_s, None);
    assert_eq!(summary.final_error_mm.max, None);
    assert!(summary.each_cycle[0].commanded_s > 0.05);
}
