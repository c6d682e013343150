//! What a person reads when the controller refuses a request: reason, axis, parameter, value and what is allowed.

use protocol::messages::{ElbowSide, MotionRequest, Posture, Refusal, RefusalReason};

use crate::model::AXES;

/// Units of the joints' positions and efforts, in order.
const UNITS: [(&str, &str); 4] = [("rad", "N m"), ("rad", "N m"), ("m", "N"), ("rad", "N m")];

/// The refusal as a sentence.
pub(crate) fn sentence(request: &MotionRequest, refusal: &Refusal) -> String {
    let mut text = refusal.reason.describe().trim_end_matches('.').to_owned();
    if let Some(name) = AXES.get(usize::from(refusal.axis)) {
        text += &format!("; axis {name}");
    }
    let (value, limit) = (refusal.value, refusal.limit);
    match (parameter(request, refusal), unit(request, refusal)) {
        // Such a refusal has no numbers.
        (None, None) => {}
        (Some(parameter), None) => text += &format!("; parameter {parameter}"),
        (Some("top"), Some(unit)) if value < 0.0 => {
            text += &format!(
                "; parameter top is {} {unit} below the start or the end of the jump, allowed: not below either",
                rounded(-value)
            );
        }
        (parameter, Some(unit)) => {
            let parameter =
                parameter.map_or_else(String::new, |name| format!("parameter {name}: "));
            let space = if unit.is_empty() { "" } else { " " };
            text += &format!(
                "; {parameter}{}{space}{unit}, limit {}{space}{unit}",
                rounded(value),
                rounded(limit)
            );
        }
    }
    text += readiness(request, refusal);
    if let Some(z) = height(request, refusal) {
        // The flange goes down as the lift goes up its axis.
        text += &format!(
            " (z {} m, limit {} m)",
            rounded(z),
            rounded(z + value - limit)
        );
    }
    if refusal.reason == RefusalReason::JointLimit
        && let Some(posture) = request.posture()
    {
        text += &asked(posture);
    }
    text
}

/// What a request to switch on or go on lacked, whose reason alone tells too little: an operator greets before it asks, and the controller
/// forgets that when the drives fall silent.
fn readiness(request: &MotionRequest, refusal: &Refusal) -> &'static str {
    match (request, refusal.reason) {
        (MotionRequest::Enable, RefusalReason::WrongState) => {
            "; it takes ready, to which the controller comes by itself once it hears the drives and the operator's hello; from fault it takes a \
             fault-reset before"
        }
        _ => "",
    }
}

/// A number without the digits that single precision does not have.
fn rounded(value: f32) -> f64 {
    // Of small gains, sines and lengths every digit counts.
    if value.abs() < 1e-3 {
        value.to_string().parse().unwrap_or(value.into())
    } else {
        (f64::from(value) * 1e6).round() / 1e6
    }
}

/// Height of the pose that the lift cannot reach, if it is one.
fn height(request: &MotionRequest, refusal: &Refusal) -> Option<f32> {
    if refusal.reason != RefusalReason::JointLimit || refusal.axis != 2 {
        return None;
    }
    match request {
        MotionRequest::MoveLine { target, .. } => Some(target[2]),
        MotionRequest::Jump { target, .. } if refusal.value > refusal.limit => Some(target[2]),
        MotionRequest::Jump { top, .. } => Some(*top),
        _ => None,
    }
}

/// The posture that was asked for, and so may be what is in the way.
fn asked(posture: Posture) -> String {
    let mut text = String::new();
    if posture.elbow != ElbowSide::Keep {
        text += &format!(", with elbow {}", posture.elbow);
    }
    if let Some(turn) = posture.turn.number() {
        text += &format!(", in turn {turn} of the wrist");
    }
    text
}

/// Name of the value that was refused, as scenarios write it.
fn parameter(request: &MotionRequest, refusal: &Refusal) -> Option<&'static str> {
    use RefusalReason as Reason;
    Some(match (request, refusal.reason) {
        // Any other value of a jump that is out of range is refused before it is sent.
        (MotionRequest::Jump { .. }, Reason::OutOfRange) if refusal.limit == 0.0 => "top",
        (MotionRequest::Jump { .. }, Reason::JointLimit) if refusal.axis == 2 => "to or top",
        (
            MotionRequest::MoveLine { tool_speed, .. } | MotionRequest::MoveArc { tool_speed, .. },
            Reason::OutOfRange,
        ) if refusal.value == *tool_speed && refusal.limit < 1.0 => "tool_speed",
        (_, Reason::OutOfRange) if request.is_move() => "speed",
        (MotionRequest::SetOperation { .. }, Reason::OutOfRange) => "rate of control",
        (
            MotionRequest::MoveArc { .. },
            Reason::TooFar | Reason::TooNear | Reason::JointLimit | Reason::Singular,
        ) => "to or via",
        (_, Reason::NoCircle) => "via",
        (_, Reason::TooFar | Reason::TooNear | Reason::JointLimit | Reason::Singular) => "to",
        (_, Reason::ElbowSide) => "elbow",
        (_, Reason::PayloadTooHeavy) => "mass",
        (
            MotionRequest::SetGains {
                bandwidth,
                damping,
                observer,
            },
            Reason::OutOfRange,
        ) => {
            let gains = [
                ("bandwidth", bandwidth),
                ("damping", damping),
                ("observer", observer),
            ];
            gains
                .into_iter()
                .find(|(_, gain)| **gain == refusal.value)?
                .0
        }
        _ => return None,
    })
}

/// Unit of value and limit; `None` where there are none.
fn unit(request: &MotionRequest, refusal: &Refusal) -> Option<&'static str> {
    use RefusalReason as Reason;
    let units = UNITS.get(usize::from(refusal.axis));
    Some(match (request, refusal.reason) {
        (_, Reason::TooFar | Reason::TooNear | Reason::NoCircle) => "m",
        (_, Reason::JointLimit) => units?.0,
        (_, Reason::TorqueTooSmall) => units?.1,
        (_, Reason::PayloadTooHeavy) => "kg",
        (_, Reason::Singular) => "(sine of the elbow)",
        (MotionRequest::Jump { .. }, Reason::OutOfRange) if refusal.limit == 0.0 => "m",
        (_, Reason::OutOfRange) if parameter(request, refusal) == Some("tool_speed") => "m/s",
        (MotionRequest::SetOperation { .. }, Reason::OutOfRange) => "Hz",
        (_, Reason::OutOfRange) => "",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use protocol::messages::WristTurn;

    use super::*;

    fn jump(reason: RefusalReason, axis: u8, value: f32, limit: f32) -> String {
        let request = MotionRequest::Jump {
            target: [0.6, 0.1, -0.2, 0.0],
            top: -0.25,
            clearance: 0.005,
            speed: 1.0,
            posture: Posture {
                elbow: ElbowSide::Keep,
                turn: WristTurn::MinusOne,
            },
            zone: 0.0,
        };
        let refusal = Refusal {
            reason,
            axis,
            value,
            limit,
        };
        sentence(&request, &refusal)
    }

    /// A bus that was held before the arm was switched on is not told as a program of another source alone.
    #[test]
    fn a_refusal_to_switch_on_names_silent_drives() {
        let enable = |reason| sentence(&MotionRequest::Enable, &Refusal::because(reason));
        let text = enable(RefusalReason::WrongState);
        assert!(text.contains("drives") && text.contains("hello"), "{text}");
        let text = enable(RefusalReason::SchemaMismatch);
        assert!(!text.contains("drives"), "{text}");
        let stop = sentence(
            &MotionRequest::Stop,
            &Refusal::because(RefusalReason::WrongState),
        );
        assert_eq!(stop, "The present state does not allow it");
    }

    #[test]
    fn a_refusal_names_axis_parameter_value_limit_and_unit() {
        assert_eq!(
            jump(RefusalReason::JointLimit, 1, 2.75, 2.5),
            "An axis would leave its range; axis elbow; parameter to: 2.75 rad, limit 2.5 rad, \
             in turn -1 of the wrist"
        );
        // 78.7 mm lower than the lowest that the lift reaches, and higher than the highest.
        assert_eq!(
            jump(RefusalReason::JointLimit, 2, 0.378_700_02, 0.3),
            "An axis would leave its range; axis lift; parameter to or top: 0.3787 m, limit 0.3 m (z -0.2 m, limit -0.1213 m), \
             in turn -1 of the wrist"
        );
        assert!(
            jump(RefusalReason::JointLimit, 2, -0.1, 0.0).contains("(z -0.25 m, limit -0.35 m)")
        );
        assert_eq!(
            jump(RefusalReason::OutOfRange, Refusal::NO_AXIS, -0.5, 0.0),
            "A value is out of its range; parameter top is 0.5 m below the start or the end of the jump, allowed: not below \
             either"
        );
        assert_eq!(
            jump(RefusalReason::Stopped, Refusal::NO_AXIS, 0.0, 0.0),
            "A stop came before the move was planned"
        );
    }
}
