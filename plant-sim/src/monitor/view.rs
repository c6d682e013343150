//! The monitor on a terminal, of 80 columns and 24 rows or more: a head with bus and state, and one of three pages below.

use protocol::messages::{Cause, LimitFlags, Mode};
use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

use super::Picture;
use super::pages;

pub(super) const BOLD: Style = Style::new().add_modifier(Modifier::BOLD);
pub(super) const GREY: Style = Style::new().fg(Color::DarkGray);
pub(super) const ALARM: Style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);

/// What is shown below the head.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Page {
    /// Identifiers with rates and losses.
    #[default]
    Bus,
    /// Newest fields of every message.
    Values,
    /// Modes, faults and error frames so far.
    Events,
}

impl Page {
    const ALL: [Self; 3] = [Self::Bus, Self::Values, Self::Events];

    fn name(self) -> &'static str {
        match self {
            Self::Bus => "1 bus",
            Self::Values => "2 values",
            Self::Events => "3 events",
        }
    }

    fn after(self, steps: usize) -> Self {
        let place = Self::ALL.iter().position(|page| *page == self);
        Self::ALL[(place.unwrap_or(0) + steps) % Self::ALL.len()]
    }
}

/// Which part of the picture a person looks at.
#[derive(Clone, Copy, Debug, Default)]
pub struct View {
    page: Page,
    /// Lines above the first that is shown.
    scroll: usize,
    /// Lines that fitted when it was drawn.
    height: usize,
}

impl View {
    /// Turns pages and scrolls; `false` if the key is for neither.
    pub fn key(&mut self, key: KeyCode) -> bool {
        let page = match key {
            KeyCode::Char('1') => Some(Page::Bus),
            KeyCode::Char('2') => Some(Page::Values),
            KeyCode::Char('3') => Some(Page::Events),
            KeyCode::Tab | KeyCode::Right => Some(self.page.after(1)),
            KeyCode::BackTab | KeyCode::Left => Some(self.page.after(Page::ALL.len() - 1)),
            _ => None,
        };
        if let Some(page) = page {
            *self = Self {
                page,
                scroll: 0,
                ..*self
            };
            return true;
        }
        self.scroll = match key {
            KeyCode::Up | KeyCode::Char('k') => self.scroll.saturating_sub(1),
            KeyCode::Down | KeyCode::Char('j') => self.scroll + 1,
            KeyCode::PageUp => self.scroll.saturating_sub(self.height),
            KeyCode::PageDown => self.scroll + self.height,
            KeyCode::Home => 0,
            // Drawing knows where the end is.
            KeyCode::End => usize::MAX,
            _ => return false,
        };
        true
    }
}

impl Picture {
    /// Draws the part that is looked at; a view scrolled beyond its end is set back to it.
    pub fn draw(&self, view: &mut View, frame: &mut Frame) {
        let head = self.head(usize::from(frame.area().width));
        let [top, body, foot] = Layout::vertical([
            Constraint::Length(head.len() as u16),
            Constraint::Min(3),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        frame.render_widget(Paragraph::new(head), top);
        let block = Block::bordered();
        let inner = block.inner(body);
        let (fixed, lines) = match view.page {
            Page::Bus => (Some(pages::bus_header()), pages::bus(self)),
            Page::Values => (None, pages::values(self, usize::from(inner.width))),
            Page::Events => (None, pages::events(self, usize::from(inner.width))),
        };
        view.height = usize::from(inner.height) - usize::from(fixed.is_some() && inner.height > 0);
        view.scroll = view.scroll.min(lines.len().saturating_sub(view.height));
        let last = lines.len().min(view.scroll + view.height);
        let place = if lines.len() > view.height {
            format!(" {} to {last} of {} ", view.scroll + 1, lines.len())
        } else {
            String::new()
        };
        let shown = lines.into_iter().skip(view.scroll).take(view.height);
        let shown: Vec<Line> = fixed.into_iter().chain(shown).collect();
        frame.render_widget(
            Paragraph::new(shown).block(block.title_bottom(Line::raw(place).right_aligned())),
            body,
        );
        frame.render_widget(Paragraph::new(foot_line(view.page)), foot);
    }

    /// Bus and state, in lines of at most `width` columns.
    fn head(&self, width: usize) -> Vec<Line<'static>> {
        let load = self.window.as_ref().map_or("-".to_owned(), |window| {
            let load = window.interfaces.first().map_or(0.0, |bus| bus.load);
            let [nominal, data] =
                [window.bitrate, window.data_bitrate].map(|rate| f64::from(rate) / 1e6);
            format!("{:.1} % of {nominal}/{data} Mbit/s", load * 100.0)
        });
        let mut bus = vec![
            Span::styled(self.title.clone(), BOLD),
            Span::raw(format!("load {load}")),
            Span::raw(format!("{} frames", self.total.frames)),
        ];
        if self.total.error_frames > 0 {
            let count = self.total.error_frames;
            bus.push(Span::styled(format!("{count} error frames"), ALARM));
        }
        if self.missed > 0 {
            bus.push(Span::styled(format!("{} missed", self.missed), ALARM));
        }
        let mut lines = pages::flow(bus, width);
        lines.extend(pages::flow(self.state_spans(), width));
        lines
    }

    fn state_spans(&self) -> Vec<Span<'static>> {
        let Some(state) = &self.state else {
            return vec![Span::styled("no state of a controller yet", GREY)];
        };
        let mut spans = vec![
            Span::styled(state.mode.name(), mode_style(state.mode)),
            match state.cause {
                Cause::None => Span::raw("no fault"),
                _ => Span::styled(state.fault().to_string(), ALARM),
            },
            Span::raw(format!("law {}:{}", state.law, state.compensation)),
            Span::raw(format!("queue {}", state.queue)),
            Span::raw(format!("overruns {}", state.overruns)),
            Span::raw(format!("rejected {}", state.rejected)),
        ];
        let limits: Vec<&str> = LimitFlags::NAMES
            .iter()
            .enumerate()
            .filter(|(bit, _)| state.limits.bits() >> bit & 1 == 1)
            .map(|(_, name)| *name)
            .collect();
        let limits = if limits.is_empty() {
            "-".to_owned()
        } else {
            limits.join("|")
        };
        spans.push(Span::raw(format!("limits {limits}")));
        spans
    }
}

fn foot_line(page: Page) -> Line<'static> {
    let mut spans: Vec<Span> = Page::ALL
        .iter()
        .flat_map(|other| {
            let style = if *other == page { BOLD } else { GREY };
            [Span::styled(other.name(), style), Span::raw("  ")]
        })
        .collect();
    spans.push(Span::styled("arrows scroll  space hold  q quit", GREY));
    Line::from(spans)
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
