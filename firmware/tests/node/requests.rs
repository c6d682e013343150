//! What an operator asks for, and the answers.

use protocol::messages::{Message, MotionRequest, Outcome, RefusalReason};

use crate::bench::Bench;

#[test]
fn requests_are_refused_where_they_make_no_sense() {
    let mut bench = Bench::enabled();
    let move_to = |target| MotionRequest::MoveJoint { target, speed: 1.0 };
    assert_eq!(
        bench.refusal(MotionRequest::Enable),
        RefusalReason::WrongState
    );
    assert_eq!(
        bench.refusal(MotionRequest::FaultReset),
        RefusalReason::WrongState
    );
    assert_eq!(
        bench.refusal(move_to([0.0, 3.0, 0.1, 0.0])),
        RefusalReason::JointLimit
    );
    let heavy = MotionRequest::SetPayload {
        mass: 30.0,
        com: [0.0; 3],
        inertia: [0.1; 3],
    };
    assert_eq!(bench.refusal(heavy), RefusalReason::PayloadTooHeavy);
    let wild = MotionRequest::SetGains {
        bandwidth: 900.0,
        damping: 1.0,
        observer: 10.0,
    };
    assert_eq!(bench.refusal(wild), RefusalReason::OutOfRange);
    assert_eq!(
        bench.request(MotionRequest::Disable),
        Some(Outcome::Accepted)
    );
    assert_eq!(
        bench.refusal(move_to([0.0, 1.0, 0.1, 0.0])),
        RefusalReason::NotEnabled
    );
}

/// A flood of requests is answered one by one; what finds no room is counted, not forgotten.
#[test]
fn answers_that_pile_up_are_sent_or_counted() {
    let mut bench = Bench::enabled();
    let flood = 40;
    let mut answered = 0;
    for _ in 0..flood / 4 {
        for _ in 0..4 {
            let frame = bench.motion(MotionRequest::Stop);
            bench.wire.to_node.push_back(frame);
        }
        answered += replies(&bench.step());
    }
    answered += replies(&bench.run(20));
    assert!(
        answered < flood,
        "the flood is to be more than the outbox holds"
    );
    assert_eq!(answered + usize::from(bench.node.unsent()), flood);
}

fn replies(sent: &[Message]) -> usize {
    sent.iter()
        .filter(|message| matches!(message, Message::MotionReply(_)))
        .count()
}
