//! The monitor's picture of a bus whose traffic is known.

use plant_sim::monitor::Monitor;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, Compensation, DriveStatus, Emergency, FaultAxis, Feedback, Law, LimitFlags, Message,
    Mode, Node, State,
};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
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
    };
    codec::encode(&Message::State(state), 0).unwrap()
}

/// Lines of the screen.
fn screen(monitor: &Monitor) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(160, 24)).unwrap();
    terminal.draw(|frame| monitor.draw(frame)).unwrap();
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

fn line(screen: &[String], part: &str) -> String {
    screen
        .iter()
        .find(|line| line.contains(part))
        .unwrap_or_else(|| panic!("no {part} in {screen:#?}"))
        .clone()
}

/// 1 kHz for 1.5 s with sample 1200 lost: the full second before is shown, the loss since the start.
#[test]
fn rates_are_those_of_the_last_second_and_losses_of_all() {
    let mut monitor = Monitor::new("socketcan:can7");
    for sample in (0..1500).filter(|sample| *sample != 1200) {
        take(&mut monitor, 1000 * u64::from(sample), feedback(sample));
    }
    let screen = screen(&monitor);
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
    assert!(row.contains("sample=1499"));
}

/// Two seconds without a frame: nothing is shown as if it still came.
#[test]
fn silence_is_shown() {
    let mut monitor = Monitor::new("bus");
    take(&mut monitor, 0, feedback(0));
    take(&mut monitor, 1000, feedback(1));
    for time in [1_000_000, 2_000_000] {
        monitor.tick(time);
    }
    let screen = screen(&monitor);
    assert!(screen[0].contains("load 0.0 %"));
    let row = line(&screen, "Feedback");
    assert_eq!(row.split_whitespace().nth(2), Some("-"), "{row}");
}

#[test]
fn states_and_faults_are_told() {
    let mut monitor = Monitor::new("bus");
    take(&mut monitor, 0, state(Mode::Moving, Cause::None));
    let emergency = Message::Emergency(Node::Controller, Emergency::new(Cause::OverSpeed, 0));
    take(&mut monitor, 250_000, codec::encode(&emergency, 0).unwrap());
    take(&mut monitor, 260_000, state(Mode::Fault, Cause::OverSpeed));
    let screen = screen(&monitor);
    let head = &screen[1];
    for part in [
        "fault",
        "over-speed",
        "pid:integral",
        "queue 3",
        "torque-lift",
    ] {
        assert!(head.contains(part), "{part} in {head}");
    }
    assert!(line(&screen, "0.250 s").contains("controller: over-speed (code 8400h)"));
    assert!(line(&screen, "0.260 s").contains("mode fault"));
}
