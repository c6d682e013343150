//! A controller at the other end of a link, in lock-step: the same bits as the one in this process.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::net::TcpListener;
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
