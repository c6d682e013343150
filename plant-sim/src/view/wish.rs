//! What a page asks for, in its own words: `{"jump": {"x": 600, ...}}`, in millimetres, degrees and percents.

use protocol::messages::{MotionRequest, Operation, Posture};
use serde::Deserialize;
use sim::faults::{Fault, FaultError};
use sim::model::AXES;
use sim::operator::Order;
use sim::scenario::PayloadSpec;
use sim::selection::LawChoice;

/// A wish, ready for the loop.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// Something that the operator does.
    Order(Order),
    /// Something that breaks, `encoder:elbow:stuck`, at the next sample or when the next such thing goes on, for so many seconds where
    /// it does not stay broken or last as long as that.
    Break(String, Option<&'static str>, Option<f64>),
}

/// A wish as the page writes it.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Asked {
    Enable {},
    Disable {},
    FaultReset {},
    Stop {},
    EmergencyStop {},
    Scenario {},
    Jump {
        x: f64,
        y: f64,
        z: f64,
        yaw: f64,
        top: f64,
        clearance: f64,
        speed: f64,
        zone: f64,
    },
    Line {
        x: f64,
        y: f64,
        z: f64,
        yaw: f64,
        speed: f64,
        tool_speed: f64,
        zone: f64,
    },
    Arc {
        via_x: f64,
        via_y: f64,
        via_z: f64,
        x: f64,
        y: f64,
        z: f64,
        yaw: f64,
        speed: f64,
        tool_speed: f64,
        zone: f64,
    },
    /// A small move of one axis from where it stands.
    Jog {
        axis: String,
        step: f64,
        /// 1 or -1.
        sign: f64,
        speed: f64,
    },
    /// A move of one axis to this end of its range, ° or mm, while a button is held.
    Push {
        axis: String,
        end: f64,
        speed: f64,
    },
    /// The button is held.
    Hold {},
    /// Who keeps moves going.
    Operation {
        operation: String,
    },
    /// Speed override.
    Override {
        pace: f64,
    },
    Payload {
        mass: f64,
    },
    Law {
        law: LawChoice,
    },
    Fault {
        fault: String,
        when: String,
        seconds: f64,
    },
}

/// When a fault begins: at once, or with something that a window names.
pub(super) const MOMENTS: [(&str, Option<&str>); 6] = [
    ("at once", None),
    ("while the arm moves", Some("moving")),
    ("while it stops", Some("quick-stop")),
    ("while the lift goes down", Some("lift-down")),
    ("while the lift goes up", Some("lift-up")),
    ("while it stops for a fault", Some("fault-reaction")),
];

/// The axis that moves in metres.
const LIFT: usize = 2;

/// Joint positions that a jog begins from.
pub(super) type Stand = Option<[f32; 4]>;

impl Asked {
    /// The wish, where it does not depend on where the arm is.
    ///
    /// # Errors
    /// What is wrong, and what is allowed.
    pub(super) fn wish(&self) -> Result<Wish, String> {
        let request = |request| Ok(Wish::Order(Order::Request(request)));
        match self {
            Self::Enable {} => request(MotionRequest::Enable),
            Self::Disable {} => request(MotionRequest::Disable),
            Self::FaultReset {} => request(MotionRequest::FaultReset),
            Self::Stop {} => request(MotionRequest::Stop),
            Self::EmergencyStop {} => Ok(Wish::Order(Order::EmergencyStop)),
            Self::Scenario {} => Ok(Wish::Order(Order::Scenario)),
            &Self::Jump {
                x,
                y,
                z,
                yaw,
                top,
                clearance,
                speed,
                zone,
            } => request(MotionRequest::Jump {
                target: pose([x, y, z, yaw]),
                top: metres(top),
                clearance: metres(clearance),
                speed: share(speed),
                posture: Posture::NEAREST,
                zone: metres(zone),
            }),
            &Self::Line {
                x,
                y,
                z,
                yaw,
                speed,
                tool_speed,
                zone,
            } => request(MotionRequest::MoveLine {
                target: pose([x, y, z, yaw]),
                speed: share(speed),
                posture: Posture::NEAREST,
                tool_speed: metres(tool_speed),
                zone: metres(zone),
            }),
            &Self::Arc {
                via_x,
                via_y,
                via_z,
                x,
                y,
                z,
                yaw,
                speed,
                tool_speed,
                zone,
            } => request(MotionRequest::MoveArc {
                target: pose([x, y, z, yaw]),
                via: [via_x, via_y, via_z].map(metres),
                speed: share(speed),
                posture: Posture::NEAREST,
                tool_speed: metres(tool_speed),
                zone: metres(zone),
            }),
            Self::Hold {} => request(MotionRequest::Hold),
            Self::Operation { operation } => {
                let operation = Operation::from_name(operation).ok_or_else(|| {
                    let names: Vec<_> = Operation::ALL.iter().map(|it| it.name()).collect();
                    format!(
                        "there is no operation {operation:?}; allowed: {}",
                        names.join(", ")
                    )
                })?;
                request(MotionRequest::SetOperation { operation })
            }
            Self::Jog { .. } | Self::Push { .. } => Err("a jog begins where the arm is".into()),
            Self::Override { pace } => request(MotionRequest::SetOverride { pace: share(*pace) }),
            Self::Payload { mass } => Ok(Wish::Order(Order::Carry(PayloadSpec::compact(*mass)))),
            Self::Law { law } => request(MotionRequest::SelectLaw {
                law: law.law,
                compensation: law.compensation,
            }),
            Self::Fault {
                fault,
                when,
                seconds,
            } => {
                if *seconds < 0.0 {
                    return Err(format!(
                        "seconds is {seconds}; allowed: a time, or 0 for what stays broken"
                    ));
                }
                let seconds = (*seconds > 0.0).then_some(*seconds);
                let (_, event) =
                    (MOMENTS.iter().find(|(name, _)| name == when)).ok_or_else(|| {
                        let names = MOMENTS.map(|(name, _)| name);
                        format!("there is no moment {when:?}; allowed: {}", names.join(", "))
                    })?;
                // Whether it is one shows at any time.
                at(fault, *event, 0.0, seconds).map_err(|error| error.to_string())?;
                Ok(Wish::Break(fault.clone(), *event, seconds))
            }
        }
    }
}

impl Asked {
    /// A move of one axis from `stand`, by a step or to the end of its range, and where it leads to.
    ///
    /// # Errors
    /// It is no jog, or nobody knows where the arm is.
    pub(super) fn jog(&self, stand: Stand) -> Result<(Wish, [f32; 4]), String> {
        let (axis, speed) = match self {
            Self::Jog { axis, speed, .. } | Self::Push { axis, speed, .. } => (axis, speed),
            _ => return Err("not a jog".into()),
        };
        let place = AXES
            .iter()
            .position(|name| name == axis)
            .ok_or_else(|| format!("there is no axis {axis:?}; allowed: {}", AXES.join(", ")))?;
        let mut target =
            stand.ok_or("the drives have sent no feedback yet: where the arm is, is not known")?;
        let unit = |value: f64| {
            if place == LIFT {
                metres(value)
            } else {
                value.to_radians() as f32
            }
        };
        match self {
            Self::Push { end, .. } => target[place] = unit(*end),
            Self::Jog { step, sign, .. } => target[place] += unit(sign * step),
            _ => {}
        }
        let request = MotionRequest::MoveJoint {
            target,
            speed: share(*speed),
            zone: 0.0,
        };
        let order = match self {
            Self::Push { .. } => Order::Jog(request),
            _ => Order::Request(request),
        };
        Ok((Wish::Order(order), target))
    }
}

/// The fault from `t` on, s, or while the next `event` goes on; for so many seconds.
pub(super) fn at(
    fault: &str,
    event: Option<&str>,
    t: f64,
    seconds: Option<f64>,
) -> Result<Fault, FaultError> {
    // To the microsecond, without the digits that rounding leaves.
    let short = |t: f64| (t * 1e6).round() / 1e6;
    let window = match (event, seconds) {
        (None, None) => format!("{}s", short(t)),
        (None, Some(seconds)) => format!("{}s..{}s", short(t), short(t + seconds)),
        (Some(event), None) => format!("while={event}"),
        (Some(event), Some(seconds)) => format!("{event}..+{}s", short(seconds)),
    };
    format!("{fault}@{window}").parse()
}

fn metres(millimetres: f64) -> f32 {
    (millimetres / 1000.0) as f32
}

/// A share of what percents are of.
fn share(percents: f64) -> f32 {
    (percents / 100.0) as f32
}

/// x, y, z in mm and yaw in degrees.
fn pose([x, y, z, yaw]: [f64; 4]) -> [f32; 4] {
    [metres(x), metres(y), metres(z), yaw.to_radians() as f32]
}
