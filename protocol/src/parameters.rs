//! The parameter table: what can be read and written by number over the bus, and when.
//!
//! Numbers, names, units, ranges and defaults are here and nowhere else: both servers answer from it ([`serve`]),
//! and the command-line listing, `docs/parameters.md` and the comments of the DBC are generated from it. A number never
//! changes its meaning; new parameters get new numbers.
//!
//! The controller answers the operator. Numbers from [`DRIVES`] on belong to the drives: the controller forwards
//! requests for them and returns the answers, so that each identifier keeps a single sender.
//!
//! A new value takes effect from the next sample until its node restarts; a restart restores the defaults.

mod list;
mod server;

pub use list::{ControllerParameter, DriveParameter};
pub use server::{Field, Listed, Store, serve};

use crate::messages::{ParameterError, Server};

/// First parameter number of the drives.
pub const DRIVES: u16 = 0x1000;

/// When a parameter may be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Settable {
    /// Never: it is a reading, or fixed when the node is built.
    Never,
    /// While the arm is at rest: for the controller, without torque and fault, or enabled without a move; for the
    /// drives, without torque. Parameters that change torques or the timing of the brake are of this kind.
    AtRest,
    /// In every state. Parameters that only decide when to stop the arm are of this kind.
    Always,
}

impl Settable {
    /// Its text.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Never => "never",
            Self::AtRest => "at rest",
            Self::Always => "always",
        }
    }
}

/// Which values within its range a parameter can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// All.
    Real,
    /// Whole numbers.
    Whole,
    /// A corner frequency (rad/s) of the loop: all, up to a quarter of a radian per sample. Beyond that, no phase
    /// margin is left for the delays of sampling and bus.
    Corner,
}

/// Bound of a [`Kind::Corner`], rad per sample.
pub const CORNER_PER_SAMPLE: f32 = 0.25;

/// What a server needs to know about a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Number on the wire.
    pub number: u16,
    /// When it may be written.
    pub settable: Settable,
    /// Which values within its range it can have.
    pub kind: Kind,
    /// Least value.
    pub lower: f32,
    /// Greatest value, at any sampling rate.
    pub upper: f32,
}

impl Rule {
    /// Greatest value at a sampling period (s, positive).
    #[must_use]
    pub const fn upper_at(&self, period: f32) -> f32 {
        if matches!(self.kind, Kind::Corner) {
            // Rates are whole numbers of hertz; their periods are inexact and would turn 250 into 249.99998.
            let rate = (1.0 / period + 0.5) as u32 as f32;
            least(self.upper, CORNER_PER_SAMPLE * rate)
        } else {
            self.upper
        }
    }

    /// Accepts a value by its range alone.
    ///
    /// # Errors
    /// The bound that it violates; for a fraction where whole numbers are allowed, the whole number below it. NaN
    /// violates the lower bound.
    pub const fn check(&self, value: f32, period: f32) -> Result<(), f32> {
        let upper = self.upper_at(period);
        if value.is_nan() || value < self.lower {
            return Err(self.lower);
        }
        if value > upper {
            return Err(upper);
        }
        let below = value as u32 as f32;
        if matches!(self.kind, Kind::Whole) && value > below {
            return Err(below);
        }
        Ok(())
    }

    /// Accepts a value, or returns why not.
    ///
    /// # Errors
    /// The reason, with the bound violated where it is [`ParameterError::OutOfRange`], otherwise 0.
    pub const fn check_change(
        &self,
        value: f32,
        period: f32,
        at_rest: bool,
    ) -> Result<(), (ParameterError, f32)> {
        if matches!(self.settable, Settable::Never) {
            return Err((ParameterError::ReadOnly, 0.0));
        }
        if let Err(limit) = self.check(value, period) {
            return Err((ParameterError::OutOfRange, limit));
        }
        if matches!(self.settable, Settable::AtRest) && !at_rest {
            return Err((ParameterError::NotNow, 0.0));
        }
        Ok(())
    }
}

/// Value at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Default {
    /// The value.
    pub most: f32,
    /// For a corner frequency, its limit in rad per sample, so that slow sampling reduces it. Infinite for anything
    /// that does not depend on sampling.
    pub per_sample: f32,
    /// For a number of samples, the time that they last at least, s, so that fast sampling makes them more. 0 for anything else.
    pub lasts: f32,
}

impl Default {
    /// The value at a sampling period (s, positive).
    #[must_use]
    pub const fn at(self, period: f32) -> f32 {
        let value = least(self.most, self.per_sample / period);
        // Rounded up, but for what the period is inexact by.
        let samples = (self.lasts / period + 0.999) as u32 as f32;
        if samples > value { samples } else { value }
    }
}

/// The smaller of two numbers. `f32::min` handles NaN, which costs an image more than the rest of the check.
const fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Number, range, and when it may be written.
    pub rule: Rule,
    /// Name, unique among all servers: lower case with hyphens.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// One sentence for a person.
    pub about: &'static str,
    /// Value at the start, unless the node is built for another; `None` for a reading.
    pub default: Option<Default>,
}

impl Parameter {
    /// Node that the parameter belongs to.
    #[must_use]
    pub const fn server(&self) -> Server {
        if self.rule.number < DRIVES {
            Server::Controller
        } else {
            Server::Drives
        }
    }
}

/// Every parameter of both servers, by number.
pub fn all() -> impl Iterator<Item = &'static Parameter> {
    ControllerParameter::TABLE
        .iter()
        .chain(DriveParameter::TABLE)
}

/// Parameter of this name, or `None`.
#[must_use]
pub fn named(name: &str) -> Option<&'static Parameter> {
    all().find(|parameter| parameter.name == name)
}

/// Parameter of this number, or `None`.
#[must_use]
pub fn numbered(number: u16) -> Option<&'static Parameter> {
    all().find(|parameter| parameter.rule.number == number)
}

/// The numbers ascend, and every default is allowed, at the slowest and the fastest sampling.
const _: () = {
    check_table(ControllerParameter::TABLE, 0, DRIVES - 1);
    check_table(DriveParameter::TABLE, DRIVES, u16::MAX);
};

const fn check_table(mut table: &[Parameter], first: u16, last: u16) {
    let mut least = first as u32;
    while let [parameter, rest @ ..] = table {
        let rule = &parameter.rule;
        assert!(rule.number as u32 >= least && rule.number <= last);
        least = rule.number as u32 + 1;
        assert!(rule.lower.is_finite() && rule.upper.is_finite());
        // `Rule::check` distinguishes whole numbers from fractions as u32.
        assert!(!matches!(rule.kind, Kind::Whole) || rule.lower >= 0.0);
        if let Some(default) = parameter.default {
            assert!(rule.check(default.at(1e-4), 1e-4).is_ok());
            assert!(rule.check(default.at(1e-2), 1e-2).is_ok());
        }
        table = rest;
    }
}
