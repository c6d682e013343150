//! Requests of an operator, and the answers.

use firmware::control::controller::{Config, Controller};
use firmware::control::states::Event;
use firmware::mechanics::arm::IRB_930;
use protocol::codec::encode;
use protocol::messages::{
    Compensation, Law, Message, Mode, MotionRequest, Outcome, ParameterReply, RefusalReason, Server,
};
use protocol::table::HELLO;

use crate::bench::{Bench, PERIOD};

#[test]
fn requests_are_refused_where_they_make_no_sense() {
    let mut bench = Bench::enabled();
    let move_to = |target| MotionRequest::MoveJoint {
        target,
        speed: 1.0,
        zone: 0.0,
    };
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

/// A flood of requests is answered one by one; frames that find no room on the bus are counted, not forgotten.
#[test]
fn answers_that_pile_up_are_sent_or_counted() {
    let mut bench = Bench::enabled();
    let flood = 40;
    let mut answered = 0;
    for turn in 0..flood / 4 {
        bench.wire.full = turn == 3;
        for _ in 0..4 {
            let frame = bench.motion(MotionRequest::Stop);
            bench.wire.to_node.push_back(frame);
        }
        answered += replies(&bench.step());
    }
    answered += replies(&bench.run(20));
    assert_eq!(answered, flood - 4);
    // Four answers and the command of that sample.
    assert_eq!(bench.node.unsent(), 5);
}

fn replies(sent: &[Message]) -> usize {
    sent.iter()
        .filter(|message| matches!(message, Message::MotionReply(_)))
        .count()
}

#[test]
fn a_compensation_that_the_law_does_not_take_is_refused() {
    let mut bench = Bench::enabled();
    let select = |law, compensation| MotionRequest::SelectLaw { law, compensation };
    for law in Law::ALL {
        for compensation in Compensation::ALL {
            let taken = *compensation == Compensation::None
                || matches!(law, Law::ComputedTorqueJoint | Law::ComputedTorqueTask);
            let outcome = bench.request(select(*law, *compensation));
            if taken {
                assert_eq!(outcome, Some(Outcome::Accepted), "{law}:{compensation}");
            } else {
                assert_eq!(
                    bench.refusal(select(*law, *compensation)),
                    RefusalReason::NoCompensation,
                    "{law}:{compensation}"
                );
            }
        }
    }
}

/// The codec lets none of these through; the controller does not rely on it.
#[test]
fn a_payload_is_checked_by_the_rule_of_the_model() {
    let refused = |mass: f32, com: f32, inertia: f32| {
        let mut controller = Controller::new(Config::new(IRB_930, PERIOD));
        controller.event(Event::SelfTestPassed);
        let request = MotionRequest::SetPayload {
            mass,
            com: [com; 3],
            inertia: [inertia; 3],
        };
        controller.request(1, &request);
        match controller.take_reply().unwrap().outcome {
            Outcome::Accepted => None,
            Outcome::Refused(refusal) => Some((refusal.reason, refusal.value, refusal.limit)),
        }
    };
    assert_eq!(refused(2.0, 0.1, 0.1), None);
    assert_eq!(
        refused(23.0, 0.1, 0.1),
        Some((RefusalReason::PayloadTooHeavy, 23.0, 22.0))
    );
    assert_eq!(
        refused(-1.0, 0.1, 0.1),
        Some((RefusalReason::OutOfRange, -1.0, 0.0))
    );
    assert_eq!(
        refused(2.0, 0.1, -0.5),
        Some((RefusalReason::OutOfRange, -0.5, 0.0))
    );
    assert_eq!(
        refused(2.0, f32::NAN, 0.1),
        Some((RefusalReason::NotFinite, 0.0, 0.0))
    );
}

/// The pace that the last of these messages reports, %.
fn pace(sent: &[Message]) -> Option<u8> {
    sent.iter().rev().find_map(|message| match message {
        Message::State(state) => Some(state.pace),
        _ => None,
    })
}

#[test]
fn the_override_holds_a_move_and_lets_it_go_on() {
    let mut bench = Bench::moving();
    let set = |pace| MotionRequest::SetOverride { pace };
    assert_eq!(bench.request(set(0.0)), Some(Outcome::Accepted));
    let sent = bench.run(1000);
    assert_eq!((pace(&sent), bench.mode()), (Some(0), Mode::Moving));
    let held = *bench.node.controller().reference();
    assert_eq!((held.qd, held.qdd), Default::default());
    bench.run(1000);
    assert_eq!(*bench.node.controller().reference(), held);
    assert_eq!(bench.request(set(0.6)), Some(Outcome::Accepted));
    let sent = bench.run(1000);
    assert_eq!((pace(&sent), bench.mode()), (Some(60), Mode::Enabled));
    assert_ne!(bench.node.controller().reference().q, held.q);
    // It stays, whatever the state.
    assert_eq!(
        bench.request(MotionRequest::Disable),
        Some(Outcome::Accepted)
    );
    assert_eq!(pace(&bench.run(100)), Some(60));
    assert_eq!(bench.request(set(1.0)), Some(Outcome::Accepted));
    assert_eq!(pace(&bench.run(100)), Some(100));
}

/// Once each; and who greets the controller has not greeted the operator.
#[test]
fn answers_of_the_drives_are_passed_on_once() {
    let mut bench = Bench::enabled();
    let value = ParameterReply::Value {
        index: 0x1020,
        value: 5.0,
        lower: 1.0,
        upper: 50.0,
    };
    for (reply, counter, is_passed_on) in [
        (value, 0, true),
        (value, 0, false),
        (value, 1, true),
        (ParameterReply::Hello(HELLO), 2, false),
    ] {
        let frame = encode(&Message::ParameterReply(Server::Drives, reply), counter);
        bench.wire.to_node.push_back(frame.unwrap());
        let sent = bench.poll();
        let answer = Message::ParameterReply(Server::Controller, reply);
        assert_eq!(sent.contains(&answer), is_passed_on, "{reply:?} {counter}");
    }
}
