//! `plant-sim monitor`: watches a bus on the terminal.

use std::io::{self, IsTerminal};
use std::process::ExitCode;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use clap::Args;
use link::{Link, LinkAddress, Stamped};
use plant_sim::monitor::Monitor;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use trace::{Entry, Interface, Record};

/// Time between two pictures.
const REFRESH: Duration = Duration::from_millis(100);
/// Longest wait for a frame before keys are looked at.
const WAIT: Duration = Duration::from_millis(20);
/// Frames taken before picture and keys get their turn: a flooded bus must not hide itself.
const BATCH: usize = 1024;

/// Arguments of `monitor`.
#[derive(Args)]
pub(super) struct MonitorArgs {
    /// The bus: socketcan:INTERFACE, slcan:TERMINAL, slcan:tcp:HOST:PORT or slcan:listen:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    bus: LinkAddress,
}

/// Shows the bus until the user quits.
pub(super) fn run(args: &MonitorArgs) -> Result<ExitCode, String> {
    if !io::stdout().is_terminal() {
        return Err(
            "monitor draws on a terminal; use candump and `plant-sim trace` for files".into(),
        );
    }
    let mut link = Link::open(&args.bus).map_err(|error| error.to_string())?;
    let monitor = Monitor::new(&args.bus.to_string());
    let mut terminal = ratatui::init();
    let result = watch(&mut link, monitor, &mut terminal);
    ratatui::restore();
    result.map(|()| ExitCode::SUCCESS)
}

fn watch(
    link: &mut Link,
    mut monitor: Monitor,
    terminal: &mut DefaultTerminal,
) -> Result<(), String> {
    let on_screen = |error: io::Error| format!("cannot use the terminal: {error}");
    let mut drawn: Option<Instant> = None;
    let mut held = false;
    loop {
        link.wait(WAIT).map_err(|error| error.to_string())?;
        for _ in 0..BATCH {
            let Some(stamped) = link.take() else { break };
            monitor.record(&record(&stamped));
        }
        monitor.tick(microseconds(SystemTime::now()));
        if !held && drawn.is_none_or(|drawn| drawn.elapsed() >= REFRESH) {
            drawn = Some(Instant::now());
            terminal
                .draw(|frame| monitor.draw(frame))
                .map_err(on_screen)?;
        }
        while event::poll(Duration::ZERO).map_err(on_screen)? {
            match event::read().map_err(on_screen)? {
                Event::Key(key) if key.kind == KeyEventKind::Press => match key.code {
                    KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
                    KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => {
                        return Ok(());
                    }
                    KeyCode::Char(' ') => held = !held,
                    _ => {}
                },
                _ => {}
            }
        }
    }
}

fn record(stamped: &Stamped) -> Record {
    Record {
        time_us: microseconds(stamped.at),
        interface: Interface::CAN0,
        direction: None,
        entry: Entry::Frame(stamped.frame),
    }
}

/// Since 1970.
fn microseconds(time: SystemTime) -> u64 {
    time.duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_micros() as u64)
}
