//! Allowed values of numbers in inputs.

pub(crate) mod schema;

use std::fmt;

/// Allowed values of a number: finite and in a range.
#[derive(Clone, Copy)]
pub(crate) struct Allowed {
    low: f64,
    /// Whether `low` itself is excluded.
    above: bool,
    high: f64,
    unit: &'static str,
}

impl Allowed {
    /// Any finite number.
    pub(crate) const FINITE: Self = Self::within(f64::MIN, f64::MAX, "");

    /// From `low` to `high`.
    pub(crate) const fn within(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            low,
            above: false,
            high,
            unit,
        }
    }

    /// More than 0, up to `high`.
    pub(crate) const fn above_zero(high: f64, unit: &'static str) -> Self {
        Self {
            low: 0.0,
            above: true,
            high,
            unit,
        }
    }

    /// The number, if allowed.
    ///
    /// # Errors
    /// What is allowed, and the mistaken unit that would explain the number, if any.
    pub(crate) fn check(self, number: f64) -> Result<f64, String> {
        if self.admits(number) {
            return Ok(number);
        }
        Err(match self.slip(number) {
            Some(slip) => format!("{self}; {slip}"),
            None => self.to_string(),
        })
    }

    /// What the controller's numbers do not tell from zero is not above it.
    fn admits(self, number: f64) -> bool {
        (self.low..=self.high).contains(&number) && !(self.above && number as f32 <= 0.0)
    }

    /// The mistaken unit that would explain a number, if any: millimetres, degrees or per cent.
    pub(crate) fn slip(self, number: f64) -> Option<String> {
        match self.unit {
            "m" if self.admits(number / 1000.0) && number.abs() >= 10.0 => Some(format!(
                "lengths are in m: {number} mm is {}",
                number / 1000.0
            )),
            "rad" if self.admits(number.to_radians()) => Some(format!(
                "angles are in rad: {number} degrees is {:.6}",
                number.to_radians()
            )),
            "m/s" if self.admits(number / 1000.0) => Some(format!(
                "speeds are in m/s: {number} mm/s is {}",
                number / 1000.0
            )),
            "of full speed" | "of the planned speed" if self.admits(number / 100.0) => Some(
                format!("speeds are shares of 1: {number} % is {}", number / 100.0),
            ),
            _ => None,
        }
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            low,
            above,
            high,
            unit,
        } = *self;
        let space = if unit.is_empty() { "" } else { " " };
        match (low, high) {
            (f64::MIN, f64::MAX) => f.write_str("a finite number"),
            _ if above => write!(f, "a number > {low}, at most {high}{space}{unit}"),
            (0.0, _) => write!(f, "a number >= 0, at most {high}{space}{unit}"),
            _ => write!(f, "a number from {low} to {high}{space}{unit}"),
        }
    }
}

/// Mass of a payload, as limited by the message.
pub(crate) const PAYLOAD_MASS: Allowed = Allowed::within(0.0, 100.0, "kg");
/// Centre of mass of a payload, as limited by the message.
pub(crate) const PAYLOAD_COM: Allowed = Allowed::within(-1.0, 1.0, "m");
/// Moments of inertia of a payload, as limited by the message.
pub(crate) const PAYLOAD_INERTIA: Allowed = Allowed::within(0.0, 10.0, "kg m2");

/// Checks that a payload with inertia has mass.
///
/// # Errors
/// What is allowed for the moments of inertia.
pub(crate) fn check_mass(mass: f64, moments: [f64; 3]) -> Result<(), &'static str> {
    if mass == 0.0 && moments != [0.0; 3] {
        return Err("zeros, since it weighs nothing");
    }
    Ok(())
}

/// Checks principal moments of inertia against the triangle inequality: no body has one greater than the sum of the
/// other two.
///
/// # Errors
/// The axis of the moment that is too great, and what is allowed.
pub(crate) fn check_moments(moments: [f64; 3]) -> Result<(), (usize, String)> {
    // Model files carry rounded decimals.
    const ROUNDING: f64 = 1e-9;
    let sum: f64 = moments.iter().sum();
    for (axis, moment) in moments.into_iter().enumerate() {
        let others = sum - moment;
        if moment > others * (1.0 + ROUNDING) {
            return Err((
                axis,
                format!("at most the sum of the other two moments, {others}: no body has more"),
            ));
        }
    }
    Ok(())
}
