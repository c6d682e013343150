//! When a fault is in effect: its window, as people write it.
//!
//! ```text
//! 0.3s  300ms  300samples      a moment of the run
//! jump2+200ms  quick-stop      a moment after the beginning of something: the second jump, the first stop
//! FROM  FROM..UNTIL            from a moment on, or until another; UNTIL counts from the beginning of the run,
//! FROM..+50ms                  or with a + from that of the fault
//! while=moving  while=lift-down    each time, for as long as it goes on
//! ```

use protocol::messages::Mode;
use protocol::time::{Duration, Instant, Period};

use super::duration;
use crate::text::allowed;

/// When a fault is in effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Window {
    /// From a moment on.
    From(Moment, End),
    /// As long as something goes on, each time.
    While(Episode),
}

/// The beginning of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// What has to begin first; `None` for the run.
    pub of: Option<Episode>,
    /// Time since then.
    pub after: Span,
}

/// The end of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// It stays.
    Never,
    /// This long after the beginning of the run.
    At(Span),
    /// This long after its own beginning.
    After(Span),
}

/// A length of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Span {
    /// As such.
    Time(Duration),
    /// In samples.
    Samples(u32),
}

impl Span {
    /// As a time, at this sampling period.
    pub fn time(self, period: Period) -> Duration {
        match self {
            Self::Time(time) => time,
            // Exact at every rate, as the time of that sample.
            Self::Samples(count) => period.sample(count.into()).since(Instant::ORIGIN),
        }
    }

    /// None of the same kind.
    fn none(self) -> Self {
        match self {
            Self::Time(_) => Self::Time(Duration::ZERO),
            Self::Samples(_) => Self::Samples(0),
        }
    }
}

/// Something that goes on for a while, and may do so again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Episode {
    /// What goes on.
    pub what: Activity,
    /// Which time, counted from 1; `None` for the first, or with `while` for every time.
    pub number: Option<u32>,
}

/// What can go on during a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// The controller is in this state.
    Mode(Mode),
    /// A move of any kind is under way.
    Move,
    /// A jump is.
    Jump,
    /// A line is.
    Line,
    /// An arc is.
    Arc,
    /// A move in joint space is.
    Joints,
    /// A cycle of the scenario is.
    Cycle,
    /// The lift goes down.
    LiftDown,
    /// The lift goes up.
    LiftUp,
}

/// Those that have names of their own; the others are states of the controller.
const ACTIVITIES: [(&str, Activity); 8] = [
    ("move", Activity::Move),
    ("jump", Activity::Jump),
    ("line", Activity::Line),
    ("arc", Activity::Arc),
    ("joints", Activity::Joints),
    ("cycle", Activity::Cycle),
    ("lift-down", Activity::LiftDown),
    ("lift-up", Activity::LiftUp),
];

impl Window {
    /// Beginning and end, where they do not depend on what happens.
    pub fn fixed(&self, period: Period) -> Option<(Instant, Instant)> {
        match self {
            Self::From(Moment { of: None, after }, end) => {
                let from = Instant::ORIGIN + after.time(period);
                Some((from, end.of(from, period)))
            }
            _ => None,
        }
    }

    /// Whether it is certain to end no later than it begins: times and samples compare with a rate alone.
    pub(crate) fn is_empty(&self, period: Period) -> bool {
        self.fixed(period)
            .is_some_and(|(from, until)| until <= from)
    }

    /// Reads what follows the `@`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        if let Some(episode) = text.strip_prefix("while=") {
            return Ok(Self::While(Episode::parse(episode)?));
        }
        let (from, until) = match text.split_once("..") {
            Some((from, until)) => (from, Some(until)),
            None => (text, None),
        };
        let from = Moment::parse(from)?;
        let end = match until {
            None => End::Never,
            Some(until) => match until.strip_prefix('+') {
                Some(after) => End::After(span(after)?),
                None => End::At(span(until)?),
            },
        };
        let backwards = match (from.of, end) {
            (_, End::After(span)) => is_before(span, span.none()),
            (None, End::At(until)) => is_before(until, from.after),
            _ => false,
        };
        if backwards {
            return Err(format!("{text} is empty: it has to end after it begins"));
        }
        Ok(Self::From(from, end))
    }
}

/// Whether an end is certainly no later than a beginning. Times and samples compare only with a rate.
fn is_before(end: Span, begin: Span) -> bool {
    match (end, begin) {
        (Span::Time(end), Span::Time(begin)) => end <= begin,
        (Span::Samples(end), Span::Samples(begin)) => end <= begin,
        _ => false,
    }
}

impl End {
    /// The end of a fault that began at `from`.
    pub(super) fn of(self, from: Instant, period: Period) -> Instant {
        match self {
            Self::Never => Instant::MAX,
            Self::At(span) => Instant::ORIGIN + span.time(period),
            Self::After(span) => from + span.time(period),
        }
    }
}

impl Moment {
    fn parse(text: &str) -> Result<Self, String> {
        let (of, after) = match text.split_once('+') {
            Some((episode, after)) => (Some(episode), span(after)?),
            None if text.starts_with(|first: char| first.is_ascii_lowercase()) => {
                (Some(text), Span::Time(Duration::ZERO))
            }
            None => (None, span(text)?),
        };
        Ok(Self {
            of: of.map(Episode::parse).transpose()?,
            after,
        })
    }
}

impl Episode {
    fn parse(text: &str) -> Result<Self, String> {
        let name = text.trim_end_matches(|last: char| last.is_ascii_digit());
        let number = &text[name.len()..];
        let known = ACTIVITIES.iter().find(|(known, _)| *known == name);
        let what = match (known, Mode::from_name(name)) {
            (Some((_, what)), _) => *what,
            (None, Some(mode)) => Activity::Mode(mode),
            (None, None) => {
                let activities = ACTIVITIES.iter().map(|(name, _)| *name);
                let modes = Mode::ALL.iter().map(|mode| mode.name());
                let all: Vec<&str> = activities.chain(modes).collect();
                return Err(format!(
                    "there is no event {name:?}; allowed: {}",
                    allowed(name, &all)
                ));
            }
        };
        let number = match number {
            "" => None,
            digits => match digits.parse() {
                Ok(number @ 1..) => Some(number),
                _ => {
                    return Err(format!(
                        "{text} is number {digits} of its kind; allowed: a whole number from 1 to {}, as in {name}2",
                        u32::MAX
                    ));
                }
            },
        };
        Ok(Self { what, number })
    }
}

/// `0.3s`, `300ms` or `300samples`.
fn span(text: &str) -> Result<Span, String> {
    if let Some(number) = text.strip_suffix("samples") {
        return number.parse().map(Span::Samples).map_err(|_| {
            format!(
                "{text:?} is not a number of samples; allowed: a whole number from 0 to {}, as 300samples",
                u32::MAX
            )
        });
    }
    let (number, scale) = match text.strip_suffix("ms") {
        Some(number) => (number, 1e-3),
        None => (text.strip_suffix('s').unwrap_or(""), 1.0),
    };
    match number.parse::<f64>() {
        Ok(number) if (0.0..=1e6).contains(&(number * scale)) => {
            Ok(Span::Time(duration(number * scale)))
        }
        _ => Err(format!(
            "{text:?} is not a time; allowed: seconds as 0.3s or milliseconds as 300ms, up to a million seconds, samples as 300samples"
        )),
    }
}
