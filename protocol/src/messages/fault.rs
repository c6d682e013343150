//! A fault with its axis and number, and its text.

use core::fmt::{self, Write};

use super::{Cause, DriveStatus};
use crate::codes::codes;

codes! {
    /// Axis of a fault.
    pub enum FaultAxis {
        /// No single axis.
        None = 0, "none";
        /// Axis 1: turns arm 1.
        Shoulder = 1, "shoulder";
        /// Axis 2: turns arm 2.
        Elbow = 2, "elbow";
        /// Axis 3: moves the shaft along z.
        Lift = 3, "lift";
        /// Axis 4: turns the shaft.
        Wrist = 4, "wrist";
        /// No axis, but the tool.
        Tool = 5, "tool";
    }
}

codes! {
    /// Known answers of the self-test.
    pub enum KnownAnswer {
        /// Sine and cosine of an angle.
        Sine = 1, "sine";
        /// Pose of a joint position, and its inverse.
        Kinematics = 2, "kinematics";
        /// Check values of the end-to-end CRCs.
        Crc = 3, "crc";
        /// Every number of the robot model is in its range.
        Model = 4, "model";
    }
}

/// A fault as [`State`](super::State) reports it while it is latched.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fault {
    /// What is wrong.
    pub cause: Cause,
    /// Axis concerned, if it is a single one.
    pub axis: FaultAxis,
    /// Value found, in [`Fault::unit`].
    pub value: f32,
    /// Limit, in the same unit; 0 if the cause has none.
    pub limit: f32,
}

/// Unit of a fault's number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// There is no number.
    None,
    /// Angle, rad.
    Radian,
    /// Length, m.
    Metre,
    /// Angle or length: the axis is not known.
    RadianOrMetre,
    /// rad/s.
    RadianPerSecond,
    /// m/s.
    MetrePerSecond,
    /// rad/s or m/s: the axis is not known.
    SpeedOfAxis,
    /// N m.
    NewtonMetre,
    /// N.
    Newton,
    /// N m or N: the axis is not known.
    Effort,
    /// Share, %.
    Percent,
    /// ms.
    Millisecond,
    /// Consecutive frames.
    Frame,
    /// Consecutive samples.
    Sample,
    /// Bits of a [`DriveStatus`].
    DriveStatus,
    /// Code of a [`KnownAnswer`].
    KnownAnswer,
    /// Identifier of a frame.
    Identifier,
}

impl Unit {
    /// Symbol of the unit on the wire; empty where the number is a code.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::None | Self::DriveStatus | Self::KnownAnswer | Self::Identifier => "",
            Self::Radian => "rad",
            Self::Metre => "m",
            Self::RadianOrMetre => "rad or m",
            Self::RadianPerSecond => "rad/s",
            Self::MetrePerSecond => "m/s",
            Self::SpeedOfAxis => "rad/s or m/s",
            Self::NewtonMetre => "N m",
            Self::Newton => "N",
            Self::Effort => "N m or N",
            Self::Percent => "%",
            Self::Millisecond => "ms",
            Self::Frame => "frames",
            Self::Sample => "samples",
        }
    }

    /// Digits after the point of a number in this unit.
    const fn digits(self) -> usize {
        match self {
            Self::RadianOrMetre | Self::SpeedOfAxis => 4,
            Self::Radian => 3,
            Self::RadianPerSecond | Self::MetrePerSecond => 2,
            Self::Metre | Self::Millisecond | Self::NewtonMetre | Self::Newton | Self::Effort => 1,
            _ => 0,
        }
    }

    /// The number as it is shown.
    fn scaled(self, value: f32) -> f32 {
        match self {
            Self::Metre => value * 1e3,
            _ => value,
        }
    }

    /// What leads from a value to its limit: of a status, to what is missing in it.
    const fn before_limit(self) -> &'static str {
        match self {
            Self::DriveStatus => ", not",
            _ => ", limit ",
        }
    }

    fn show(self, value: f32, digits: usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => Ok(()),
            Self::Metre => write!(f, "{value:.digits$} mm"),
            Self::Frame | Self::Sample => {
                write!(f, "{value:.digits$} {} in a row", self.symbol())
            }
            Self::DriveStatus => {
                let mut bits = value as u8;
                for name in DriveStatus::NAMES {
                    if bits & 1 == 1 {
                        write!(f, " {name}")?;
                    }
                    bits >>= 1;
                }
                Ok(())
            }
            Self::KnownAnswer => match KnownAnswer::try_from(value as u8) {
                Ok(answer) => f.write_str(answer.name()),
                Err(unknown) => write!(f, "{unknown}"),
            },
            Self::Identifier => write!(f, "identifier {:#05x}", value as u16),
            _ => write!(f, "{value:.digits$} {}", self.symbol()),
        }
    }
}

/// Whether a number can be the bits of a [`DriveStatus`], and not a jump of an encoder whose axis an emergency does not tell.
const fn is_status(value: f32) -> bool {
    value != 0.0 && value == value as u8 as f32
}

/// `digits` after the point, or as many more, up to three, as it takes to tell the two numbers apart.
fn telling_apart(a: f32, b: f32, digits: usize) -> usize {
    let differ = |digits: &usize| {
        let scale = (0..*digits).fold(1.0, |scale, _| scale * 10.0);
        let rounded = |number: f32| (f64::from(number.abs()) * scale + 0.5) as u64;
        rounded(a) != rounded(b)
    };
    (digits..=digits + 3).find(differ).unwrap_or(digits)
}

impl Fault {
    /// Nothing is wrong.
    pub const NONE: Self = Self::because(Cause::None);

    /// A fault that has neither axis nor number.
    #[must_use]
    pub const fn because(cause: Cause) -> Self {
        Self::value(cause, 0.0, 0.0)
    }

    /// A fault of no single axis; `limit` is 0 if there is none.
    #[must_use]
    pub const fn value(cause: Cause, value: f32, limit: f32) -> Self {
        Self {
            cause,
            axis: FaultAxis::None,
            value,
            limit,
        }
    }

    /// Unit of value and limit.
    #[must_use]
    pub const fn unit(&self) -> Unit {
        use FaultAxis::{Lift, None, Tool};
        match (self.cause, self.axis) {
            (Cause::SelfTest, _) => Unit::KnownAnswer,
            (Cause::DuplicateNode, _) => Unit::Identifier,
            (Cause::DriveFault, _) => Unit::DriveStatus,
            (Cause::EncoderFault, None) if is_status(self.value) => Unit::DriveStatus,
            (
                Cause::FeedbackLost | Cause::PeerSilent | Cause::OperatorSilent | Cause::OverTorque,
                _,
            ) => Unit::Millisecond,
            (
                Cause::Babbling
                | Cause::Reordered
                | Cause::Late
                | Cause::Corrupted
                | Cause::BadValue,
                _,
            ) => Unit::Frame,
            (
                Cause::FollowingError | Cause::SoftLimit | Cause::StuckSensor | Cause::EncoderFault,
                None,
            ) => Unit::RadianOrMetre,
            (
                Cause::FollowingError | Cause::SoftLimit | Cause::StuckSensor | Cause::EncoderFault,
                axis,
            ) => match axis {
                Lift => Unit::Metre,
                _ => Unit::Radian,
            },
            (Cause::Collision, None) => Unit::Effort,
            (Cause::Collision, Lift) => Unit::Newton,
            (Cause::Collision, _) => Unit::NewtonMetre,
            (Cause::Chatter | Cause::Overload, _) => Unit::Percent,
            (Cause::OverSpeed, None) => Unit::SpeedOfAxis,
            (Cause::OverSpeed, Lift | Tool) => Unit::MetrePerSecond,
            (Cause::OverSpeed, _) => Unit::RadianPerSecond,
            (Cause::Overrun, _) => Unit::Sample,
            (Cause::None | Cause::BusOff | Cause::EStop, _) => Unit::None,
        }
    }
}

/// As in "following error, axis 3 (lift): 2.1 mm, limit 2.0 mm".
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.cause.name().chars() {
            f.write_char(if c == '-' { ' ' } else { c })?;
        }
        match self.axis {
            FaultAxis::None => {}
            FaultAxis::Tool => write!(f, ", {}", self.axis)?,
            axis => write!(f, ", axis {} ({axis})", axis.code())?,
        }
        let unit = self.unit();
        if unit != Unit::None && self.value != 0.0 {
            f.write_str(if unit == Unit::DriveStatus {
                ": drive status"
            } else {
                ": "
            })?;
            let (value, limit) = (unit.scaled(self.value), unit.scaled(self.limit));
            let mut digits = unit.digits();
            if limit != 0.0 {
                digits = telling_apart(value, limit, digits);
            }
            unit.show(value, digits, f)?;
            if limit != 0.0 {
                f.write_str(unit.before_limit())?;
                unit.show(limit, digits, f)?;
            }
        }
        Ok(())
    }
}
