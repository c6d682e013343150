//! Validation of a model before the controller uses it.

use core::fmt;

use nalgebra::{Vector3, Vector4};

use super::{ArmModel, Axis, DriveTrain, JointLimits, Link, Payload};

/// A number in a model that the controller cannot use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelError {
    /// Name of the field, e.g. `link.mass`.
    pub field: &'static str,
    /// The axis, or the link it drives; none for a field that belongs to no axis.
    pub axis: Option<Axis>,
    /// The value found.
    pub value: f32,
    /// The rule that it breaks.
    pub rule: Rule,
}

/// Requirement on a number of a model. All of them imply that it is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Any finite number.
    Finite,
    /// Greater than zero.
    Positive,
    /// Zero or greater.
    NotNegative,
    /// Greater than the given lower limit.
    Above(f32),
    /// At most the given value.
    AtMost(f32),
    /// +1 or -1.
    Sign,
}

impl Rule {
    fn allows(self, value: f32) -> bool {
        value.is_finite()
            && match self {
                Self::Finite => true,
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Above(lower) => value > lower,
                Self::AtMost(upper) => value <= upper,
                Self::Sign => value.abs() == 1.0,
            }
    }

    // Out of line, like the next two: inlined they would be kilobytes that run once.
    #[inline(never)]
    fn check(self, field: &'static str, axis: Option<Axis>, value: f32) -> Result<(), ModelError> {
        if self.allows(value) {
            Ok(())
        } else {
            Err(ModelError {
                field,
                axis,
                value,
                rule: self,
            })
        }
    }

    #[inline(never)]
    fn check_joint(self, field: &'static str, joint: &Vector4<f32>) -> Result<(), ModelError> {
        Axis::ALL
            .into_iter()
            .try_for_each(|axis| self.check(field, Some(axis), axis.of(joint)))
    }

    #[inline(never)]
    fn check_vector(
        self,
        field: &'static str,
        axis: Option<Axis>,
        vector: &Vector3<f32>,
    ) -> Result<(), ModelError> {
        vector
            .iter()
            .try_for_each(|&value| self.check(field, axis, value))
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.field)?;
        if let Some(axis) = self.axis {
            write!(f, " of the {axis:?} axis")?;
        }
        write!(f, " is {}, but has to be ", self.value)?;
        match self.rule {
            Rule::Finite => write!(f, "finite"),
            Rule::Positive => write!(f, "finite and greater than zero"),
            Rule::NotNegative => write!(f, "finite and not negative"),
            Rule::Above(lower) => write!(f, "finite and greater than the lower limit {lower}"),
            Rule::AtMost(upper) => write!(f, "at most {upper}"),
            Rule::Sign => write!(f, "+1 or -1"),
        }
    }
}

impl core::error::Error for ModelError {}

impl ArmModel {
    /// Checks every number of the model.
    ///
    /// # Errors
    ///
    /// The first field, in the order of the struct, that breaks its [`Rule`].
    pub fn validate(&self) -> Result<(), ModelError> {
        Rule::Positive.check("geometry.a1", None, self.geometry.a1)?;
        Rule::Positive.check("geometry.a2", None, self.geometry.a2)?;
        Rule::Finite.check("geometry.d1", None, self.geometry.d1)?;
        Rule::Finite.check("geometry.d4", None, self.geometry.d4)?;
        Axis::ALL
            .into_iter()
            .zip(&self.links)
            .try_for_each(|(axis, link)| link.validate(axis))?;
        Rule::NotNegative.check("gravity", None, self.gravity)?;
        self.limits.validate()?;
        self.drive.validate()?;
        Rule::NotNegative.check("payload_max", None, self.payload_max)
    }

    /// Checks that the arm may carry `payload`.
    ///
    /// # Errors
    ///
    /// The first field that is negative or not finite, or the mass if it exceeds `payload_max`.
    pub fn validate_payload(&self, payload: &Payload) -> Result<(), ModelError> {
        Rule::NotNegative.check("payload.mass", None, payload.mass)?;
        Rule::AtMost(self.payload_max).check("payload.mass", None, payload.mass)?;
        Rule::Finite.check_vector("payload.com", None, &payload.com)?;
        Rule::NotNegative.check_vector("payload.inertia", None, &payload.inertia)
    }
}

impl Link {
    fn validate(&self, axis: Axis) -> Result<(), ModelError> {
        Rule::Positive.check("link.mass", Some(axis), self.mass)?;
        Rule::Finite.check_vector("link.com", Some(axis), &self.com)?;
        // Not zero: without inertia of the shaft the mass matrix would be singular.
        Rule::Positive.check_vector("link.inertia", Some(axis), &self.inertia)
    }
}

impl JointLimits {
    fn validate(&self) -> Result<(), ModelError> {
        Rule::Finite.check_joint("limits.lower", &self.lower)?;
        for axis in Axis::ALL {
            let above_lower = Rule::Above(axis.of(&self.lower));
            above_lower.check("limits.upper", Some(axis), axis.of(&self.upper))?;
        }
        Rule::Positive.check_joint("limits.velocity", &self.velocity)?;
        Rule::Positive.check_joint("limits.acceleration", &self.acceleration)?;
        Rule::Positive.check_joint("limits.jerk", &self.jerk)?;
        Rule::Positive.check_joint("limits.effort", &self.effort)?;
        // In less than that no motor takes up its torque, and the rates would not be numbers any more.
        Rule::Above(1e-5).check_joint("limits.effort_rise_time", &self.effort_rise_time)?;
        Rule::Positive.check_joint("limits.effort_continuous", &self.effort_continuous)
    }
}

impl DriveTrain {
    fn validate(&self) -> Result<(), ModelError> {
        Rule::Positive.check_joint("drive.gear_ratio", &self.gear_ratio)?;
        Rule::Positive.check("drive.screw_lead", None, self.screw_lead)?;
        Rule::Sign.check("drive.screw_hand", None, self.screw_hand)?;
        Rule::NotNegative.check_joint("drive.rotor_inertia", &self.rotor_inertia)?;
        Rule::Positive.check_joint("drive.motor_torque_limit", &self.motor_torque_limit)?;
        Rule::Positive.check_joint("drive.motor_torque_rated", &self.motor_torque_rated)?;
        Rule::Positive.check_joint("drive.motor_speed_limit", &self.motor_speed_limit)?;
        Rule::NotNegative.check_joint("drive.viscous", &self.viscous)?;
        Rule::NotNegative.check_joint("drive.coulomb", &self.coulomb)?;
        Rule::Positive.check_joint("drive.coulomb_eps", &self.coulomb_eps)?;
        // Up to 2^24 counts per turn every count is an f32; beyond that, rounding is still far below a count of the
        // load.
        Rule::Positive.check("drive.encoder_counts", None, self.encoder_counts as f32)
    }
}
