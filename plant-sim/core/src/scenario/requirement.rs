//! Requirements on a run: what is measured, when, and how much of it is allowed.

mod names;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::check::{AMOUNT, MOMENT};
use super::exactly;
use crate::allowed::schema::by;

pub use names::{Axis, StateName};

/// A limit on something that a run measures. Numbers that the summary has, too, are those of its keys of the same name.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Requirement {
    /// Short name for lists and other programs, unique in the scenario: letters, digits, `-`, `_` and `.`.
    #[schemars(length(min = 1, max = 64), regex(pattern = "^[A-Za-z0-9_.-]+$"))]
    pub id: String,
    /// What is required, in a sentence.
    #[schemars(length(min = 1))]
    pub text: String,
    /// What is measured.
    pub quantity: Quantity,
    /// Of which axis; otherwise of the axis with the greatest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// Which state; for `reached_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<StateName>,
    /// Greatest allowed value, in the unit of the quantity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = by(AMOUNT))]
    pub max: Option<f64>,
    /// Least allowed value; there is at least one of the two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = by(AMOUNT))]
    pub min: Option<f64>,
    /// From when until when it is measured, s from the start of the run; otherwise always.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "window"
    )]
    #[schemars(transform = by(MOMENT))]
    pub during: Option<[f64; 2]>,
    /// In which cycle it is measured, counted from 1; otherwise in all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = super::MAX_CYCLES))]
    pub cycle: Option<u32>,
}

fn window<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[f64; 2]>, D::Error> {
    exactly(deserializer).map(Some)
}

macro_rules! quantities {
    ($($(#[doc = $about:literal])+ $variant:ident = $name:literal, $unit:literal, $measured:ident;)+) => {
        /// What can be measured. The name ends in the unit; one without is a number or a share of 1.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
        pub enum Quantity {
            $($(#[doc = $about])+ #[serde(rename = $name)] $variant,)+
        }

        impl Quantity {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// Its name in a scenario.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ }
            }

            /// Its unit; empty for numbers and shares.
            pub const fn unit(self) -> &'static str {
                match self { $(Self::$variant => $unit,)+ }
            }

            /// Of what it is measured.
            pub(crate) const fn measured(self) -> Measured {
                match self { $(Self::$variant => Measured::$measured,)+ }
            }
        }
    };
}

/// Of what a quantity is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Measured {
    /// The arm.
    Arm,
    /// Any axis.
    Axis,
    /// Any axis that turns.
    Turning,
    /// Another part of the run.
    Part,
    /// The run as a whole: there is no window.
    Run,
}

quantities! {
    /// Distance of true and commanded tool at the same instant, while the reference moves, mm. Samples that the controller has not answered by
    /// the next one are left out.
    TrackingMm = "tracking_error_mm", "mm", Arm;
    /// Difference of true and commanded yaw at the same instant, while the reference moves, mrad; without the same samples.
    TrackingMrad = "tracking_error_mrad", "mrad", Arm;
    /// Reference minus actual position of an axis that turns, mrad; without the same samples.
    FollowingMrad = "following_error_mrad", "mrad", Turning;
    /// Reference minus actual position of the lift, mm; without the same samples.
    FollowingMm = "following_error_mm", "mm", Arm;
    /// Distance from the target at the end of a cycle, mm.
    FinalMm = "final_error_mm", "mm", Arm;
    /// Yaw error from the target at the end of a cycle, mrad.
    FinalMrad = "final_error_mrad", "mrad", Arm;
    /// Time of a cycle until the tool is back within 1 mm and 10 mrad and stays, s.
    CycleTime = "cycle_time_s", "s", Arm;
    /// Time from the end of the commanded motion of a cycle until the tool is within 0.01 mm and 0.1 mrad and stays, s.
    SettleTime = "settle_time_s", "s", Arm;
    /// Effort of an axis over its limit.
    Torque = "torque_utilisation", "", Axis;
    /// Root-mean-square effort of an axis over its continuous limit.
    Thermal = "thermal_utilisation", "", Axis;
    /// Speed of an axis over its limit.
    Speed = "speed_utilisation", "", Axis;
    /// Time for which a motor has been at its limit without a break, s.
    Saturation = "longest_saturation_s", "s", Axis;
    /// Way of the tool since the controller began to stop the arm, until every axis stands, mm.
    StopDistance = "stop_distance_mm", "mm", Arm;
    /// Time since the controller began to stop the arm, until every axis stands, s.
    StopTime = "stop_time_s", "s", Arm;
    /// When a state of the controller is reached first, s from the start of the run.
    Reached = "reached_s", "s", Part;
    /// Share of the time for which the bus is busy.
    BusLoad = "bus_load", "", Part;
    /// Samples without a command by the time of the next sample.
    Overruns = "overruns", "", Part;
    /// Faults that the controller reports.
    Faults = "faults", "", Part;
    /// Frames lost to a full transmit queue.
    FramesLost = "frames_lost", "", Run;
    /// Length of the run, s.
    SimTime = "sim_time_s", "s", Run;
}

/// How a run is to end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Ending {
    /// Every cycle is completed.
    #[default]
    Completed,
    /// The controller stops the arm before that, for a fault or an emergency stop.
    Stopped,
}

impl Ending {
    #[expect(
        clippy::trivially_copy_pass_by_ref,
        reason = "serde hands over a reference"
    )]
    pub(super) fn is_usual(&self) -> bool {
        *self == Self::Completed
    }
}
