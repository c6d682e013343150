//! The fields of every message, byte by byte, as the [`table`](crate::table) lists them.

use crate::messages::{
    Cause, Compensation, ControlWord, DriveStatus, ElbowSide, FaultAxis, Law, LimitFlags, Mode,
    MotionRequest, NmtCommand, Operation, Outcome, ParameterError, ParameterReply,
    ParameterRequest, RefusalReason, ResetReason, WristTurn,
};
use crate::schema::{Kind, Signal};

type Elements = &'static [(&'static str, &'static str)];

/// One number with this unit.
macro_rules! one {
    ($unit:literal) => {
        &[("", $unit)]
    };
}

/// One number per motor, with this unit.
macro_rules! motors {
    ($unit:literal) => {
        &[
            ("shoulder", $unit),
            ("elbow", $unit),
            ("lift", $unit),
            ("wrist", $unit),
        ]
    };
}

const JOINTS: Elements = &[
    ("shoulder", "rad"),
    ("elbow", "rad"),
    ("lift", "m"),
    ("wrist", "rad"),
];
const POINT: Elements = &[("x", "m"), ("y", "m"), ("z", "m")];
const POSE: Elements = &[("x", "m"), ("y", "m"), ("z", "m"), ("yaw", "rad")];

const ANY: Kind = range(f32::MIN, f32::MAX);
/// Beyond any joint or Cartesian coordinate of a robot of this size, rad or m.
const COORDINATE: Kind = range(-100.0, 100.0);
/// Beyond any speed of such a tool, m/s.
const TOOL_SPEED: Kind = range(0.0, 100.0);
/// Around the end of a move, m.
const ZONE: Kind = range(0.0, 1.0);
const FRACTION: Kind = range(0.0, 1.0);
const CAUSE: Kind = Kind::Code(Cause::CODES);
const ELBOW: Kind = Kind::Code(ElbowSide::CODES);
const TURN: Kind = Kind::Code(WristTurn::CODES);
const OPERATION: Kind = Kind::Code(Operation::CODES);
const MODE: Kind = Kind::Code(Mode::CODES);

const fn range(min: f32, max: f32) -> Kind {
    Kind::F32 { min, max }
}

const fn signal(name: &'static str, offset: usize, kind: Kind, elements: Elements) -> Signal {
    Signal {
        name,
        offset,
        kind,
        elements,
        when: None,
    }
}

/// A signal present while the selector is `tag`.
const fn when(
    tag: u8,
    name: &'static str,
    offset: usize,
    kind: Kind,
    elements: Elements,
) -> Signal {
    Signal {
        name,
        offset,
        kind,
        elements,
        when: Some(tag),
    }
}

/// Network management.
pub(crate) const NMT: &[Signal] = &[
    signal("command", 0, Kind::Code(NmtCommand::CODES), one!("")),
    signal("node", 1, Kind::U8, one!("")),
];

/// Emergency stop.
pub(crate) const ESTOP: &[Signal] = &[
    signal("reason", 0, Kind::U8, one!("")),
    signal("counter", 1, Kind::U8, one!("")),
];

/// Emergency.
pub(crate) const EMERGENCY: &[Signal] = &[
    signal("code", 0, Kind::U16, one!("")),
    signal("error_register", 2, Kind::U8, one!("")),
    signal("cause", 3, CAUSE, one!("")),
    signal("data", 4, Kind::U32, one!("")),
];

/// Feedback of the drives.
pub(crate) const FEEDBACK: &[Signal] = &[
    signal("sample", 0, Kind::U32, one!("")),
    signal("status", 4, Kind::Flags8(DriveStatus::NAMES), one!("")),
    signal("position", 5, Kind::I32, motors!("count")),
    // About three times the speed of the motors (6000 rpm).
    signal("velocity", 21, range(-2000.0, 2000.0), motors!("rad/s")),
    signal("torque", 37, Kind::I16, motors!("0.1 %")),
];

/// Command to the drives.
pub(crate) const COMMAND: &[Signal] = &[
    signal("sample", 0, Kind::U32, one!("")),
    signal("control", 4, Kind::Flags8(ControlWord::NAMES), one!("")),
    // About twice the peak torque of the largest motor.
    signal("torque", 5, range(-200.0, 200.0), motors!("N m")),
];

/// Request of the operator.
pub(crate) const MOTION: &[Signal] = &[
    signal("sequence", 0, Kind::U8, one!("")),
    signal("request", 1, Kind::Selector(MotionRequest::NAMES), one!("")),
    when(4, "joint_target", 2, COORDINATE, JOINTS),
    when(4, "joint_speed", 18, FRACTION, one!("")),
    when(4, "joint_zone", 22, ZONE, one!("m")),
    when(5, "line_target", 2, COORDINATE, POSE),
    when(5, "line_speed", 18, FRACTION, one!("")),
    when(5, "line_elbow", 22, ELBOW, one!("")),
    when(5, "line_turn", 23, TURN, one!("")),
    when(5, "line_tool_speed", 24, TOOL_SPEED, one!("m/s")),
    when(5, "line_zone", 28, ZONE, one!("m")),
    when(6, "jump_target", 2, COORDINATE, POSE),
    when(6, "jump_top", 18, COORDINATE, one!("m")),
    when(6, "jump_clearance", 22, range(0.0, 1.0), one!("m")),
    when(6, "jump_speed", 26, FRACTION, one!("")),
    when(6, "jump_elbow", 30, ELBOW, one!("")),
    when(6, "jump_turn", 31, TURN, one!("")),
    when(6, "jump_zone", 32, ZONE, one!("m")),
    when(7, "payload_mass", 2, range(0.0, 100.0), one!("kg")),
    when(7, "payload_com", 6, range(-1.0, 1.0), POINT),
    when(
        7,
        "payload_inertia",
        18,
        range(0.0, 10.0),
        &[("xx", "kg m2"), ("yy", "kg m2"), ("zz", "kg m2")],
    ),
    when(8, "law", 2, Kind::Code(Law::CODES), one!("")),
    when(
        8,
        "compensation",
        3,
        Kind::Code(Compensation::CODES),
        one!(""),
    ),
    when(9, "bandwidth", 2, range(0.0, 1000.0), one!("rad/s")),
    when(9, "damping", 6, range(0.0, 10.0), one!("")),
    when(9, "observer", 10, range(0.0, 1000.0), one!("rad/s")),
    when(10, "override_pace", 2, FRACTION, one!("")),
    when(11, "operation", 2, OPERATION, one!("")),
    when(13, "arc_target", 2, COORDINATE, POSE),
    when(13, "arc_via", 18, COORDINATE, POINT),
    when(13, "arc_speed", 30, FRACTION, one!("")),
    when(13, "arc_elbow", 34, ELBOW, one!("")),
    when(13, "arc_turn", 35, TURN, one!("")),
    when(13, "arc_tool_speed", 36, TOOL_SPEED, one!("m/s")),
    when(13, "arc_zone", 40, ZONE, one!("m")),
];

/// Report of the controller.
pub(crate) const STATE: &[Signal] = &[
    signal("mode", 0, MODE, one!("")),
    signal("cause", 1, CAUSE, one!("")),
    signal("limits", 2, Kind::Flags16(LimitFlags::NAMES), one!("")),
    signal("queue", 4, Kind::U8, one!("")),
    signal("completed", 5, Kind::U8, one!("")),
    signal("overruns", 6, Kind::U16, one!("")),
    signal("rejected", 8, Kind::U16, one!("")),
    signal("worst_tick", 10, Kind::U32, one!("")),
    signal("law", 14, Kind::Code(Law::CODES), one!("")),
    signal(
        "compensation",
        15,
        Kind::Code(Compensation::CODES),
        one!(""),
    ),
    signal("tracking_error", 16, ANY, JOINTS),
    signal("fault_axis", 32, Kind::Code(FaultAxis::CODES), one!("")),
    // The unit depends on the cause.
    signal("fault_value", 33, ANY, one!("")),
    signal("fault_limit", 37, ANY, one!("")),
    signal("pace", 41, Kind::U8, one!("%")),
    signal("operation", 42, OPERATION, one!("")),
    signal("burden", 43, Kind::I16, one!("10 g")),
];

/// Answer to a request.
pub(crate) const MOTION_REPLY: &[Signal] = &[
    signal("sequence", 0, Kind::U8, one!("")),
    signal("outcome", 1, Kind::Selector(Outcome::NAMES), one!("")),
    when(1, "reason", 2, Kind::Code(RefusalReason::CODES), one!("")),
    when(1, "axis", 3, Kind::U8, one!("")),
    when(1, "value", 4, ANY, one!("")),
    when(1, "limit", 8, ANY, one!("")),
];

/// Answer of a parameter server.
pub(crate) const PARAMETER_REPLY: &[Signal] = &[
    signal("reply", 0, Kind::Selector(ParameterReply::NAMES), one!("")),
    when(0, "value_index", 1, Kind::U16, one!("")),
    when(0, "value", 3, ANY, one!("")),
    when(0, "value_lower", 7, ANY, one!("")),
    when(0, "value_upper", 11, ANY, one!("")),
    when(1, "error_index", 1, Kind::U16, one!("")),
    when(1, "error", 3, Kind::Code(ParameterError::CODES), one!("")),
    when(1, "error_limit", 4, ANY, one!("")),
    when(2, "hello_schema", 1, Kind::U32, one!("")),
    when(2, "hello_build", 5, Kind::U32, one!("")),
    when(2, "hello_profile", 9, Kind::U8, one!("")),
];

/// Request to a parameter server.
pub(crate) const PARAMETER_REQUEST: &[Signal] = &[
    signal(
        "request",
        0,
        Kind::Selector(ParameterRequest::NAMES),
        one!(""),
    ),
    when(0, "get_index", 1, Kind::U16, one!("")),
    when(1, "set_index", 1, Kind::U16, one!("")),
    when(1, "set_value", 3, ANY, one!("")),
    when(2, "list_from", 1, Kind::U16, one!("")),
    when(3, "hello_schema", 1, Kind::U32, one!("")),
    when(3, "hello_build", 5, Kind::U32, one!("")),
    when(3, "hello_profile", 9, Kind::U8, one!("")),
];

/// Heartbeat.
pub(crate) const HEARTBEAT: &[Signal] = &[
    signal("state", 0, MODE, one!("")),
    signal("cause", 1, CAUSE, one!("")),
    signal("reset", 2, Kind::Code(ResetReason::CODES), one!("")),
];
