//! What judges, draws and watches the frames of a log, and the controller that is to repeat its commands.

use firmware::mechanics::arm::ArmModel;
use plant_sim::check::Checker;
use plant_sim::monitor::Monitor;
use plant_sim::plot::{Plot, page};
use plant_sim::replay::Replay;
use protocol::time::Period;
use protocol::wire::BitTiming;
use sim::model::RobotModel;
use sim::rig::RigConfig;

use crate::log::records;

/// No log is too strange for any of them.
pub(crate) fn judges(bytes: &[u8]) {
    let model = RobotModel::irb_930_22_105();
    let arm = ArmModel::from(&model);
    let config = RigConfig {
        nominal: arm,
        actual: model,
        period: Period::of_rate(1000.0),
        start: [0.0; 4],
        timing: BitTiming::default(),
    };
    let mut checker = Checker::new(&arm);
    let mut replay = Replay::new(config.controller());
    let mut plot = Plot::new(&arm, "a log");
    let mut monitor = Monitor::new("a log", BitTiming::default());
    // After a difference, what a replay says means nothing.
    let mut differs = false;
    for record in records(bytes) {
        if let Err(offence) = checker.record(&record) {
            assert!(!offence.to_string().is_empty());
        }
        differs = differs || replay.record(&record).is_err();
        plot.record(&record);
        monitor.record(&record);
    }
    let svg = page(&[plot]);
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}
