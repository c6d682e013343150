//! Which of the joint positions that reach a pose is meant.

use serde::{Deserialize, Serialize};

use crate::codes::{UnknownCode, codes};

/// Which of the joint positions that reach a pose is meant: the side of the elbow, and the turn of the wrist. Zero on the
/// wire, as in frames of before these fields, is the one that is nearest to where the arm comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(into = "[u8; 2]", try_from = "[u8; 2]")]
pub struct Posture {
    /// Side of the elbow.
    pub elbow: ElbowSide,
    /// Turn of the wrist.
    pub turn: WristTurn,
}

impl Posture {
    /// The one that is nearest to where the arm comes from.
    pub const NEAREST: Self = Self {
        elbow: ElbowSide::Keep,
        turn: WristTurn::Nearest,
    };
}

impl From<Posture> for [u8; 2] {
    fn from(posture: Posture) -> Self {
        [posture.elbow.code(), posture.turn.code()]
    }
}

impl TryFrom<[u8; 2]> for Posture {
    type Error = UnknownCode;

    // Out of line: three requests have one.
    #[inline(never)]
    fn try_from([elbow, turn]: [u8; 2]) -> Result<Self, UnknownCode> {
        Ok(Self {
            elbow: elbow.try_into()?,
            turn: turn.try_into()?,
        })
    }
}

codes! {
    /// Side to which the elbow bends.
    pub enum ElbowSide {
        /// The side at which it is.
        Keep = 0, "keep";
        /// Positive: theta2 >= 0, as a right arm bends.
        Positive = 1, "positive";
        /// Negative: theta2 <= 0, as a left arm bends.
        Negative = 2, "negative";
    }
}

codes! {
    /// Turn of the wrist: the whole revolutions that are nearest to theta4. Turn 0 is -pi < theta4 <= pi.
    pub enum WristTurn {
        /// The turn that is nearest to where the wrist is.
        Nearest = 0, "nearest";
        /// Turn 0.
        Zero = 1, "zero";
        /// Turn 1.
        PlusOne = 2, "plus-one";
        /// Turn -1.
        MinusOne = 3, "minus-one";
        /// Turn 2.
        PlusTwo = 4, "plus-two";
        /// Turn -2.
        MinusTwo = 5, "minus-two";
    }
}

impl WristTurn {
    /// Turns either way that a message can ask for.
    pub const MOST: i8 = 2;

    /// The turn of this number, or `None` beyond [`WristTurn::MOST`].
    #[must_use]
    pub const fn of_number(turn: i8) -> Option<Self> {
        Some(match turn {
            0 => Self::Zero,
            1 => Self::PlusOne,
            -1 => Self::MinusOne,
            2 => Self::PlusTwo,
            -2 => Self::MinusTwo,
            _ => return None,
        })
    }

    /// Its number; `None` for the nearest.
    #[must_use]
    pub const fn number(self) -> Option<i8> {
        Some(match self {
            Self::Nearest => return None,
            Self::Zero => 0,
            Self::PlusOne => 1,
            Self::MinusOne => -1,
            Self::PlusTwo => 2,
            Self::MinusTwo => -2,
        })
    }
}
