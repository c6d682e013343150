//! Metrics of motions whose times and errors are worked out by hand.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::f64::consts::PI;

use protocol::messages::Mode;
use sim::metrics::Metrics;
use sim::model::RobotModel;
use sim::observer::{PlantState, Truth};
use sim::plant::Plant;
use sim::world::Mind;

const TARGET: [f64; 4] = [0.5, 0.1, -0.2, 0.3];

fn metrics() -> Metrics {
    Metrics::new(&RobotModel::irb_930_22_105())
}

/// A sample: the tool at `tool`, and a reference that turns the wrist, or rests.
fn sample(t: f64, tool: [f64; 4], moving: bool) -> Truth {
    Truth {
        plant: PlantState {
            t,
            q: [0.0; 4],
            qd: [0.0; 4],
            tau: [0.0; 4],
            tool,
            at_limit: [false; 4],
        },
        mind: Mind {
            q: [0.0; 4],
            qd: [0.0, 0.0, 0.0, f64::from(u8::from(moving))],
            mode: Mode::Enabled,
            under_way: None,
            sample: Some(t as u32),
        },
    }
}

fn turned(by: f64) -> [f64; 4] {
    let [x, y, z, yaw] = TARGET;
    [x, y, z, yaw + by]
}

/// One cycle to [`TARGET`]: offsets in yaw of samples 0, 1, 2, ... s, of which the reference moves in `moving`.
fn cycle(offsets: &[f64], moving: std::ops::Range<usize>) -> Metrics {
    let mut metrics = metrics();
    metrics.begin_cycle(Some(TARGET));
    for (index, offset) in offsets.iter().enumerate() {
        metrics.sample(&sample(
            index as f64,
            turned(*offset),
            moving.contains(&index),
        ));
    }
    metrics.end_cycle();
    metrics
}

#[test]
fn a_turn_on_the_spot_takes_its_time() {
    // At rest at 0 s, moving at 1 to 3 s, within 10 mrad from 4 s on, within 0.1 mrad from 6 s on.
    let metrics = cycle(&[1.0, 0.9, 0.5, 0.02, 0.009, 2e-4, 9e-5, -5e-5], 1..4);
    let result = metrics.cycles[0];
    assert!(result.moved);
    assert_eq!(result.cycle_time_s, Some(4.0));
    assert_eq!(result.commanded_s, 4.0);
    assert_eq!(result.settle_time_s, Some(2.0));
    assert_eq!(result.final_error_mm, Some(0.0));
    let yaw = result.final_error_mrad.unwrap();
    assert!((yaw - 0.05).abs() < 1e-9, "{yaw}");
    assert_eq!(metrics.cycle_time_s().unwrap().mean, 4.0);
}

#[test]
fn a_tool_that_is_turned_away_has_not_arrived() {
    let metrics = cycle(&[1.0, 0.5, 0.011, 0.011], 1..2);
    assert_eq!(metrics.cycles[0].cycle_time_s, None);
    assert_eq!(metrics.cycle_time_s(), None);
}

#[test]
fn yaw_is_compared_the_shorter_way_round() {
    let mut metrics = metrics();
    metrics.begin_cycle(Some([0.5, 0.1, -0.2, PI]));
    metrics.sample(&sample(0.0, [0.5, 0.1, -0.2, 0.001 - PI], false));
    metrics.end_cycle();
    let yaw = metrics.final_error_mrad().unwrap();
    assert!((yaw - 1.0).abs() < 1e-9, "{yaw}");
}

#[test]
fn a_move_within_the_radius_ends_with_its_reference() {
    let metrics = cycle(&[0.005, 0.004, 0.002, 0.0, 0.0], 1..3);
    assert_eq!(metrics.cycles[0].cycle_time_s, Some(3.0));
}

#[test]
fn a_cycle_that_does_nothing_has_no_time_and_spoils_none() {
    let mut metrics = cycle(&[1.0, 0.5, 0.0, 0.0], 1..2);
    metrics.begin_cycle(Some(TARGET));
    metrics.sample(&sample(9.0, TARGET, false));
    metrics.end_cycle();
    assert_eq!((metrics.cycles.len(), metrics.still()), (2, 1));
    let still = metrics.cycles[1];
    assert_eq!((still.start_s, still.moved), (9.0, false));
    assert_eq!((still.cycle_time_s, still.settle_time_s), (None, None));
    assert_eq!(metrics.cycle_time_s().unwrap().min, 2.0);
    assert_eq!(metrics.settle_time_s().unwrap().max, 0.0);
}

#[test]
fn a_cycle_without_a_target_has_no_final_error() {
    let mut metrics = metrics();
    metrics.begin_cycle(None);
    metrics.sample(&sample(0.0, TARGET, false));
    metrics.sample(&sample(1.0, TARGET, true));
    metrics.end_cycle();
    assert_eq!(metrics.cycles[0].cycle_time_s, None);
    assert_eq!(
        (metrics.final_error_mm(), metrics.final_error_mrad()),
        (None, None)
    );
}

#[test]
fn the_longest_time_at_the_limit_is_kept_by_axis() {
    let mut metrics = metrics();
    metrics.begin_cycle(Some(TARGET));
    for (t, elbow) in [true, true, false, true, true, true, false]
        .into_iter()
        .enumerate()
    {
        let mut truth = sample(t as f64, TARGET, false);
        truth.plant.at_limit = [false, elbow, t == 0, false];
        metrics.sample(&truth);
    }
    assert_eq!(metrics.longest_saturation, [0, 3, 1, 0]);
}

/// A controller computes in single precision: its limit may be a rounding above or below the true one.
#[test]
fn a_request_of_the_limit_in_single_precision_is_at_the_limit() {
    let mut model = RobotModel::irb_930_22_105();
    for limit in [3.42, 8.0, 0.1, 1.0 / 3.0] {
        model.drive.motor_torque_limit = [limit; 4];
        let mut plant = Plant::new(&model, [0.0, 1.0, 0.05, 0.0]);
        let request = f64::from(limit as f32);
        plant.set_motor_torque([request, -request, 0.999 * request, 0.0]);
        assert_eq!(plant.at_limit(), [false; 4], "no torque, no limit");
        plant.set_torque_enabled(true);
        assert_eq!(plant.at_limit(), [true, true, false, false], "{limit}");
    }
    // Beyond its speed limit a motor gives no driving torque, which is its limit; it can still brake.
    plant_beyond_its_speed(&model, 0.1, true);
    plant_beyond_its_speed(&model, -0.1, false);
}

fn plant_beyond_its_speed(model: &RobotModel, request: f64, limited: bool) {
    let mut plant = Plant::new(model, [0.0, 1.0, 0.05, 0.0]);
    plant.set_torque_enabled(true);
    let speed = model.drive.motor_speed_limit[0] * 1.06 / model.drive.gear_ratio[0];
    plant.set_speed([speed, 0.0, 0.0, 0.0]);
    plant.set_motor_torque([request, 0.0, 0.0, 0.0]);
    assert_eq!(plant.at_limit()[0], limited);
}

/// Half a millimetre off in every sample but the one that has no reference.
#[test]
fn a_sample_that_is_not_answered_has_no_error() {
    let home = Plant::new(&RobotModel::irb_930_22_105(), [0.0; 4]).pose();
    let tool = |off: f64| [home.x, home.y, home.z + off, home.yaw];
    let mut metrics = metrics();
    metrics.begin_cycle(None);
    for (index, off) in [5e-4, 5e-4, 0.1, 5e-4].into_iter().enumerate() {
        let mut truth = sample(index as f64, tool(off), true);
        if index == 2 {
            truth.mind.sample = None;
        }
        metrics.sample(&truth);
    }
    let error = metrics.tracking_error_mm();
    assert!((error.max - 0.5).abs() < 1e-9, "{error:?}");
    assert!((error.rms - 0.5).abs() < 1e-9, "{error:?}");
}
