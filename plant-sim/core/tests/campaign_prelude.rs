//! A case that begins with what many have in common is the case that runs by itself, to the last bit.

#![allow(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use oorandom::Rand64;
use protocol::frame::CanFrame;
use protocol::time::Instant;
use sim::campaign::prelude::{Prelude, onset};
use sim::campaign::trial;
use sim::controller::InProcess;
use sim::faults::{Fault, KINDS};
use sim::observer::{Observer, Truth};
use sim::scenario::Scenario;
use sim::setup::RunConfig;

/// The frames and the samples of a run.
#[derive(Default)]
struct Record {
    frames: Vec<(Instant, CanFrame)>,
    truths: Vec<Truth>,
}

impl Observer for Record {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.frames.push((time, *frame));
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.truths.push(*truth);
        Ok(())
    }
}

/// Messages of every sample, and of others.
const MESSAGES: [&str; 5] = ["feedback", "command", "state", "motion", "drivesheartbeat"];
const NODES: [&str; 3] = ["drives", "operator", "controller"];

/// Faults of every kind and of all its places, at any time: before the first command, in motion, and after the end of the run.
fn faults(random: &mut Rand64) -> Vec<Fault> {
    let mut faults = Vec::new();
    for kind in KINDS {
        let places = match kind.place {
            "message" => &MESSAGES[..],
            "node" => &NODES[..],
            place => &[place][..],
        };
        for place in places {
            let axis = if kind.has_axis { ":elbow" } else { "" };
            let value = kind.value.map(|value| format!("={}", value.moderate()));
            let value = value.unwrap_or_default();
            let from = random.rand_range(0..1_200_000) as f64 * 1e-6;
            let until = match random.rand_range(0..3) {
                0 => String::new(),
                _ => format!(
                    "..{}s",
                    from + random.rand_range(1_000..100_000) as f64 * 1e-6
                ),
            };
            let text = format!("{place}{axis}:{}{value}@{from}s{until}", kind.name);
            // An operator that starts anew is refused.
            faults.extend(text.parse::<Fault>());
        }
    }
    faults
}

/// The run takes less than a second, and has two jumps.
#[test]
fn a_fault_that_never_begins_shows_nothing() {
    for (faults, never) in [
        (vec![], false),
        (vec!["drives:silent@5s"], true),
        (vec!["drives:silent@jump9"], true),
        (vec!["drives:silent@jump2"], false),
        (vec!["drives:silent@jump9", "drives:silent@jump2"], false),
    ] {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 1;
        scenario.faults = faults.iter().map(|text| text.parse().unwrap()).collect();
        let connect = |config| Ok(InProcess::new(config));
        let (verdict, ..) = trial::run(&RunConfig::new(scenario), connect, &mut ()).unwrap();
        assert_eq!(verdict.never_began, never, "{faults:?}: {verdict:?}");
        assert!(verdict.missed.is_empty(), "{faults:?}: {verdict:?}");
    }
}

#[test]
fn a_case_is_the_same_with_the_prelude_of_others() {
    let mut random = Rand64::new(1);
    let (one, other) = (faults(&mut random), faults(&mut random));
    let mut cases: Vec<RunConfig> = Vec::new();
    for (seed, fault) in one.iter().enumerate() {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 1;
        scenario.seed = seed as u64;
        scenario.faults = vec![fault.clone()];
        if seed % 3 == 0 {
            let place = random.rand_range(0..other.len() as u64) as usize;
            scenario.faults.push(other[place].clone());
        }
        cases.push(RunConfig::new(scenario));
    }
    for text in ["jump1+20ms..+5ms", "while=lift-down", "6s"] {
        let mut late = cases[0].clone();
        late.scenario.faults = vec![format!("feedback:loss@{text}").parse().unwrap()];
        cases.push(late);
    }
    cases.sort_by_key(|case| onset(&case.scenario));

    let mut prelude = Prelude::new(&cases[0]).unwrap();
    let (mut all, mut seen) = (0, 0);
    for case in &cases {
        let faults = &case.scenario.faults;
        let (mut whole, mut end) = (Record::default(), Record::default());
        let connect = |config| Ok(InProcess::new(config));
        let (expected, ..) = trial::run(case, connect, &mut whole).unwrap();
        assert!(prelude.leads_to(&case.scenario));
        let verdict = prelude.judge_watched(case, &mut end).unwrap();
        assert_eq!(verdict, expected, "{faults:?}");
        assert!(whole.frames.ends_with(&end.frames), "{faults:?}");
        assert!(whole.truths.ends_with(&end.truths), "{faults:?}");
        all += whole.truths.len();
        seen += end.truths.len();
    }
    assert!(seen > 0 && seen < all * 2 / 3, "{seen} of {all} samples");
    assert!(!prelude.leads_to(&cases[0].scenario));
}

/// A command that is on its way when a fault begins suffers it.
#[test]
fn a_prelude_stops_a_sample_before_the_fault() {
    let case = |us: u64| {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 1;
        scenario.faults = vec![
            format!("command:corrupt@{}ms", us as f64 / 1e3)
                .parse()
                .unwrap(),
        ];
        RunConfig::new(scenario)
    };
    let mut prelude = Prelude::new(&case(0)).unwrap();
    let later = case(500_000);
    prelude.judge(&later).unwrap();
    for us in [
        500_700, 500_130, 500_000, 499_999, 499_130, 499_000, 498_000,
    ] {
        let fits = prelude.leads_to(&case(us).scenario);
        assert_eq!(fits, us >= 500_000, "{us}");
        if fits {
            let verdict = prelude.judge(&case(us)).unwrap();
            let connect = |config| Ok(InProcess::new(config));
            let (expected, ..) = trial::run(&case(us), connect, &mut ()).unwrap();
            assert_eq!(verdict, expected, "{us}");
        }
    }
}

#[test]
fn a_prelude_leads_to_no_other_scenario() {
    let scenario = Scenario::built_in("gate").unwrap();
    let prelude = Prelude::new(&RunConfig::new(scenario.clone())).unwrap();
    assert!(prelude.leads_to(&scenario));
    let mut other = scenario.clone();
    other.carry(3.0).unwrap();
    assert!(!prelude.leads_to(&other));
}
