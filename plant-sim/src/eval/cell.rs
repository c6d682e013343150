//! Results and their text form.

use nalgebra::Vector4;

use super::Elbow;
use std::fmt;

/// One result.
pub(super) enum Cell {
    Double(f64),
    Single(f32),
    Flag(bool),
    Text(&'static str),
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Double(number)
    }
}

impl From<f32> for Cell {
    fn from(number: f32) -> Self {
        Self::Single(number)
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Double(number) if number.is_nan() => f.write_str("nan"),
            Self::Single(number) if number.is_nan() => f.write_str("nan"),
            // The debug form round-trips like the plain one, but writes 1e-300 with seven characters.
            Self::Double(number) => write!(f, "{number:?}"),
            Self::Single(number) => write!(f, "{number:?}"),
            Self::Flag(flag) => write!(f, "{}", u8::from(*flag)),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// Whether a pose can be reached; of two solutions the better one decides, which is the
/// lesser in this order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reach {
    Ok,
    TooFar,
    InsideHole,
    Joint2Limit,
    Joint1Limit,
    ZHigh,
    ZLow,
    Joint4Limit,
}

impl Reach {
    fn label(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::TooFar => "too_far",
            Self::InsideHole => "inside_hole",
            Self::Joint2Limit => "joint2_limit",
            Self::Joint1Limit => "joint1_limit",
            Self::ZHigh => "z_high",
            Self::ZLow => "z_low",
            Self::Joint4Limit => "joint4_limit",
        }
    }
}

/// Results of inverse kinematics: the solutions with `theta2 >= 0` and with `theta2 <= 0`, the determinant of the
/// Jacobian at the first, and how well the pose determines theta2. The reason is that of the elbow asked for, or of the better
/// one.
pub(super) fn ik_cells<T: Into<Cell> + Copy>(
    solutions: [(Vector4<T>, Reach); 2],
    elbow: Option<Elbow>,
    determinant: T,
    tolerance: T,
) -> Vec<Cell> {
    let [(_, a), (_, b)] = solutions;
    let reach = match elbow {
        None => a.min(b),
        Some(Elbow::Positive) => a,
        Some(Elbow::Negative) => b,
    };
    let mut cells = vec![Cell::Text(reach.label())];
    for (q, reach) in solutions {
        cells.extend(q.iter().map(|&x| x.into()));
        cells.push(Cell::Flag(reach == Reach::Ok));
    }
    cells.extend([determinant.into(), tolerance.into()]);
    cells
}
