//! A controller at the other end of a link, in lock-step: the same bits as the one in this process.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::net::TcpListener;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use firmware::cabinet::sample_clock::SampleClock;
use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use firmware::node::Node;
use link::{Link, LinkAddress};
use plant_sim::external::LockStep;
use plant_sim::replay::Replay;
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;
use protocol::time::{Instant, Period};
use sim::faults::{KINDS, Kind};
use sim::observer::{Observer, Truth};
use sim::run::{in_process, with_controller};
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use trace::{Entry, Interface, Record};

#[derive(Default)]
struct Seen {
    frames: Vec<(Instant, CanFrame)>,
    truth: Vec<Truth>,
}

impl Observer for Seen {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> std::io::Result<()> {
        self.frames.push((time, *frame));
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> std::io::Result<()> {
        self.truth.push(*truth);
        Ok(())
    }
}

/// A controller with a link as its bus, configured with robot and rate only.
fn controller(mut link: Link, period: Period, stop: &AtomicBool) {
    let start = || {
        (
            Node::new(Config::new(IRB_930, period), ResetReason::Software),
            SampleClock::new(period),
        )
    };
    let (mut node, mut clock) = start();
    node.poll(clock.now(), None, &mut link);
    while !stop.load(Ordering::Relaxed) {
        let _ = link.wait(Duration::from_millis(5));
        while let Some(stamped) = link.take() {
            if clock.observe(&stamped.frame) {
                node.poll(clock.now(), None, &mut link);
            }
            node.poll(clock.now(), Some(&stamped.frame), &mut link);
            if node.reset_asked() {
                (node, clock) = start();
                node.poll(clock.now(), None, &mut link);
            }
        }
    }
}

/// A controller on its own link: its stop flag and its address.
fn serve(rate: f64) -> (Arc<AtomicBool>, LinkAddress, JoinHandle<()>) {
    let port = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port();
    let hub: LinkAddress = format!("slcan:listen:127.0.0.1:{port}").parse().unwrap();
    let client = format!("slcan:tcp:127.0.0.1:{port}").parse().unwrap();
    let link = Link::open(&hub).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    let thread = thread::spawn(move || controller(link, Period::of_rate(rate), &asked));
    (stop, client, thread)
}

#[test]
fn an_external_controller_moves_the_arm_by_the_same_bits() {
    for rate in [1000.0, 3000.0] {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 1;
        scenario.rate_hz = rate;
        let config = RunConfig::new(scenario);
        let mut here = Seen::default();
        in_process(&config, &mut here).unwrap();

        let (stop, client, thread) = serve(rate);
        let mut there = Seen::default();
        let summary = with_controller(
            &config,
            |config| LockStep::connect(&client, config),
            &mut (),
            &mut there,
        )
        .unwrap();
        stop.store(true, Ordering::Relaxed);
        thread.join().unwrap();

        assert_eq!(summary.error, None);
        let differs = here.frames.iter().zip(&there.frames).find(|(a, b)| a != b);
        assert_eq!(differs, None, "{rate} Hz");
        assert!(here.truth == there.truth, "{rate} Hz");
        assert_eq!(here.frames.len(), there.frames.len());

        let mut replay = Replay::new(Config::new(IRB_930, Period::of_rate(rate)));
        for (time, frame) in &there.frames {
            replay
                .record(&Record {
                    time_us: time.micros(),
                    interface: Interface::CAN0,
                    direction: None,
                    entry: Entry::Frame(*frame),
                })
                .unwrap();
        }
        assert_eq!(replay.compared() as usize, there.truth.len());
    }
}

/// The link fails in the middle of the run: to the operator the controller is silent, and the arm comes to rest.
#[test]
fn a_controller_that_goes_away_is_a_result() {
    let config = RunConfig::new(Scenario::built_in("gate").unwrap());
    let (stop, client, thread) = serve(1000.0);
    /// Ends the controller at this sample.
    struct Ending<'a>(u32, &'a AtomicBool);
    impl Observer for Ending<'_> {
        fn sample(&mut self, _: &Truth) -> std::io::Result<()> {
            self.0 = self.0.saturating_sub(1);
            if self.0 == 0 {
                self.1.store(true, Ordering::Relaxed);
            }
            Ok(())
        }
    }
    let summary = with_controller(
        &config,
        |config| LockStep::connect(&client, config),
        &mut (),
        &mut Ending(450, &stop),
    )
    .unwrap();
    thread.join().unwrap();
    let error = summary.error.unwrap();
    assert!(error.contains("has been silent since"), "{error}");
    assert!(summary.at_rest);
}

/// A fault of this kind, in effect while it matters, for some milliseconds.
fn example(kind: &Kind) -> String {
    let place = match kind.place {
        "message" => "feedback",
        "node" if matches!(kind.name, "no-recovery" | "slow") => "controller",
        "node" => "drives",
        place => place,
    };
    let axis = if kind.has_axis { ":lift" } else { "" };
    let value = match (kind.name, kind.value) {
        ("burst", _) => "=0.5/4".into(),
        (_, Some(value)) => format!("={}", value.moderate()),
        (_, None) => String::new(),
    };
    let window = match kind.place {
        // While the brake is closed and is to open.
        "brake" => "0s..80ms",
        _ => "320ms..328ms",
    };
    format!("{place}{axis}:{}{value}@{window}", kind.name)
}

/// What differs with an external controller in lock-step: its time stands still where no new feedback arrives that it can read, and nobody tells it of a
/// bus-off of the simulated bus, nor that it is slow. As docs/faults.md says.
const DIFFERENT: [&str; 18] = [
    "loss",
    "delay",
    "jitter",
    "corrupt",
    "bad-value",
    "bit-error",
    "stuff-error",
    "form-error",
    "crc-error",
    "ack-error",
    "silent",
    "dead",
    "slow",
    "babbling",
    "no-recovery",
    "dominant",
    "recessive",
    "misses",
];

#[test]
fn every_kind_of_fault_acts_on_an_external_controller() {
    let config = |faults: &[&str]| {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 1;
        scenario.faults = faults.iter().map(|text| text.parse().unwrap()).collect();
        RunConfig::new(scenario)
    };
    let there = |faults: &[&str]| {
        let (stop, client, thread) = serve(1000.0);
        let mut seen = Seen::default();
        let connect = |config| LockStep::connect(&client, config);
        let summary = with_controller(&config(faults), connect, &mut (), &mut seen).unwrap();
        stop.store(true, Ordering::Relaxed);
        thread.join().unwrap();
        // A stop is a result; a twin that differs is none.
        let error = summary.error.unwrap_or_default();
        assert!(
            !error.contains("differs from its twin"),
            "{faults:?}: {error}"
        );
        seen
    };
    let sound = there(&[]);
    let mut different = Vec::new();
    for kind in KINDS {
        let text = example(&kind);
        // Without a bus-off there is nothing to recover from.
        let faults = match kind.name {
            "no-recovery" => vec![text.as_str(), "command:bit-error@320ms..325ms"],
            _ => vec![text.as_str()],
        };
        let external = there(&faults);
        let mut internal = Seen::default();
        in_process(&config(&faults), &mut internal).unwrap();
        for seen in [&external, &internal] {
            assert!(
                seen.truth != sound.truth || seen.frames != sound.frames,
                "{text}"
            );
        }
        if external.frames != internal.frames || external.truth != internal.truth {
            different.push(kind.name);
        }
    }
    assert_eq!(different, DIFFERENT);
}

/// What only this machine could do is refused before anything is looked for on the bus.
#[test]
fn what_cannot_break_an_external_controller_is_refused_by_name() {
    let lock_step = "an external controller has a power supply of its own; allowed: controller:silent, or --controller qemu";
    let processor = "an external controller has a processor of its own; allowed: command:delay, or --controller qemu";
    let real_time =
        "in real time samples are taken by the clock of this machine; allowed without --real-time";
    for (fault, options, why) in [
        ("controller:dead@0.4s..0.5s", &[][..], lock_step),
        ("controller:dead@0.4s..0.5s", &["--real-time"], lock_step),
        ("controller:slow=0.002@0.4s", &[], processor),
        ("controller:slow=0.002@0.4s", &["--real-time"], processor),
        ("clock:drift=0.01@0.4s", &["--real-time"], real_time),
        ("clock:misses@0.4s", &["--real-time"], real_time),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
            .args([
                "run",
                "--controller",
                "external",
                "--bus",
                "slcan:tcp:127.0.0.1:1",
            ])
            .args(["--fault", fault])
            .args(options)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(&format!("fault {fault}: {why}")), "{said}");
    }
}
