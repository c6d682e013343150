//! Selection of records of a trace by identifier, interface and time.

use std::str::FromStr;

use protocol::frame::{ExtendedId, Id, StandardId};
use protocol::table::TABLE;

use super::{Entry, Interface, Record};

/// Selection of records; without a criterion, all.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Identifiers; with any given, error frames are excluded.
    pub ids: Vec<Ids>,
    /// Interfaces.
    pub interfaces: Vec<Interface>,
    /// Earliest time.
    pub from: Option<Moment>,
    /// Latest time.
    pub to: Option<Moment>,
}

impl Selection {
    /// Whether no time can be selected, since the latest is before the earliest.
    #[must_use]
    pub fn is_backwards(&self) -> bool {
        match (self.from, self.to) {
            (Some(Moment::Absolute(from)), Some(Moment::Absolute(to)))
            | (Some(Moment::Relative(from)), Some(Moment::Relative(to))) => to < from,
            _ => false,
        }
    }

    /// Whether the record's interface is selected.
    #[must_use]
    pub fn interface(&self, record: &Record) -> bool {
        self.interfaces.is_empty() || self.interfaces.contains(&record.interface)
    }

    /// Whether the record's identifier is selected.
    #[must_use]
    pub fn id(&self, record: &Record) -> bool {
        let of_frame = |ids: &Ids| match &record.entry {
            Entry::Frame(frame) => ids.contain(frame.id()),
            Entry::Error(_) => false,
        };
        self.ids.is_empty() || self.ids.iter().any(of_frame)
    }

    /// Whether the record's time is selected, in a trace that begins at `first_us`.
    #[must_use]
    pub fn time(&self, record: &Record, first_us: u64) -> bool {
        let at = |moment: Moment| moment.time_us(first_us);
        self.from.is_none_or(|from| at(from) <= record.time_us)
            && self.to.is_none_or(|to| record.time_us <= at(to))
    }
}

/// Identifiers of one kind from one to another: `1C0`, `300-3FF`, `18FF0000-18FFFFFF`, or a message by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ids {
    first: Id,
    last: Id,
}

impl Ids {
    /// Identifiers order as in arbitration, which mixes both kinds: the kind is compared separately.
    fn contain(self, id: Id) -> bool {
        is_extended(id) == is_extended(self.first) && self.first <= id && id <= self.last
    }
}

fn is_extended(id: Id) -> bool {
    matches!(id, Id::Extended(_))
}

impl FromStr for Ids {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(info) = TABLE
            .iter()
            .find(|info| info.name.eq_ignore_ascii_case(text))
        {
            let id = StandardId::new(info.id)
                .map(Id::Standard)
                .ok_or("no such identifier")?;
            return Ok(Self {
                first: id,
                last: id,
            });
        }
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        let end = |end| {
            id(end).ok_or(
                "allowed: up to 3 hexadecimal digits (11 bits, to 7FF) or 8 (29 bits, to 1FFFFFFF), a range of them (300-3FF), \
                 or the name of a message",
            )
        };
        let ids = Self {
            first: end(first)?,
            last: end(last)?,
        };
        if is_extended(ids.first) != is_extended(ids.last) {
            return Err("one end of the range has 11 bits, the other 29".into());
        }
        if ids.first > ids.last {
            return Err("the range ends before it begins".into());
        }
        Ok(ids)
    }
}

fn id(text: &str) -> Option<Id> {
    let digits = text.strip_prefix("0x").unwrap_or(text);
    // from_str_radix alone would also take a sign.
    let is_hex = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    let raw = u32::from_str_radix(digits, 16).ok().filter(|_| is_hex)?;
    if digits.len() == 8 {
        ExtendedId::new(raw).map(Id::Extended)
    } else {
        let raw = u16::try_from(raw).ok().filter(|_| digits.len() <= 3)?;
        StandardId::new(raw).map(Id::Standard)
    }
}

/// A time: seconds as in the trace, or relative to its first record with a leading `+`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// As in the trace, us.
    Absolute(u64),
    /// After the first record, us.
    Relative(u64),
}

impl Moment {
    fn time_us(self, first_us: u64) -> u64 {
        match self {
            Self::Absolute(time_us) => time_us,
            Self::Relative(time_us) => first_us.saturating_add(time_us),
        }
    }
}

impl FromStr for Moment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (digits, relative) = match text.strip_prefix('+') {
            Some(digits) => (digits, true),
            None => (text, false),
        };
        let time_us = microseconds(digits)
            .ok_or("allowed: seconds as in the trace (12.5), or after its first record (+12.5)")?;
        Ok(if relative {
            Self::Relative(time_us)
        } else {
            Self::Absolute(time_us)
        })
    }
}

/// Microseconds of seconds with or without decimals, exact: a double has too few digits for the time since 1970.
fn microseconds(text: &str) -> Option<u64> {
    let with_point = if text.contains('.') {
        text.to_owned()
    } else {
        format!("{text}.0")
    };
    super::line::timestamp(with_point.as_bytes()).ok()
}
