//! The monitor on a terminal.

use protocol::messages::Mode;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Cell, Paragraph, Row, Table};

use super::Monitor;
use trace::decode::describe;
use trace::stats::{IdStatistics, Statistics};

const BOLD: Style = Style::new().add_modifier(Modifier::BOLD);
const GREY: Style = Style::new().fg(Color::DarkGray);
const ALARM: Style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);

impl Monitor {
    /// Draws what there is to know.
    pub fn draw(&self, frame: &mut Frame) {
        let total = self.total.statistics();
        let events = self.events.len() as u16 + 2;
        let [head, table, log, foot] = Layout::vertical([
            Constraint::Length(2),
            Constraint::Min(4),
            Constraint::Length(events),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        frame.render_widget(
            Paragraph::new(vec![self.bus_line(&total), self.state_line()]),
            head,
        );
        self.draw_table(frame, table, &total);
        self.draw_events(frame, log);
        frame.render_widget(
            Paragraph::new("q quit   space hold".to_owned()).style(GREY),
            foot,
        );
    }

    fn bus_line(&self, total: &Statistics) -> Line<'_> {
        let load = match &self.window {
            Some(window) => {
                let load = window.interfaces.first().map_or(0.0, |bus| bus.load);
                format!("  load {:.1} %", load * 100.0)
            }
            None => "  load -".to_owned(),
        };
        let mut spans = vec![
            Span::styled(self.title.as_str(), BOLD),
            Span::raw(load),
            Span::raw(format!("  {} frames", total.frames)),
        ];
        if total.error_frames > 0 {
            spans.push(Span::styled(
                format!("  {} error frames", total.error_frames),
                ALARM,
            ));
        }
        Line::from(spans)
    }

    fn state_line(&self) -> Line<'_> {
        let Some(state) = &self.state else {
            return Line::styled("no state of a controller yet", GREY);
        };
        let flags: Vec<&str> = protocol::messages::LimitFlags::NAMES
            .iter()
            .enumerate()
            .filter(|(bit, _)| state.limits.bits() >> bit & 1 == 1)
            .map(|(_, name)| *name)
            .collect();
        Line::from(vec![
            Span::styled(state.mode.name(), mode_style(state.mode)),
            Span::raw(format!(
                "  cause {}  law {}:{}  queue {}  overruns {}  rejected {}  limits {}",
                state.cause,
                state.law,
                state.compensation,
                state.queue,
                state.overruns,
                state.rejected,
                if flags.is_empty() {
                    "-".to_owned()
                } else {
                    flags.join("|")
                }
            )),
        ])
    }

    fn draw_table(&self, frame: &mut Frame, area: Rect, total: &Statistics) {
        let rows = ids(total).zip(self.newest.values()).map(|(line, newest)| {
            let recent = self
                .window
                .as_ref()
                .and_then(|window| ids(window).find(|recent| recent.id == line.id));
            row(line, recent, describe(newest))
        });
        let header = Row::new([
            "id",
            "message",
            "rate/Hz",
            "jitter/ms",
            "max/ms",
            "lost",
            "bad",
            "newest values",
        ])
        .style(BOLD);
        let widths = [
            Constraint::Length(8),
            Constraint::Length(26),
            Constraint::Length(8),
            Constraint::Length(9),
            Constraint::Length(8),
            Constraint::Length(6),
            Constraint::Length(6),
            Constraint::Min(10),
        ];
        frame.render_widget(
            Table::new(rows, widths)
                .header(header)
                .block(Block::bordered()),
            area,
        );
    }

    fn draw_events(&self, frame: &mut Frame, area: Rect) {
        let started = self.started_us.unwrap_or(0);
        let lines: Vec<Line> = self
            .events
            .iter()
            .map(|event| {
                let seconds = event.time_us.saturating_sub(started) as f64 / 1e6;
                Line::raw(format!("{seconds:>10.3} s  {}", event.text))
            })
            .collect();
        frame.render_widget(
            Paragraph::new(lines).block(Block::bordered().title("events")),
            area,
        );
    }
}

/// Identifiers of the one bus that is watched.
fn ids(statistics: &Statistics) -> impl Iterator<Item = &IdStatistics> {
    statistics.interfaces.iter().flat_map(|bus| &bus.ids)
}

/// One identifier: how it came in the last second, what has been wrong since the start, and its newest values.
fn row<'a>(total: &IdStatistics, recent: Option<&IdStatistics>, values: String) -> Row<'a> {
    let period = recent.and_then(|recent| recent.period.as_ref());
    let bad = total.duplicate + total.stale + total.crc + total.refused;
    let count = |number: u64| {
        let style = if number > 0 { ALARM } else { GREY };
        Cell::new(number.to_string()).style(style)
    };
    let silent = recent.is_none();
    Row::new([
        Cell::new(total.id.clone()),
        Cell::new(total.name),
        Cell::new(period.map_or("-".into(), |period| format!("{:.1}", 1e3 / period.mean_ms))),
        Cell::new(period.map_or("-".into(), |period| format!("{:.3}", period.jitter_ms))),
        Cell::new(period.map_or("-".into(), |period| format!("{:.3}", period.max_ms))),
        count(total.lost),
        count(bad),
        Cell::new(values),
    ])
    .style(if silent { GREY } else { Style::new() })
}

fn mode_style(mode: Mode) -> Style {
    let colour = match mode {
        Mode::Boot | Mode::SelfTest | Mode::PreOperational => Color::Gray,
        Mode::Ready | Mode::Enabling | Mode::Disabling => Color::Yellow,
        Mode::Enabled => Color::Cyan,
        Mode::Moving => Color::Green,
        Mode::QuickStop | Mode::FaultReaction | Mode::Fault | Mode::EStop => Color::Red,
    };
    BOLD.fg(colour)
}
