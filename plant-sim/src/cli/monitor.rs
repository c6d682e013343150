//! `plant-sim monitor`: watches a bus on the terminal.

use std::io::{self, IsTerminal};
use std::time::{Duration, Instant, SystemTime};

use clap::Args;
use link::{Link, LinkAddress};
use plant_sim::interrupt;
use plant_sim::monitor::{Monitor, Picture, View};
use protocol::wire::BitTiming;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use trace::Interface;

use super::Failure;
use super::arrival::{microseconds, record};
use super::bitrate::bit_timing;

/// Time between two pictures.
const REFRESH: Duration = Duration::from_millis(100);
/// Longest wait for a frame before checking for keys.
const WAIT: Duration = Duration::from_millis(20);
/// Frames taken before picture and keys get their turn: a flooded bus must stay visible.
const BATCH: usize = 1024;

/// Arguments of `monitor`.
#[derive(Args)]
pub(super) struct MonitorArgs {
    /// The bus: socketcan:INTERFACE, slcan:TERMINAL, slcan:tcp:HOST:PORT or slcan:listen:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    bus: LinkAddress,
    /// Bit rates of the bus, bit/s, for its load.
    #[arg(long, value_name = "N[,D]", default_value = "1M,5M", value_parser = bit_timing)]
    bitrate: BitTiming,
}

/// Shows the bus until the user quits.
pub(super) fn run(args: &MonitorArgs) -> Result<(), Failure> {
    if !io::stdout().is_terminal() {
        return Err(Failure::usage(
            "monitor draws on a terminal; use candump and `plant-sim trace` for files",
        ));
    }
    interrupt::listen()?;
    let mut link = Link::watch(&args.bus).map_err(|error| error.to_string())?;
    let monitor = Monitor::new(&args.bus.to_string(), args.bitrate);
    // Also restores the terminal in a panic.
    let mut terminal = ratatui::init();
    let result = watch(&mut link, monitor, &mut terminal);
    ratatui::restore();
    result
}

fn watch(
    link: &mut Link,
    mut monitor: Monitor,
    terminal: &mut DefaultTerminal,
) -> Result<(), Failure> {
    let on_screen = |error: io::Error| Failure::failed(format!("cannot use the terminal: {error}"));
    let mut view = View::default();
    let mut drawn: Option<Instant> = None;
    let mut held: Option<Picture> = None;
    while !interrupt::asked() {
        link.wait(WAIT).map_err(|error| error.to_string())?;
        for _ in 0..BATCH {
            let Some(arrival) = link.next_arrival() else {
                break;
            };
            if let Some(record) = record(&arrival, Interface::CAN0) {
                monitor.record(&record);
            }
        }
        monitor.tick(microseconds(SystemTime::now()));
        monitor.missed(link.lost());
        while event::poll(Duration::ZERO).map_err(on_screen)? {
            match event::read().map_err(on_screen)? {
                Event::Key(key) if key.kind == KeyEventKind::Press => match key.code {
                    KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
                    KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => {
                        return Ok(());
                    }
                    KeyCode::Char(' ') => {
                        held = match held {
                            Some(_) => None,
                            None => Some(monitor.picture()),
                        };
                    }
                    // A page that was turned is drawn at once.
                    key if view.key(key) => drawn = None,
                    _ => {}
                },
                Event::Resize(..) => drawn = None,
                _ => {}
            }
        }
        if drawn.is_none_or(|drawn| drawn.elapsed() >= REFRESH) {
            drawn = Some(Instant::now());
            let newest;
            let picture = match &held {
                Some(picture) => picture,
                None => {
                    newest = monitor.picture();
                    &newest
                }
            };
            terminal
                .draw(|frame| picture.draw(&mut view, frame))
                .map_err(on_screen)?;
        }
    }
    Ok(())
}
