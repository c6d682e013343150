//! Text of the monitor's pages, line by line, for a terminal of any width.

use std::collections::BTreeMap;

use protocol::frame::Id;
use ratatui::text::{Line, Span};

use super::Picture;
use super::view::{ALARM, BOLD, GREY};
use trace::decode::describe;
use trace::stats::{IdStatistics, Statistics};

/// Blanks between two parts of a line, and before a continued line.
const GAP: &str = "  ";

/// Title of the page of identifiers.
pub(super) fn bus_header() -> Line<'static> {
    let text = format!(
        "{:>8} {:<26} {:>8} {:>9} {:>8} {:>6} {:>6}",
        "id", "message", "rate/Hz", "jitter/ms", "max/ms", "lost", "bad"
    );
    Line::styled(text, BOLD)
}

/// One identifier per line: timing in the last second, and errors since the start.
pub(super) fn bus(picture: &Picture) -> Vec<Line<'static>> {
    let recent: BTreeMap<&str, &IdStatistics> = picture
        .window
        .iter()
        .flat_map(ids)
        .map(|line| (line.id.as_str(), line))
        .collect();
    ids(&picture.total)
        .map(|total| {
            let period = recent
                .get(total.id.as_str())
                .and_then(|recent| recent.period.as_ref());
            let number = |value: Option<f64>, decimals: usize| {
                value.map_or("-".into(), |value| format!("{value:.decimals$}"))
            };
            let text = format!(
                "{:>8} {:<26} {:>8} {:>9} {:>8}",
                total.id,
                total.name,
                number(period.map(|period| 1e3 / period.mean_ms), 1),
                number(period.map(|period| period.jitter_ms), 3),
                number(period.map(|period| period.max_ms), 3),
            );
            let silent = !recent.contains_key(total.id.as_str());
            let count = |number: u64| {
                let style = if number > 0 { ALARM } else { GREY };
                Span::styled(format!(" {number:>6}"), style)
            };
            Line::from(vec![
                if silent {
                    Span::styled(text, GREY)
                } else {
                    Span::raw(text)
                },
                count(total.lost),
                count(total.bad()),
            ])
        })
        .collect()
}

/// Identifiers of the watched bus.
pub(super) fn ids(statistics: &Statistics) -> impl Iterator<Item = &IdStatistics> {
    statistics.interfaces.iter().flat_map(|bus| &bus.ids)
}

/// An identifier as statistics write it.
pub(super) fn identifier(id: Id) -> String {
    match id {
        Id::Standard(id) => format!("{:03X}", id.as_raw()),
        Id::Extended(id) => format!("{:08X}", id.as_raw()),
    }
}

/// Every message with its newest fields.
pub(super) fn values(picture: &Picture, width: usize) -> Vec<Line<'static>> {
    let names: BTreeMap<&str, &str> = ids(&picture.total)
        .map(|line| (line.id.as_str(), line.name))
        .collect();
    let mut lines = Vec::new();
    for (id, record) in &picture.newest {
        let id = identifier(*id);
        let name = names.get(id.as_str()).copied().unwrap_or_default();
        lines.push(Line::styled(format!("{id} {name}"), BOLD));
        let fields = describe(record);
        let fields = fields.split(GAP).map(|field| Span::raw(field.to_owned()));
        let inner = width.saturating_sub(GAP.len());
        for mut line in flow(fields.collect(), inner) {
            line.spans.insert(0, Span::raw(GAP));
            lines.push(line);
        }
    }
    lines
}

/// Events, the newest first.
pub(super) fn events(picture: &Picture, width: usize) -> Vec<Line<'static>> {
    let started = picture.started_us.unwrap_or(0);
    let mut lines = Vec::new();
    for event in picture.events.iter().rev() {
        let seconds = event.time_us.saturating_sub(started) as f64 / 1e6;
        let stamp = format!("{seconds:>10.3} s");
        let inner = width.saturating_sub(stamp.len() + GAP.len());
        let words = event.text.split(' ').map(str::to_owned);
        for (index, text) in wrap(words, inner).into_iter().enumerate() {
            let stamp = if index == 0 { stamp.as_str() } else { "" };
            lines.push(Line::raw(format!("{stamp:>12}{GAP}{text}")));
        }
    }
    lines
}

/// Parts one after the other, in as many lines as they need; one that is longer than a line is broken.
pub(super) fn flow(parts: Vec<Span<'static>>, width: usize) -> Vec<Line<'static>> {
    let mut lines: Vec<Line> = Vec::new();
    let mut used = 0;
    for part in parts {
        let style = part.style;
        for piece in wrap(part.content.split(' ').map(str::to_owned), width) {
            let length = piece.chars().count();
            match lines.last_mut() {
                Some(line) if used + GAP.len() + length <= width => {
                    line.push_span(Span::raw(GAP));
                    line.push_span(Span::styled(piece, style));
                    used += GAP.len() + length;
                }
                _ => {
                    lines.push(Line::from(Span::styled(piece, style)));
                    used = length;
                }
            }
        }
    }
    lines
}

/// Words in lines of at most `width`; a longer word is cut.
fn wrap(words: impl Iterator<Item = String>, width: usize) -> Vec<String> {
    let width = width.max(1);
    let mut lines = vec![String::new()];
    for word in words {
        let mut rest: Vec<char> = word.chars().collect();
        while !rest.is_empty() {
            let line = lines.last_mut().expect("there is always one");
            let used = line.chars().count();
            let blank = usize::from(used > 0);
            if used + blank + rest.len() <= width {
                if blank == 1 {
                    line.push(' ');
                }
                line.extend(rest.drain(..));
            } else if used > 0 {
                lines.push(String::new());
            } else {
                line.extend(rest.drain(..width));
            }
        }
    }
    lines
}
