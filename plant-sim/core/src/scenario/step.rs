//! Steps of a cycle.

use std::fmt;

use protocol::messages::{ElbowSide, Posture, WristTurn};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{PayloadSpec, check, exactly};
use crate::allowed::schema::by;

/// One step of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Step {
    /// Gate move: up, across, down.
    Jump(Jump),
    /// Straight line of the tool.
    Line(Line),
    /// Arc of the tool through a point.
    Arc(Arc),
    /// Straight in joint space.
    Joints(Joints),
    /// Wait until the arm has arrived, then this many seconds.
    Dwell(#[schemars(transform = by(check::SECONDS))] f64),
    /// This many seconds after the last move was accepted, stop on the path.
    Stop(#[schemars(transform = by(check::SECONDS))] f64),
    /// Some seconds after the last move was accepted, set the speed override.
    Override(Override),
    /// In manual operation: some seconds after the last move was accepted, let go of the button, for some seconds.
    Release(Release),
    /// This many seconds after the last move was accepted, press the emergency stop.
    Estop(#[schemars(transform = by(check::SECONDS))] f64),
    /// Take a payload and announce it.
    Pick(PayloadSpec),
    /// Release the payload and announce it.
    Place {},
}

impl Step {
    /// Whether it asks for a move.
    pub(crate) fn is_move(&self) -> bool {
        matches!(
            self,
            Self::Jump(_) | Self::Line(_) | Self::Arc(_) | Self::Joints(_)
        )
    }

    /// Zone of a move, m; 0 of any other step.
    pub(crate) fn zone(&self) -> f64 {
        match self {
            Self::Jump(Jump { zone, .. })
            | Self::Line(Line { zone, .. })
            | Self::Arc(Arc { zone, .. })
            | Self::Joints(Joints { zone, .. }) => *zone,
            _ => 0.0,
        }
    }

    /// Its key.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Jump(_) => "jump",
            Self::Line(_) => "line",
            Self::Arc(_) => "arc",
            Self::Joints(_) => "joints",
            Self::Dwell(_) => "dwell",
            Self::Stop(_) => "stop",
            Self::Override(_) => "override",
            Self::Release(_) => "release",
            Self::Estop(_) => "estop",
            Self::Pick(_) => "pick",
            Self::Place {} => "place",
        }
    }
}

/// Side to which the elbow bends: theta2 >= 0, as a right arm bends, or theta2 <= 0, as a left arm does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Elbow {
    Positive,
    Negative,
}

impl fmt::Display for Elbow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Positive => "positive",
            Self::Negative => "negative",
        })
    }
}

/// A gate move.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Jump {
    /// Flange at the end: x, y, z (m) and yaw (rad) in frame 0.
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(check::POSE))]
    pub to: [f64; 4],
    /// Side to which the elbow bends at the end; as before the move if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elbow: Option<Elbow>,
    /// Turn of the wrist at the end: whole revolutions of theta4, 0 from -pi to pi; the nearest if left out, after half a turn that
    /// nearer to the middle of its range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -WristTurn::MOST, max = WristTurn::MOST))]
    pub turn: Option<i8>,
    /// Least z of the flange on its way across, m in frame 0: absolute, not relative to start or end.
    #[schemars(transform = by(check::LENGTH))]
    pub top: f64,
    /// Length of the strictly vertical part at each end, m upwards from the flange at that end; 0 for free corners.
    #[schemars(transform = by(check::CLEARANCE))]
    #[serde(default)]
    pub clearance: f64,
    /// Share of full speed.
    #[serde(default = "full")]
    #[schemars(transform = by(check::SPEED))]
    pub speed: f64,
    /// How far from the end the arm may leave its path for that of the next step, m, to pass there without a stop; 0 to stop at the end.
    #[serde(default)]
    #[schemars(transform = by(check::ZONE))]
    pub zone: f64,
}

/// A straight line of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Flange at the end: x, y, z (m) and yaw (rad) in frame 0.
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(check::POSE))]
    pub to: [f64; 4],
    /// Side to which the elbow bends; a line is refused where that is not the side before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elbow: Option<Elbow>,
    /// Turn of the wrist at the end: whole revolutions of theta4, 0 from -pi to pi; the yaw turns as far as that takes. If
    /// left out, it turns the shorter way, half a turn so that the wrist ends nearer to the middle of its range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -WristTurn::MOST, max = WristTurn::MOST))]
    pub turn: Option<i8>,
    /// Share of full speed.
    #[serde(default = "full")]
    #[schemars(transform = by(check::SPEED))]
    pub speed: f64,
    /// Greatest speed of the flange, m/s: 0.25 is what robot programs call 250 mm/s. As fast as the arm can if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = by(check::TOOL_SPEED))]
    pub tool_speed: Option<f64>,
    /// How far from the end the arm may leave its path for that of the next step, m, to pass there without a stop; 0 to stop at the end.
    #[serde(default)]
    #[schemars(transform = by(check::ZONE))]
    pub zone: f64,
}

/// An arc of the tool through three points: from where it is, through `via`, to the end. It is refused where they lie on one line.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Arc {
    /// Flange on the way: x, y, z (m) in frame 0, anywhere between the ends.
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(check::POINT))]
    pub via: [f64; 3],
    /// Flange at the end: x, y, z (m) and yaw (rad) in frame 0.
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(check::POSE))]
    pub to: [f64; 4],
    /// Side to which the elbow bends; an arc is refused where that is not the side before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elbow: Option<Elbow>,
    /// Turn of the wrist at the end: whole revolutions of theta4, 0 from -pi to pi; the yaw turns as far as that takes. If
    /// left out, it turns the shorter way, half a turn so that the wrist ends nearer to the middle of its range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -WristTurn::MOST, max = WristTurn::MOST))]
    pub turn: Option<i8>,
    /// Share of full speed.
    #[serde(default = "full")]
    #[schemars(transform = by(check::SPEED))]
    pub speed: f64,
    /// Greatest speed of the flange, m/s: 0.25 is what robot programs call 250 mm/s. As fast as the arm can if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = by(check::TOOL_SPEED))]
    pub tool_speed: Option<f64>,
    /// How far from the end the arm may leave its path for that of the next step, m, to pass there without a stop; 0 to stop at the end.
    #[serde(default)]
    #[schemars(transform = by(check::ZONE))]
    pub zone: f64,
}

/// A move to joint positions.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Joints {
    /// Joint positions at the end: shoulder, elbow (rad), lift (m), wrist (rad).
    #[serde(deserialize_with = "exactly")]
    #[schemars(transform = by(check::POSITIONS))]
    pub to: [f64; 4],
    /// Share of full speed.
    #[serde(default = "full")]
    #[schemars(transform = by(check::SPEED))]
    pub speed: f64,
    /// How far from the end the arm may leave its path for that of the next step, m, to pass there without a stop; 0 to stop at the end.
    #[serde(default)]
    #[schemars(transform = by(check::ZONE))]
    pub zone: f64,
}

/// A change of the speed override: of the pace at which every move passes from then on, the one under way included.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Override {
    /// Seconds after the last move was accepted.
    #[schemars(transform = by(check::SECONDS))]
    pub after: f64,
    /// Share of the speed that moves are planned with, 0.0001 at the least; 0 holds the arm on its path, until another step of the
    /// same cycle raises it.
    #[schemars(transform = by(check::PACE))]
    pub to: f64,
}

/// Nobody holds the button of manual operation: the arm waits on its path until it is held again.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Release {
    /// Seconds after the last move was accepted.
    #[schemars(transform = by(check::SECONDS))]
    pub after: f64,
    /// Seconds until the button is held again.
    #[serde(rename = "for")]
    #[schemars(transform = by(check::SECONDS))]
    pub lasts: f64,
}

impl Jump {
    /// Elbow and turn as the request says them.
    pub(crate) fn posture(&self) -> Posture {
        posture(self.elbow, self.turn)
    }
}

impl Line {
    /// Elbow and turn as the request says them.
    pub(crate) fn posture(&self) -> Posture {
        posture(self.elbow, self.turn)
    }

    /// Speed of the tool as the request says it.
    pub(crate) fn tool_speed(&self) -> f32 {
        tool_speed(self.tool_speed)
    }
}

impl Arc {
    /// Elbow and turn as the request says them.
    pub(crate) fn posture(&self) -> Posture {
        posture(self.elbow, self.turn)
    }

    /// Speed of the tool as the request says it.
    pub(crate) fn tool_speed(&self) -> f32 {
        tool_speed(self.tool_speed)
    }
}

/// m/s; 0 for any.
fn tool_speed(speed: Option<f64>) -> f32 {
    speed.unwrap_or(0.0) as f32
}

fn posture(elbow: Option<Elbow>, turn: Option<i8>) -> Posture {
    Posture {
        elbow: match elbow {
            None => ElbowSide::Keep,
            Some(Elbow::Positive) => ElbowSide::Positive,
            Some(Elbow::Negative) => ElbowSide::Negative,
        },
        // Checked beforehand: every turn that a scenario may ask for has its code.
        turn: turn
            .and_then(WristTurn::of_number)
            .unwrap_or(WristTurn::Nearest),
    }
}

fn full() -> f64 {
    1.0
}
