//! What is read from a request besides its fields.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::request;
use proptest::prelude::*;
use protocol::codec::encode;
use protocol::messages::*;

proptest! {
    /// By its tag, the second byte on the wire.
    #[test]
    fn a_request_is_named_by_its_tag(request in request()) {
        let frame = encode(&Message::Motion(Motion { sequence: 0, request }), 0).unwrap();
        let tag = frame.data()[1];
        prop_assert!(MotionRequest::NAMES.contains(&(tag, request.name())), "{tag} {request:?}");
        let moves = ["move-joint", "move-line", "jump", "move-arc"];
        prop_assert_eq!(request.is_move(), moves.contains(&request.name()));
    }
}

#[test]
fn a_pose_is_asked_for_with_a_posture() {
    let posture = Posture {
        elbow: ElbowSide::Negative,
        turn: WristTurn::PlusOne,
    };
    let (target, speed) = ([0.1; 4], 1.0);
    let line = MotionRequest::MoveLine {
        target,
        speed,
        posture,
        tool_speed: 0.0,
        zone: 0.0,
    };
    let arc = MotionRequest::MoveArc {
        target,
        via: [0.1; 3],
        speed,
        posture,
        tool_speed: 0.0,
        zone: 0.0,
    };
    let jump = MotionRequest::Jump {
        target,
        top: 0.2,
        clearance: 0.0,
        speed,
        posture,
        zone: 0.0,
    };
    let joint = MotionRequest::MoveJoint {
        target,
        speed,
        zone: 0.0,
    };
    let found = [line, arc, jump, joint].map(|request| request.posture());
    assert_eq!(found, [Some(posture), Some(posture), Some(posture), None]);
}

/// From -2 to 2 by number; the nearest has none.
#[test]
fn a_turn_is_found_by_its_number() {
    use WristTurn::{MinusOne, MinusTwo, Nearest, PlusOne, PlusTwo, Zero};
    for (number, turn) in [MinusTwo, MinusOne, Zero, PlusOne, PlusTwo]
        .into_iter()
        .enumerate()
    {
        let number = number as i8 - WristTurn::MOST;
        assert_eq!(WristTurn::of_number(number), Some(turn));
        assert_eq!(turn.number(), Some(number), "{turn}");
    }
    assert_eq!(WristTurn::of_number(3), None);
    assert_eq!(WristTurn::of_number(-3), None);
    assert_eq!(Nearest.number(), None);
}

/// Theirs is a torque to which another one can be added.
#[test]
fn laws_of_computed_torque_take_a_compensation() {
    for &law in Law::ALL {
        let expected = law.name().starts_with("computed-torque");
        assert_eq!(law.takes_compensation(), expected, "{law}");
    }
}
