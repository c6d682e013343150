//! A rehearsal says what a run will come to; the run is the oracle.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use sim::observer::{Observer, Truth};
use sim::rehearsal::{Refused, rehearse};
use sim::run::in_process;
use sim::scenario::{Change, Scenario};
use sim::setup::RunConfig;
use sim::summary::Summary;

fn scenario(steps: &str) -> RunConfig {
    let text = format!(
        "name = \"t\"\ncycles = 2\nrate_hz = 1000\nlaw = \"computed-torque:observer\"\nstart = [0.5, 0.1, -0.2, 0.0]\n{steps}\n"
    );
    RunConfig::new(Scenario::parse(&text, "t").unwrap())
}

/// What keeps a scenario from running.
fn refused(config: &RunConfig) -> Vec<Refused> {
    rehearse(config).unwrap().refused
}

fn run(config: &RunConfig) -> Summary {
    in_process(config, &mut ()).unwrap()
}

#[test]
fn durations_and_torques_are_those_of_a_run_of_the_robot_that_the_controller_knows() {
    for name in ["gate", "square", "pick-place"] {
        let mut config = RunConfig::new(Scenario::built_in(name).unwrap());
        config.scenario.cycles = 3;
        let plan = rehearse(&config).unwrap();
        let summary = run(&config);
        assert!(summary.completed, "{name}: {:?}", summary.error);
        // Words on the bus take some samples, and the operator waits for each: some twenty of them in a cycle.
        let late = summary.sim_time_s - plan.duration_s;
        assert!((0.0..0.3).contains(&late), "{name}: {late} s longer");
        for axis in 0..4 {
            let (planned, seen) = (
                plan.torque_utilisation[axis],
                summary.torque_utilisation[axis],
            );
            assert!(
                (planned - seen).abs() < 0.05,
                "{name}, {axis}: {planned}, {seen}"
            );
        }
        // One cycle stands for those that follow, and its moves take what the reference took.
        assert!(
            plan.moves.iter().all(|planned| planned.duration_s > 0.05),
            "{name}"
        );
    }
}

#[test]
fn moves_take_as_long_as_their_reference_moves() {
    let config = scenario(
        "[[cycle]]\nline = { to = [0.6, 0.1, -0.2, 0.0] }\n[[cycle]]\ndwell = 0.1\n[[cycle]]\nline = { to = [0.5, 0.1, -0.2, 0.0] }\n[[cycle]]\ndwell = 0.1",
    );
    let plan = rehearse(&config).unwrap();
    let moved: f64 = plan.moves.iter().map(|planned| planned.duration_s).sum();
    // From the first move to the last, the dwell and the planning of the second in between.
    let commanded = run(&config).each_cycle[0].commanded_s;
    let between = commanded - moved;
    assert!((0.1..0.3).contains(&between), "{between}");
    assert_eq!(plan.moves[0].step, "cycle[0].line");
    assert_eq!(plan.moves[1].step, "cycle[2].line");
}

#[test]
fn a_million_cycles_are_planned_once() {
    let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
    let one = rehearse(&config).unwrap();
    config.scenario.cycles = 1_000_000;
    let many = rehearse(&config).unwrap();
    assert_eq!(many.moves, one.moves);
    let cycle = (many.duration_s - one.duration_s) / 999_990.0;
    assert!((one.duration_s / 10.0 - cycle).abs() < 0.1, "{cycle}");
}

#[test]
fn what_a_rehearsal_refuses_a_run_refuses_in_the_same_words() {
    let cases = [
        (
            "[[cycle]]\nline = { to = [5.0, 0.1, -0.2, 0.0] }",
            "cycle[0].line",
            "parameter to",
        ),
        (
            "[[cycle]]\ndwell = 0.1\n[[cycle]]\njoints = { to = [0.5, -1.5, 0.5, 0.0] }",
            "cycle[1].joints",
            "axis lift",
        ),
        (
            "[[cycle]]\njump = { to = [0.6, 0.1, -0.2, 0.0], top = -0.25, clearance = 0.005 }",
            "cycle[0].jump",
            "parameter top",
        ),
        (
            "[[cycle]]\nline = { to = [-0.5, 0.1, -0.2, 0.0] }",
            "cycle[0].line",
            "step 1 of cycle 1",
        ),
    ];
    for (steps, key, word) in cases {
        let config = scenario(steps);
        let all = refused(&config);
        let [only] = all.as_slice() else {
            panic!("{steps}: {all:?}");
        };
        assert_eq!((only.cycle, only.step.as_deref()), (Some(1), Some(key)));
        let error = &only.reason;
        assert!(error.contains(key) && error.contains(word), "{error}");
        // The robot of a run is where it is in other digits.
        let words = |text: &str| text.replace(|c: char| c.is_ascii_digit() || c == '.', "");
        assert_eq!(words(&run(&config).error.unwrap()), words(error));
    }
}

#[test]
fn every_step_that_is_refused_is_named() {
    let config = scenario(
        "[[cycle]]\nline = { to = [5.0, 0.1, -0.2, 0.0] }\n[[cycle]]\njoints = { to = [0.5, 1.5, 0.1, 0.0] }\n\
         [[cycle]]\njoints = { to = [0.5, -1.5, 0.5, 0.0] }\n[[cycle]]\ndwell = 0.1",
    );
    let words: Vec<String> = refused(&config).into_iter().map(|it| it.reason).collect();
    assert_eq!(words.len(), 2, "{words:?}");
    assert!(
        words[0].contains("cycle[0].line") && words[1].contains("cycle[2].joints"),
        "{words:?}"
    );
}

/// Whether a law can follow at a rate is what a run shows: one is the oracle of the other.
#[test]
fn a_rate_too_low_for_law_and_speed_is_foreseen() {
    let mut foreseen = 0;
    for law in ["computed-torque:observer", "pd-gravity", "pid"] {
        for rate_hz in [100.0, 150.0, 250.0, 1000.0] {
            let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
            config.scenario.cycles = 1;
            config.scenario.law = law.parse().unwrap();
            config.scenario.rate_hz = rate_hz;
            let (all, error) = (refused(&config), run(&config).error);
            assert_eq!(all.is_empty(), error.is_none(), "{law} at {rate_hz} Hz");
            if let (Some(first), Some(error)) = (all.first(), error) {
                assert!(first.reason.starts_with(&error), "{}", first.reason);
                foreseen += 1;
            }
        }
    }
    assert!((3..10).contains(&foreseen), "{foreseen}");
    // What breaks in the run is none of its business, and one that is to stop may.
    let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
    config.scenario.faults = vec!["encoder:elbow:stuck@0.4s".parse().unwrap()];
    assert_eq!(refused(&config), []);
    let config = RunConfig::new(Scenario::built_in("estop-descent").unwrap());
    assert_eq!(refused(&config), []);
}

#[test]
fn elbow_and_turn_are_asked_for_in_start_jump_and_line() {
    let config = scenario(
        "start_elbow = \"negative\"\nstart_turn = 1\n\
         [[cycle]]\njump = { to = [0.6, 0.2, -0.2, 0.0], top = -0.15, elbow = \"positive\", turn = -1 }\n\
         [[cycle]]\nline = { to = [0.6, 0.1, -0.2, 0.0], turn = 0 }\n\
         [[cycle]]\njump = { to = [0.5, 0.1, -0.2, 0.0], top = -0.15, elbow = \"negative\", turn = 1 }",
    );
    let start = config.rig().unwrap().start;
    assert!(
        start[1] < 0.0 && (3.2..6.98).contains(&start[3]),
        "{start:?}"
    );
    // The second cycle is as the first.
    assert_eq!(rehearse(&config).unwrap().moves.len(), 3);
    let mut ends = Ends::default();
    let summary = in_process(&config, &mut ends).unwrap();
    assert!(summary.completed, "{:?}", summary.error);
    assert!(
        summary
            .each_cycle
            .iter()
            .all(|cycle| cycle.final_error_mm.unwrap() < 0.05)
    );
    // As the robot stood: both sides and both turns, and back.
    assert!(
        ends.elbow[0] < -0.5 && ends.elbow[1] > 0.5,
        "{:?}",
        ends.elbow
    );
    assert!(
        ends.wrist[0] < -3.2 && ends.wrist[1] > 3.2,
        "{:?}",
        ends.wrist
    );

    for (steps, word) in [
        (
            "[[cycle]]\nline = { to = [0.6, 0.1, -0.2, 0.0], elbow = \"negative\" }",
            "parameter elbow",
        ),
        (
            "[[cycle]]\njump = { to = [0.6, 0.1, -0.2, 0.0], top = -0.15, turn = 2 }",
            "in turn 2 of the wrist",
        ),
        (
            "[[cycle]]\njump = { to = [-0.6, 0.75, -0.2, 0.0], top = -0.15, elbow = \"negative\" }",
            "with elbow negative",
        ),
    ] {
        let reason = &refused(&scenario(steps))[0].reason;
        assert!(reason.contains(word), "{reason}");
    }
}

/// Least and greatest true angle of elbow and wrist.
#[derive(Default)]
struct Ends {
    elbow: [f64; 2],
    wrist: [f64; 2],
}

impl Observer for Ends {
    fn sample(&mut self, truth: &Truth) -> std::io::Result<()> {
        for (range, at) in [
            (&mut self.elbow, truth.plant.q[1]),
            (&mut self.wrist, truth.plant.q[3]),
        ] {
            *range = [range[0].min(at), range[1].max(at)];
        }
        Ok(())
    }
}

/// More moves than the controller's queue holds, and none of them can end: by the state machine of the queue, four are planned
/// and the fifth waits for room.
#[test]
fn a_scenario_that_holds_the_arm_and_waits_for_it_ends_with_what_it_waits_for() {
    let to = |x| format!("[[cycle]]\njoints = {{ to = [{x}, 1.4, 0.1, 0.0] }}\n");
    let hold = "[[cycle]]\noverride = { after = 0.0, to = 0.0 }\n";
    let release = "[[cycle]]\noverride = { after = 0.0, to = 1.0 }\n";
    let moves: String = [0.6, 0.5, 0.6, 0.5].map(to).concat();
    let room = format!("{hold}{moves}{}{release}", to(0.6));
    // After a stop the arm is still held.
    let end = format!("{}{hold}[[cycle]]\nstop = 0.1\n{}", to(0.6), to(0.5))
        + "[[cycle]]\ndwell = 0.1\n"
        + release;
    for (steps, key, what) in [
        (&room, "cycle[5].joints", "no reply to request "),
        (&end, "cycle[4].dwell", "no end of the move "),
    ] {
        let config = scenario(steps);
        let summary = run(&config);
        let error = summary.error.unwrap();
        assert!(summary.sim_time_s < 10.0, "{} s", summary.sim_time_s);
        let all = refused(&config);
        let [only] = all.as_slice() else {
            panic!("{steps}: {all:?}");
        };
        for said in [&error, &only.reason] {
            for words in [key, what, "within 2.0 s", "put an override above 0 before"] {
                assert!(said.contains(words), "{said}");
            }
        }
    }
    // As many as there is room for may wait.
    let config = scenario(&format!(
        "{hold}{moves}[[cycle]]\noverride = {{ after = 3.0, to = 1.0 }}"
    ));
    assert_eq!(refused(&config), []);
    assert_eq!(run(&config).error, None);
}

#[test]
fn a_slow_move_may_take_its_time() {
    let config = scenario(
        "[[cycle]]\njoints = { to = [0.6, 1.5, 0.1, 0.0], speed = 0.002 }\n[[cycle]]\njoints = { to = [0.5, 1.4, 0.1, 0.0] }",
    );
    assert!(rehearse(&config).unwrap().duration_s > 120.0);
}

/// 100 mm at 0.7 mm/s are 143 s, and an override of 1 % makes 200 s of the 2 s at a twentieth of the speed: as long as they take, an
/// operator waits for them.
#[test]
fn the_operator_waits_for_slow_tools_and_slow_overrides() {
    let slow = [
        "line = { to = [0.6, 0.1, -0.2, 0.0], tool_speed = 0.0007 }\n[[cycle]]\ndwell = 0.1",
        "line = { to = [0.6, 0.1, -0.2, 0.0], speed = 0.05 }\n[[cycle]]\noverride = { after = 0.1, to = 0.01 }\n[[cycle]]\ndwell = 0.1",
    ];
    for slow in slow {
        let plan = rehearse(&scenario(&format!("[[cycle]]\n{slow}"))).unwrap();
        assert_eq!(plan.refused, [], "{slow}");
        assert!(plan.duration_s > 120.0, "{slow}: {}", plan.duration_s);
    }
}

/// The arm of a rehearsal obeys no torque. What a law integrates must not grow in it, however long a move takes: a hundredth of
/// the speed takes a hundred times as long.
#[test]
fn a_move_as_slow_as_they_get_is_planned_whatever_the_law_remembers() {
    let plan = |speed: f64| {
        let config = scenario(&format!(
            "[[cycle]]\njump = {{ to = [0.52, 0.1, -0.2, 0.0], top = -0.19, speed = {speed} }}"
        ));
        rehearse(&config).unwrap()
    };
    let (slow, slowest) = (plan(0.01), plan(0.0001));
    assert_eq!(slowest.refused, []);
    let [slow, slowest] = [slow, slowest].map(|plan| plan.moves[0].duration_s);
    assert!((slowest / slow - 100.0).abs() < 0.1, "{slow}, {slowest}");
}

#[test]
fn a_changed_value_is_checked_like_one_of_the_text_and_named_as_it_was_written() {
    let with = |change: &str| {
        let change: Change = change.parse().unwrap();
        let text = sim::scenario::built_in("gate").unwrap();
        Scenario::parse_with(text, "gate", &[change])
    };
    let taken = with("cycle[1].jump.speed=0.5").unwrap();
    let sim::scenario::Step::Jump(jump) = taken.cycle[1] else {
        panic!("{:?}", taken.cycle[1]);
    };
    assert!((jump.speed - 0.5).abs() < f64::EPSILON);
    assert_eq!(with("law=pid").unwrap().law.to_string(), "pid");
    assert_eq!(
        with("gains.bandwidth=80").unwrap().gains.unwrap().bandwidth,
        Some(80.0)
    );

    for (change, words) in [
        ("cycles=0", "--set cycles=0: cycles is 0; allowed: 1 to"),
        (
            "payload.mass=nan",
            "--set payload.mass=nan: payload.mass is NaN; allowed",
        ),
        (
            "cycle[0].jump.to=[600, 0, 0, 0]",
            "jump.to[0] is 600; allowed",
        ),
        ("gains.bandwith=80", "did you mean bandwidth?"),
        (
            "cycle[7].dwell=1",
            "there is no cycle[7]; the first of 3 is [0]",
        ),
        ("rate_hz=fast", "--set rate_hz=fast: invalid type"),
        ("name.x=1", "name is no table"),
    ] {
        let error = with(change).unwrap_err().to_string();
        assert!(error.contains(words), "{change}: {error}");
        assert!(error.contains("--set "), "{change}: {error}");
    }
    assert!("gains.bandwidth".parse::<Change>().is_err());
}

#[test]
fn a_weight_alone_goes_to_what_is_picked() {
    let mut picking = Scenario::built_in("pick-place").unwrap();
    picking.carry(10.0).unwrap();
    let sim::scenario::Step::Pick(picked) = picking.cycle[0] else {
        panic!("{:?}", picking.cycle[0]);
    };
    // Twice the 5 kg of the file: twice the inertia, the same place.
    assert!(
        (picked.mass - 10.0).abs() < 1e-12 && (picked.inertia_com_diag[0] - 0.024).abs() < 1e-12
    );
    assert!(picking.payload.is_none());
    assert!(picking.carry(0.0).is_err());
}
