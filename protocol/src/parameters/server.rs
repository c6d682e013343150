//! Parameter server, the same for every node that has parameters.

use super::{ControllerParameter, DriveParameter, Rule};
use crate::messages::{ParameterError, ParameterReply, ParameterRequest};

/// Where a value is stored.
pub enum Field<'a> {
    /// Not stored: a reading, which is [never settable](super::Settable::Never).
    Reading(f32),
    /// A real number.
    Real(&'a mut f32),
    /// A whole number.
    Whole(&'a mut u32),
}

impl Field<'_> {
    fn get(&self) -> f32 {
        match self {
            Self::Reading(value) => *value,
            Self::Real(value) => **value,
            Self::Whole(value) => **value as f32,
        }
    }

    fn set(&mut self, new: f32) {
        match self {
            Self::Reading(_) => {}
            Self::Real(value) => **value = new,
            Self::Whole(value) => **value = new as u32,
        }
    }
}

/// A node with parameters.
pub trait Store {
    /// Its parameters.
    type Parameter: Listed;

    /// Sampling period, s.
    fn period(&self) -> f32;

    /// Whether parameters that are [settable at rest](super::Settable::AtRest) may be written now.
    fn is_at_rest(&self) -> bool;

    /// Where this parameter is stored.
    fn field(&mut self, parameter: Self::Parameter) -> Field<'_>;

    /// Accepts a value within the range of this parameter, which the values of other parameters may narrow down.
    ///
    /// # Errors
    /// The limit.
    fn check(&self, _: Self::Parameter, _value: f32) -> Result<(), f32> {
        Ok(())
    }

    /// Called after this parameter has been written.
    fn changed(&mut self, parameter: Self::Parameter);
}

/// The parameters of one node.
pub trait Listed: Copy + PartialEq + 'static {
    /// Every one, by number.
    const ALL: &'static [Self];
    /// Their numbers and ranges, in the same order.
    const RULES: &'static [Rule];
}

impl Listed for ControllerParameter {
    const ALL: &'static [Self] = Self::ALL;
    const RULES: &'static [Rule] = Self::RULES;
}

impl Listed for DriveParameter {
    const ALL: &'static [Self] = Self::ALL;
    const RULES: &'static [Rule] = Self::RULES;
}

/// Executes a request and answers; `None` for [`ParameterRequest::Hello`], which concerns no parameter. The work is one
/// search by bisection.
pub fn serve<S: Store>(store: &mut S, request: &ParameterRequest) -> Option<ParameterReply> {
    let (index, new, exact) = match *request {
        ParameterRequest::Get { index } => (index, None, true),
        ParameterRequest::Set { index, value } => (index, Some(value), true),
        ParameterRequest::List { from } => (from, None, false),
        ParameterRequest::Hello(_) => return None,
    };
    let refuse = |error, limit| {
        Some(ParameterReply::Error {
            index,
            error,
            limit,
        })
    };
    let rules = S::Parameter::RULES;
    let position = rules.partition_point(|rule| rule.number < index);
    let (Some(rule), Some(&parameter)) = (rules.get(position), S::Parameter::ALL.get(position))
    else {
        return refuse(ParameterError::NotFound, 0.0);
    };
    if exact && rule.number != index {
        return refuse(ParameterError::NotFound, 0.0);
    }
    let period = store.period();
    if let Some(value) = new
        && let Err((error, limit)) = rule.check_change(value, period, store.is_at_rest())
    {
        return refuse(error, limit);
    }
    if let Some(value) = new
        && let Err(limit) = store.check(parameter, value)
    {
        return refuse(ParameterError::OutOfRange, limit);
    }
    let mut field = store.field(parameter);
    if let Some(value) = new {
        field.set(value);
    }
    let value = field.get();
    if new.is_some() {
        store.changed(parameter);
    }
    Some(ParameterReply::Value {
        index: rule.number,
        value,
        lower: rule.lower,
        upper: rule.upper_at(period),
    })
}
