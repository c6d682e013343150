//! Requirements judged during a run, compared with the truth of the same run.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use protocol::messages::Mode;
use sim::model::RobotModel;
use sim::observer::{Observer, Truth};
use sim::requirements::Verdict;
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;
use sim::world::CellEvent;

/// Every sample with the cycle that it is of, counted from 1, if any.
#[derive(Default)]
struct Record {
    truths: Vec<(Option<u32>, Truth)>,
    cycle: Option<u32>,
    begun: u32,
}

impl Observer for Record {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.truths.push((self.cycle, *truth));
        Ok(())
    }

    fn cell_event(&mut self, event: &CellEvent) {
        match event {
            CellEvent::BeginCycle => {
                self.begun += 1;
                self.cycle = Some(self.begun);
            }
            CellEvent::EndCycle => self.cycle = None,
            CellEvent::Attach(_) | CellEvent::Release => {}
        }
    }
}

impl Record {
    /// The greatest value of the samples in cycles, and its time.
    fn worst(
        &self,
        within: impl Fn(Option<u32>, f64) -> bool,
        value: impl Fn(&Truth) -> f64,
    ) -> (f64, f64) {
        let mut worst = (f64::NEG_INFINITY, 0.0);
        for (cycle, truth) in &self.truths {
            let t = truth.plant.t;
            if cycle.is_some() && within(*cycle, t) && value(truth) > worst.0 {
                worst = (value(truth), t);
            }
        }
        worst
    }
}

/// The gate with a wrong model, so that nothing is zero, and these requirements: `id`, and the rest as in a file.
fn run(requirements: &[(&str, &str)], change: impl FnOnce(&mut Scenario)) -> (Summary, Record) {
    let text = include_str!("../../scenarios/gate-mismatch.toml");
    let (mut text, _) = text.split_once("[[requirements]]").unwrap_or((text, ""));
    let mut all = text.to_owned();
    text = "what it is called does not matter";
    for (id, rest) in requirements {
        all += &format!("[[requirements]]\nid = \"{id}\"\ntext = \"{text}\"\n{rest}\n");
    }
    let mut scenario = Scenario::parse(&all, "test").unwrap();
    scenario.cycles = 2;
    change(&mut scenario);
    let mut record = Record::default();
    let summary = in_process(&RunConfig::new(scenario), &mut record).unwrap();
    (summary, record)
}

fn of<'a>(summary: &'a Summary, id: &str) -> &'a Verdict {
    let all = &summary.requirements;
    all.iter()
        .find(|verdict| verdict.requirement.id == id)
        .unwrap()
}

fn value(summary: &Summary, id: &str) -> f64 {
    of(summary, id).value.unwrap()
}

#[test]
fn quantities_of_the_summary_have_its_values() {
    let quantities = [
        "tracking_error_mm",
        "tracking_error_mrad",
        "final_error_mm",
        "final_error_mrad",
        "cycle_time_s",
        "settle_time_s",
        "torque_utilisation",
        "thermal_utilisation",
        "speed_utilisation",
        "longest_saturation_s",
        "bus_load",
        "overruns",
        "faults",
        "frames_lost",
        "sim_time_s",
    ];
    let rest: Vec<String> = quantities
        .iter()
        .map(|name| format!("quantity = \"{name}\"\nmax = 1000"))
        .collect();
    let requirements: Vec<(&str, &str)> = quantities
        .iter()
        .copied()
        .zip(rest.iter().map(String::as_str))
        .collect();
    let (summary, _) = run(&requirements, |_| {});
    assert!(summary.passed, "{:?}", summary.requirements);
    let greatest = |values: [f64; 4]| values.into_iter().fold(0.0, f64::max);
    for (id, expected) in [
        ("tracking_error_mm", summary.tracking_error_mm.max),
        ("tracking_error_mrad", summary.tracking_error_mrad.max),
        ("final_error_mm", summary.final_error_mm.max.unwrap()),
        ("final_error_mrad", summary.final_error_mrad.max.unwrap()),
        ("cycle_time_s", summary.cycle_time_s.unwrap().max),
        ("settle_time_s", summary.settle_time_s.unwrap().max),
        (
            "longest_saturation_s",
            greatest(summary.longest_saturation_s),
        ),
        ("torque_utilisation", greatest(summary.torque_utilisation)),
        ("speed_utilisation", greatest(summary.speed_utilisation)),
        ("overruns", summary.overruns as f64),
        ("faults", 0.0),
        ("frames_lost", summary.frames_lost as f64),
        ("sim_time_s", summary.sim_time_s),
    ] {
        assert_eq!(of(&summary, id).margin, Some(1000.0 - expected), "{id}");
        // Of values with the same margin it is the first.
        let apart = value(&summary, id) - expected;
        assert!(apart.abs() < 1e-12, "{id}: {apart}");
    }
    // Squares are summed in another order; a frame counts where it ends.
    let thermal = greatest(summary.thermal_utilisation);
    let found = value(&summary, "thermal_utilisation");
    assert!((found / thermal - 1.0).abs() < 1e-12, "{found} {thermal}");
    let load = value(&summary, "bus_load");
    assert!((load - summary.bus_load).abs() < 1e-3, "{load}");
}

#[test]
fn signals_are_judged_at_the_worst_instant_of_their_window() {
    let limits = RobotModel::irb_930_22_105().limits;
    let (summary, record) = run(
        &[
            (
                "following",
                "quantity = \"following_error_mrad\"\nmax = 0.001",
            ),
            (
                "elbow",
                "quantity = \"following_error_mrad\"\naxis = \"elbow\"\nmax = 0.001\ncycle = 2",
            ),
            (
                "lift",
                "quantity = \"following_error_mm\"\nmax = 0.001\nduring = [0.5, 0.7]",
            ),
            (
                "torque",
                "quantity = \"torque_utilisation\"\naxis = \"wrist\"\nmax = 1\ncycle = 1",
            ),
            (
                "speed",
                "quantity = \"speed_utilisation\"\nmin = 0.5\nmax = 2\naxis = \"shoulder\"",
            ),
        ],
        |_| {},
    );
    let error =
        |axis: usize| move |truth: &Truth| (truth.mind.q[axis] - truth.plant.q[axis]).abs() * 1e3;
    let check = |id: &str, (expected, time): (f64, f64)| {
        let verdict = of(&summary, id);
        assert_eq!(
            (verdict.value, verdict.time_s),
            (Some(expected), Some(time)),
            "{id}"
        );
    };
    let always = |_: Option<u32>, _: f64| true;
    let turning = |truth: &Truth| {
        [0, 1, 3]
            .map(|axis| error(axis)(truth))
            .into_iter()
            .fold(0.0, f64::max)
    };
    check("following", record.worst(always, turning));
    check("elbow", record.worst(|cycle, _| cycle == Some(2), error(1)));
    check(
        "lift",
        record.worst(|_, t| (0.5..=0.7).contains(&t), error(2)),
    );
    check(
        "torque",
        record.worst(
            |cycle, _| cycle == Some(1),
            |truth| truth.plant.tau[3].abs() / limits.effort[3],
        ),
    );
    assert!(!of(&summary, "elbow").met && !of(&summary, "lift").met && of(&summary, "torque").met);
    // An arm that rests is slower than it should be.
    let speed = of(&summary, "speed");
    assert!(!speed.met && speed.margin.unwrap() < -0.4, "{speed:?}");
    assert!(!summary.passed && summary.completed);
}

#[test]
fn states_and_stops_are_found_where_the_truth_has_them() {
    let (summary, record) = run(
        &[
            (
                "fault",
                "quantity = \"reached_s\"\nstate = \"fault\"\nmax = 10",
            ),
            (
                "never",
                "quantity = \"reached_s\"\nstate = \"estop\"\nmax = 10",
            ),
            (
                "early",
                "quantity = \"reached_s\"\nstate = \"fault\"\nmin = 0.1",
            ),
            ("way", "quantity = \"stop_distance_mm\"\nmax = 1e6"),
            ("time", "quantity = \"stop_time_s\"\nmax = 10"),
            ("count", "quantity = \"faults\"\nmin = 1\nmax = 1"),
            (
                "before",
                "quantity = \"faults\"\nmax = 0\nduring = [0, 0.39]",
            ),
        ],
        |scenario| scenario.faults = vec!["motor:elbow:dead@0.4s".parse().unwrap()],
    );
    assert!(!summary.completed && summary.stopped && !summary.passed);
    let is_stopping = |truth: &Truth| matches!(truth.mind.mode, Mode::FaultReaction | Mode::Fault);
    let stopping: Vec<&Truth> = record
        .truths
        .iter()
        .map(|(_, truth)| truth)
        .filter(|truth| is_stopping(truth))
        .collect();
    let off = stopping
        .iter()
        .find(|truth| truth.mind.mode == Mode::Fault)
        .unwrap();
    assert_eq!(value(&summary, "fault"), off.plant.t);
    assert!(of(&summary, "early").met);
    let never = of(&summary, "never");
    assert_eq!((never.met, never.value, never.time_s), (false, None, None));
    assert_eq!(
        (value(&summary, "count"), value(&summary, "before")),
        (1.0, 0.0)
    );
    assert_eq!(of(&summary, "count").time_s, Some(summary.faults[0].time_s));
    // The way from where the stop begins, as long as anything moves.
    let last = stopping
        .iter()
        .rposition(|truth| truth.plant.qd.iter().any(|qd| qd.abs() >= 1e-3))
        .unwrap();
    let way: f64 = stopping[..=last]
        .windows(2)
        .map(|pair| {
            let [from, to] = [pair[0].plant.tool, pair[1].plant.tool];
            (0..3)
                .map(|axis| (to[axis] - from[axis]).powi(2))
                .sum::<f64>()
                .sqrt()
        })
        .sum();
    assert!(
        (value(&summary, "way") - way * 1e3).abs() < 1e-6 && way > 1e-3,
        "{way}"
    );
    assert_eq!(
        value(&summary, "time"),
        stopping[last].plant.t - stopping[0].plant.t
    );
}

#[test]
fn a_run_passes_if_it_ends_as_the_scenario_says() {
    use sim::scenario::Ending::{Completed, Stopped};
    for (fault, ends, passed) in [
        (None, Completed, true),
        (None, Stopped, false),
        (Some("motor:elbow:dead@0.4s"), Completed, false),
        (Some("motor:elbow:dead@0.4s"), Stopped, true),
        // A controller that is silent has not stopped the arm.
        (Some("controller:silent@0.4s"), Stopped, false),
    ] {
        let (summary, _) = run(&[], |scenario| {
            scenario.cycles = 1;
            scenario
                .faults
                .extend(fault.map(|fault| fault.parse().unwrap()));
            scenario.ends = ends;
        });
        assert_eq!(
            summary.passed, passed,
            "{fault:?} {ends:?}: {:?}",
            summary.error
        );
        assert_eq!(summary.completed, fault.is_none());
    }
}

#[test]
fn a_cycle_that_never_settles_misses_its_time() {
    let (summary, _) = run(
        &[
            ("settling", "quantity = \"settle_time_s\"\nmax = 1000"),
            (
                "second",
                "quantity = \"final_error_mm\"\nmax = 0.0001\ncycle = 2",
            ),
        ],
        |scenario| {
            scenario.law = "pd-gravity".parse().unwrap();
            scenario.mismatch.payload = 1.5;
        },
    );
    assert_eq!(summary.settle_time_s, None);
    let settling = of(&summary, "settling");
    assert!(!settling.met && settling.value.is_none() && settling.time_s.is_some());
    let second = of(&summary, "second");
    assert_eq!(second.value, summary.each_cycle[1].final_error_mm);
}
