//! The monitor's picture of a bus with known traffic.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use plant_sim::monitor::{Monitor, View};
use protocol::codec;
use protocol::frame::{CanFrame, StandardId};
use protocol::messages::{
    Cause, Compensation, DriveStatus, Emergency, FaultAxis, Feedback, Law, LimitFlags, Message,
    Mode, Node, Operation, State,
};
use protocol::wire::BitTiming;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::KeyCode;
use trace::{Entry, Interface, Record};

fn take(monitor: &mut Monitor, time_us: u64, frame: CanFrame) {
    monitor.record(&Record {
        time_us,
        interface: Interface::CAN0,
        direction: None,
        entry: Entry::Frame(frame),
    });
}

fn feedback(sample: u32) -> CanFrame {
    let feedback = Feedback {
        sample,
        status: DriveStatus::READY,
        position: [7, 0, 0, 0],
        velocity: [0.0; 4],
        torque: [0; 4],
    };
    codec::encode(&Message::Feedback(feedback), sample as u8).unwrap()
}

fn state(mode: Mode, cause: Cause) -> CanFrame {
    let state = State {
        mode,
        cause,
        limits: LimitFlags::TORQUE_LIFT,
        queue: 3,
        completed: 0,
        overruns: 0,
        rejected: 0,
        worst_tick: 0,
        law: Law::Pid,
        compensation: Compensation::Integral,
        tracking_error: [0.0; 4],
        fault_axis: FaultAxis::Lift,
        fault_value: 2.5,
        fault_limit: 2.42,
        pace: 100,
        operation: Operation::Automatic,
        burden: 0,
    };
    codec::encode(&Message::State(state), 0).unwrap()
}

/// Lines of a terminal of 80 columns and 24 rows.
fn screen_of(monitor: &Monitor, view: &mut View) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
    let picture = monitor.picture();
    terminal.draw(|frame| picture.draw(view, frame)).unwrap();
    let buffer = terminal.backend().buffer();
    let area = buffer.area;
    (0..area.height)
        .map(|y| {
            (0..area.width)
                .map(|x| buffer[(x, y)].symbol())
                .collect::<String>()
        })
        .collect()
}

/// The page that is shown after these keys.
fn screen(monitor: &Monitor, keys: &[KeyCode]) -> Vec<String> {
    let mut view = View::default();
    for key in keys {
        // As at a terminal: it is drawn between two keys.
        screen_of(monitor, &mut view);
        assert!(view.key(*key));
    }
    screen_of(monitor, &mut view)
}

fn line(screen: &[String], part: &str) -> String {
    screen
        .iter()
        .find(|line| line.contains(part))
        .unwrap_or_else(|| panic!("no {part} in {screen:#?}"))
        .clone()
}

/// 1 kHz for 1.5 s with sample 1200 lost: the last full second is shown, and the loss since the start.
#[test]
fn rates_are_those_of_the_last_second_and_losses_of_all() {
    let mut monitor = Monitor::new("socketcan:can7", BitTiming::default());
    for sample in (0..1500).filter(|sample| *sample != 1200) {
        take(&mut monitor, 1000 * u64::from(sample), feedback(sample));
    }
    let screen = screen(&monitor, &[]);
    assert!(screen[0].starts_with("socketcan:can7"));
    assert!(screen[0].contains("1499 frames"));
    assert!(screen[1].contains("no state of a controller yet"));
    let row = line(&screen, "Feedback");
    let words: Vec<&str> = row.trim_matches(['│', ' ']).split_whitespace().collect();
    // Identifier, message, rate, jitter, longest period, lost, bad.
    assert_eq!(
        words[..7],
        ["1C0", "Feedback", "1000.0", "0.000", "1.000", "1", "0"]
    );
    let values = self::screen(&monitor, &[KeyCode::Char('2')]);
    assert!(line(&values, "sample=1499").contains("status=ready"));
}

/// The load is that of the bus that was named, and frames that did not come here are said.
#[test]
fn a_slower_bus_is_fuller_and_what_was_missed_is_said() {
    let load = |timing: BitTiming| {
        let mut monitor = Monitor::new("bus", timing);
        for sample in 0..1500 {
            take(&mut monitor, 1000 * u64::from(sample), feedback(sample));
        }
        monitor.missed(7);
        let head = screen(&monitor, &[])[0].clone();
        assert!(head.contains("7 missed"), "{head}");
        let (_, load) = head.split_once("load ").unwrap();
        let (percent, rest) = load.split_once(" % of ").unwrap();
        (percent.parse::<f64>().unwrap(), rest.to_owned())
    };
    let (fast, rates) = load(BitTiming::new(1_000_000, 1_000_000, 800).unwrap());
    assert!(rates.starts_with("1/1 Mbit/s"));
    let (slow, rates) = load(BitTiming::new(500_000, 500_000, 800).unwrap());
    assert!(rates.starts_with("0.5/0.5 Mbit/s"));
    // Shown with one decimal.
    assert!((slow - 2.0 * fast).abs() < 0.2, "{slow} {fast}");
}

/// Two seconds without a frame: nothing is shown as still arriving.
#[test]
fn silence_is_shown() {
    let mut monitor = Monitor::new("bus", BitTiming::default());
    take(&mut monitor, 0, feedback(0));
    take(&mut monitor, 1000, feedback(1));
    for time in [1_000_000, 2_000_000] {
        monitor.tick(time);
    }
    let screen = screen(&monitor, &[]);
    assert!(screen[0].contains("load 0.0 % of 1/5 Mbit/s"));
    let row = line(&screen, "Feedback");
    let words: Vec<&str> = row.trim_matches(['│', ' ']).split_whitespace().collect();
    assert_eq!(words[2], "-", "{row}");
}

#[test]
fn states_and_faults_are_told() {
    let mut monitor = Monitor::new("bus", BitTiming::default());
    take(&mut monitor, 0, state(Mode::Moving, Cause::None));
    let emergency = Message::Emergency(Node::Controller, Emergency::new(Cause::OverSpeed, 0));
    take(&mut monitor, 250_000, codec::encode(&emergency, 0).unwrap());
    take(&mut monitor, 260_000, state(Mode::Fault, Cause::OverSpeed));
    let screen = screen(&monitor, &[KeyCode::Tab, KeyCode::Tab]);
    let head = screen[1..4].join(" ");
    for part in [
        "fault",
        "over speed, axis 3 (lift): 2.5",
        "pid:integral",
        "queue 3",
        "torque-lift",
    ] {
        assert!(head.contains(part), "{part} in {head}");
    }
    assert!(line(&screen, "0.250 s").contains("controller: over-speed (code 8400h)"));
    assert!(line(&screen, "0.260 s").contains("mode fault: over speed, axis 3 (lift)"));
    // The newest is on top.
    let row = |part| screen.iter().position(|line| line.contains(part)).unwrap();
    assert!(row("0.260 s") < row("0.250 s"));
}

/// A bus with every message and with forty of a neighbour, on 80 columns: whatever there is can be reached, and nothing is
/// cut off at the right.
#[test]
fn everything_can_be_reached_on_a_small_terminal() {
    let mut monitor = Monitor::new(
        "slcan:tcp:a-machine-with-a-long-name.example.org:29536",
        BitTiming::default(),
    );
    let feedback = Feedback {
        sample: u32::MAX,
        status: DriveStatus::READY,
        position: [i32::MIN, -2_000_000, 3_000_000, 1_999_999_999],
        velocity: [-1999.123, 1999.123, -0.000_123_4, 1.0],
        torque: [i16::MIN, -20000, 3, 32767],
    };
    let frame = codec::encode(&Message::Feedback(feedback), 0).unwrap();
    take(&mut monitor, 0, frame);
    take(
        &mut monitor,
        1,
        state(Mode::FaultReaction, Cause::FollowingError),
    );
    for id in 0x400..0x428 {
        let id = StandardId::new(id).unwrap();
        take(&mut monitor, 2, CanFrame::classical(id, &[1]).unwrap());
    }
    for index in 0..50 {
        let mode = if index % 2 == 0 {
            Mode::Ready
        } else {
            Mode::Enabled
        };
        take(
            &mut monitor,
            1_000_000 * index + 3,
            state(mode, Cause::None),
        );
    }
    for (page, wanted) in [
        ('1', vec!["1C0", "300", "400", "427"]),
        (
            '2',
            vec![
                "-2147483648",
                "1999999999",
                "-1999.123",
                "32767",
                "fault_limit=2.42",
                "427",
            ],
        ),
        ('3', vec!["mode ready", "0.000 s", "49.000 s"]),
    ] {
        let mut view = View::default();
        view.key(KeyCode::Char(page));
        let mut seen = screen_of(&monitor, &mut view);
        for _ in 0..20 {
            view.key(KeyCode::PageDown);
            seen.extend(screen_of(&monitor, &mut view));
        }
        for part in wanted {
            line(&seen, part);
        }
        // The end stays at the foot of the page, and one key leads back to the beginning.
        let end = screen_of(&monitor, &mut view);
        view.key(KeyCode::End);
        assert_eq!(screen_of(&monitor, &mut view), end);
        view.key(KeyCode::Home);
        assert_eq!(screen_of(&monitor, &mut view), seen[..24]);
    }
}

/// No size makes it fail, and a word longer than a line is broken.
#[test]
fn any_size_of_terminal_is_drawn() {
    let mut monitor = Monitor::new("bus", BitTiming::default());
    take(&mut monitor, 0, feedback(0));
    take(&mut monitor, 1, state(Mode::Fault, Cause::OverSpeed));
    for (width, height) in [(1, 1), (3, 3), (10, 5), (79, 2), (300, 100)] {
        for page in ['1', '2', '3'] {
            let mut view = View::default();
            view.key(KeyCode::Char(page));
            let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
            let picture = monitor.picture();
            terminal
                .draw(|frame| picture.draw(&mut view, frame))
                .unwrap();
        }
    }
}
