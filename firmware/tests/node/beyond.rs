//! Manual operation frees an arm from beyond its range, and only from there.

use firmware::mechanics::arm::{Axis, IRB_930};
use nalgebra::Vector4;
use protocol::messages::{
    Cause, ControlWord, Mode, MotionRequest, Operation, Outcome, RefusalReason,
};

use crate::bench::{Bench, by_itself};
use crate::manual::{go, here, hold, set};

/// Beyond the limit of the elbow and its margin, 2.531 + 0.02 rad, no torque stays on in automatic operation.
#[test]
fn manual_operation_frees_an_arm_from_beyond_a_limit() {
    for (operation, side) in [
        (Operation::Automatic, 1.0),
        (Operation::Automatic, -1.0),
        (Operation::Manual, 1.0),
        (Operation::Manual, -1.0f32),
    ] {
        let at = |elbow: f32| [0.2, side * elbow, 0.15, 0.3];
        let mut bench = Bench::with(by_itself());
        bench.put(&Vector4::from(at(2.6)));
        bench.hello(protocol::table::HASH);
        bench.run(2);
        bench.request(MotionRequest::Stop);
        assert_eq!(bench.request(set(operation)), Some(Outcome::Accepted));
        bench.request(MotionRequest::Enable);
        bench.run(100);
        if operation == Operation::Automatic {
            assert_eq!(bench.node.controller().cause(), Cause::SoftLimit);
            continue;
        }
        assert_eq!(bench.mode(), Mode::Enabled);
        bench.follows = true;
        let further = MotionRequest::MoveJoint {
            target: at(2.7),
            speed: 1.0,
            zone: 0.0,
        };
        assert_eq!(bench.refusal(further), RefusalReason::JointLimit);
        let aside = MotionRequest::MoveJoint {
            target: [0.1, side * 2.6, 0.15, 0.3],
            speed: 1.0,
            zone: 0.0,
        };
        assert_eq!(bench.refusal(aside), RefusalReason::JointLimit);
        go(&mut bench, at(2.4));
        hold(&mut bench, 3000);
        assert_eq!(bench.mode(), Mode::Enabled);
        assert!((here(&bench).y - side * 2.4).abs() < 1e-5);
        assert!(bench.words(1)[0].contains(ControlWord::BRAKE_RELEASE));
    }
}

/// An arm that gets 2 mrad or 2 mm further than its reference, so beyond the limit and a margin of 0.2 while the reference is on its
/// way there.
#[test]
fn manual_operation_frees_no_arm_that_goes_further() {
    let (lower, upper) = (IRB_930.limits.lower, IRB_930.limits.upper);
    for axis in Axis::ALL {
        for (end, side) in [(axis.of(&lower), -1.0), (axis.of(&upper), 1.0f32)] {
            let [begin, target] = [0.1, 0.001].map(|before| {
                let mut place = Vector4::new(0.2, 1.5, 0.15, 0.3);
                *axis.of_mut(&mut place) = end - side * before;
                place
            });
            let mut config = by_itself();
            config.setup.monitor.range_margin = Vector4::repeat(2e-4);
            let mut bench = Bench::with(config);
            bench.put(&begin);
            bench.enable();
            bench.follows = true;
            assert_eq!(
                bench.request(set(Operation::Manual)),
                Some(Outcome::Accepted)
            );
            go(&mut bench, target.into());
            for _ in 0..3000 {
                if bench.mode() != Mode::Moving {
                    break;
                }
                let frame = bench.motion(MotionRequest::Hold);
                bench.wire.to_node.push_back(frame);
                let way = (here(&bench) - begin).amax();
                *axis.of_mut(&mut bench.off) = side * (0.05 * way).min(2e-3);
                bench.step();
            }
            let fault = *bench.node.controller().fault();
            let told = (bench.mode(), fault.cause, fault.axis);
            assert_eq!(
                told,
                (Mode::FaultReaction, Cause::SoftLimit, axis.into()),
                "{side}: {fault}"
            );
        }
    }
}
