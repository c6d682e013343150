//! One frame per request of an operator.

use super::*;

#[test]
fn enable() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Enable,
        }),
        5,
        "2C0##10900000000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000005769F",
    );
}

#[test]
fn disable() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Disable,
        }),
        5,
        "2C0##10901000000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000005A2BC",
    );
}

#[test]
fn fault_reset() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::FaultReset,
        }),
        5,
        "2C0##10902000000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000005CEF8",
    );
}

#[test]
fn stop() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Stop,
        }),
        5,
        "2C0##10903000000000000000000000000000000000000000000000000000000000000000000000000000000\
        00000000051ADB",
    );
}

#[test]
fn move_joint() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveJoint {
                target: [0.5, -1.0, 0.25, 2.0],
                speed: 1.0,
                zone: 0.0,
            },
        }),
        5,
        "2C0##109040000003F000080BF0000803E000000400000803F00000000000000000000000000000000000000\
        0000000005821D",
    );
}

#[test]
fn move_line() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveLine {
                target: [0.5, -0.25, 0.125, 3.0],
                speed: 0.5,
                posture: Posture::NEAREST,
                tool_speed: 0.0,
                zone: 0.0,
            },
        }),
        5,
        "2C0##109050000003F000080BE0000003E000040400000003F00000000000000000000000000000000000000\
        000000000574CE",
    );
}

#[test]
fn jump() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Jump {
                target: [0.75, 0.25, -0.25, -1.5],
                top: -0.125,
                clearance: 0.0625,
                speed: 1.0,
                posture: Posture::NEAREST,
                zone: 0.0,
            },
        }),
        5,
        "2C0##109060000403F0000803E000080BE0000C0BF000000BE0000803D0000803F0000000000000000000000\
        00000000057A50",
    );
}

#[test]
fn payload() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::SetPayload {
                mass: 2.0,
                com: [0.0, 0.03125, -0.0625],
                inertia: [0.25, 0.5, 0.75],
            },
        }),
        5,
        "2C0##1090700000040000000000000003D000080BD0000803E0000003F0000403F0000000000000000000000\
        0000000005BE8D",
    );
}

#[test]
fn law() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::SelectLaw {
                law: Law::ComputedTorqueTask,
                compensation: Compensation::Observer,
            },
        }),
        5,
        "2C0##10908050200000000000000000000000000000000000000000000000000000000000000000000000000\
        00000000052A28",
    );
}

#[test]
fn speed_override() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::SetOverride { pace: 0.25 },
        }),
        5,
        "2C0##1090A0000803E0000000000000000000000000000000000000000000000000000000000000000000000\
        00000000054E58",
    );
}

#[test]
fn gains() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::SetGains {
                bandwidth: 60.0,
                damping: 1.0,
                observer: 200.0,
            },
        }),
        5,
        "2C0##10909000070420000803F00004843000000000000000000000000000000000000000000000000000000\
        000000000572CC",
    );
}

#[test]
fn move_line_with_a_posture() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveLine {
                target: [0.5, -0.25, 0.125, 3.0],
                speed: 0.5,
                posture: Posture {
                    elbow: ElbowSide::Negative,
                    turn: WristTurn::MinusOne,
                },
                tool_speed: 0.0,
                zone: 0.0,
            },
        }),
        5,
        "2C0##109050000003F000080BE0000003E000040400000003F02030000000000000000000000000000000000\
        0000000005B5D5",
    );
}

#[test]
fn jump_with_a_posture() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Jump {
                target: [0.75, 0.25, -0.25, -1.5],
                top: -0.125,
                clearance: 0.0625,
                speed: 1.0,
                posture: Posture {
                    elbow: ElbowSide::Positive,
                    turn: WristTurn::PlusOne,
                },
                zone: 0.0,
            },
        }),
        5,
        "2C0##109060000403F0000803E000080BE0000C0BF000000BE0000803D0000803F0102000000000000000000\
        00000000059FAD",
    );
}

#[test]
fn set_operation() {
    check(
        Message::Motion(Motion {
            sequence: 3,
            request: MotionRequest::SetOperation {
                operation: Operation::Manual,
            },
        }),
        6,
        "2C0##1030B010000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000006FA34",
    );
}

#[test]
fn hold() {
    check(
        Message::Motion(Motion {
            sequence: 4,
            request: MotionRequest::Hold,
        }),
        7,
        "2C0##1040C000000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000007CBDE",
    );
}

#[test]
fn move_line_with_a_tool_speed() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveLine {
                target: [0.5, -0.25, 0.125, 3.0],
                speed: 0.5,
                posture: Posture::NEAREST,
                tool_speed: 0.25,
                zone: 0.0,
            },
        }),
        5,
        "2C0##109050000003F000080BE0000003E000040400000003F00000000803E000000000000000000000000\
        0000000000053AEC",
    );
}

#[test]
fn move_arc() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveArc {
                target: [0.5, -0.25, 0.125, 3.0],
                via: [0.75, 0.5, -0.5],
                speed: 0.5,
                posture: Posture {
                    elbow: ElbowSide::Negative,
                    turn: WristTurn::MinusOne,
                },
                tool_speed: 0.25,
                zone: 0.0,
            },
        }),
        5,
        "2C0##1090D0000003F000080BE0000003E000040400000403F0000003F000000BF0000003F02030000803E\
        0000000000054876",
    );
}

#[test]
fn move_joint_with_a_zone() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveJoint {
                target: [0.5, -0.25, 0.125, 3.0],
                speed: 0.5,
                zone: 0.03125,
            },
        }),
        5,
        "2C0##109040000003F000080BE0000003E000040400000003F0000003D0000000000000000000000000000000\
        0000000055EA0",
    );
}

#[test]
fn move_line_with_a_zone() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveLine {
                target: [0.5, -0.25, 0.125, 3.0],
                speed: 0.5,
                posture: Posture::NEAREST,
                tool_speed: 0.25,
                zone: 0.03125,
            },
        }),
        5,
        "2C0##109050000003F000080BE0000003E000040400000003F00000000803E0000003D0000000000000000000\
        000000005FB79",
    );
}

#[test]
fn jump_with_a_zone() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Jump {
                target: [0.75, 0.25, -0.25, -1.5],
                top: -0.125,
                clearance: 0.0625,
                speed: 1.0,
                posture: Posture {
                    elbow: ElbowSide::Positive,
                    turn: WristTurn::PlusOne,
                },
                zone: 0.03125,
            },
        }),
        5,
        "2C0##109060000403F0000803E000080BE0000C0BF000000BE0000803D0000803F01020000003D00000000000\
        0000000054B6A",
    );
}

#[test]
fn move_arc_with_a_zone() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveArc {
                target: [0.5, -0.25, 0.125, 3.0],
                via: [0.75, 0.5, -0.5],
                speed: 0.5,
                posture: Posture {
                    elbow: ElbowSide::Negative,
                    turn: WristTurn::MinusOne,
                },
                tool_speed: 0.25,
                zone: 0.03125,
            },
        }),
        5,
        "2C0##1090D0000003F000080BE0000003E000040400000403F0000003F000000BF0000003F02030000803E000\
        0003D0005CF82",
    );
}
