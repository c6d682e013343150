//! Moves at another pace than planned: at any time, in any direction, down to standstill and on again. Judged by the recursive
//! Newton-Euler dynamics, which the queue does not use.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::planned::{joints, plan, robot, two_kg};
use firmware::mechanics::arm::{ArmModel, IRB_930, Payload};
use firmware::mechanics::body::{Body, TORQUE_SHARE};
use firmware::mechanics::dynamics::newton_euler;
use firmware::mechanics::kinematics::{self, Pose};
use firmware::trajectory::queue::{MoveQueue, Progress, Stride};
use firmware::trajectory::request::{Request, Target};
use firmware::trajectory::torque_budget::TorqueBudget;
use firmware::trajectory::{Reference, Setpoint};
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;
use protocol::messages::Posture;

const PERIOD: f32 = 1e-3;
/// More than the torques can make of the jerks of the joints, rad/s^3 and m/s^3.
const JERK: [f32; 4] = [4e4, 4e4, 1e4, 2e5];

/// One move in a queue, sample by sample.
struct Run<'a> {
    budget: TorqueBudget<'a>,
    queue: MoveQueue,
    setpoint: Setpoint,
}

impl<'a> Run<'a> {
    fn new(
        budget: TorqueBudget<'a>,
        from: &Vector4<f32>,
        target: Target,
        speed: f32,
    ) -> Option<Self> {
        let mut queue = MoveQueue::new();
        queue.clear(from);
        let request = Request {
            sequence: 1,
            target,
            speed,
            tool_speed: 0.0,
            zone: 0.0,
        };
        queue.push(request).unwrap();
        while queue.has_to_plan() {
            if let Some((_, answer)) = queue.plan(&budget, 0) {
                answer.ok()?;
            }
        }
        Some(Self {
            budget,
            queue,
            setpoint: Setpoint::rest(*from),
        })
    }

    fn step(&mut self) -> (Progress, Reference) {
        let stride = Stride {
            steps: 1,
            period: PERIOD,
            lead: 0.0,
            stopping: false,
        };
        let progress = self
            .queue
            .advance(&self.budget, &stride, &mut self.setpoint);
        (progress, self.setpoint.reference)
    }
}

/// Largest share of a torque that a motion needs.
fn need(arm: &ArmModel, body: &Body, payload: &Payload, r: &Reference) -> f32 {
    let torque = newton_euler::inverse(arm, payload, &r.q, &r.qd, &r.qdd)
        + body.drive.rotor_inertia() * r.qdd
        + body.drive.friction(&r.qd);
    let motor = body.drive.motor_torque(&torque);
    let joint = torque.component_div(&arm.limits.effort).amax();
    joint.max(motor.component_div(&arm.drive.motor_torque_limit).amax())
}

/// Follows a move while the pace changes at these times (s), and checks every sample.
fn check(
    arm: &ArmModel,
    payload: &Payload,
    from: &Vector4<f32>,
    (target, speed): (Target, f32),
    changes: &[(f32, f32)],
) -> Result<(), TestCaseError> {
    let body = Body::new(arm, payload);
    let budget = TorqueBudget { arm, body: &body };
    let Some(mut run) = Run::new(budget, from, target, speed) else {
        return Ok(());
    };
    let planned = plan(arm, payload, from, target, speed).unwrap();
    // A hundredth for what lies between two samples, as where a joint of a line turns back.
    let most = (0..=800).fold(TORQUE_SHARE, |most, sample| {
        let t = planned.duration() * sample as f32 / 800.0;
        need(arm, &body, payload, &planned.at(arm, t).unwrap()).max(most)
    }) + 0.01;
    let mut before = Reference::rest(*from);
    let (mut at, mut begun) = (0.0, false);
    for sample in 0.. {
        let t = sample as f32 * PERIOD;
        for (_, pace) in changes
            .iter()
            .filter(|(when, _)| *when >= t && *when < t + PERIOD)
        {
            run.queue.set_pace(*pace);
        }
        // The last pace is above 0.
        prop_assert!(t < 60.0 + 20.0 * planned.duration(), "never arrived");
        let pace = run.queue.pace_now();
        let (progress, here) = run.step();
        let share = need(arm, &body, payload, &here);
        // What a plan needs at full pace, and no more.
        prop_assert!(share < most, "{share} of a torque at {t}");
        // Speed and position belong together; accelerations of 600 rad/s^2 may end within a sample.
        let moved = here.q - before.q - (here.qd + before.qd) * (0.5 * PERIOD);
        let bend = (here.qdd - before.qdd).abs() * (PERIOD * PERIOD);
        for axis in 0..4 {
            prop_assert!(
                moved[axis].abs() < bend[axis] + 1e-5,
                "{axis} jumps by {} at {t}",
                moved[axis]
            );
            let limit = arm.limits.velocity[axis] * 1.001;
            prop_assert!(
                here.qd[axis].abs() < limit,
                "speed {axis} {}",
                here.qd[axis]
            );
        }
        // On the path: where the trajectory is at its own time.
        // The first sample finds the arm at rest.
        if begun {
            at += 0.5 * f64::from(pace + run.queue.pace_now()) * f64::from(PERIOD);
        }
        begun |= pace > 0.0;
        let there = planned.at(arm, at as f32).unwrap();
        // A thousandth of a sample for the rounding of time.
        let off = (there.q - here.q).abs() - there.qd.abs() * (1e-3 * PERIOD);
        prop_assert!(off.max() < 1e-5, "{off} off its path at {t}");
        if progress == Progress::Arrived {
            prop_assert!((here.q - planned.end).amax() < 1e-5);
            prop_assert_eq!(run.queue.completed(), 1);
            return Ok(());
        }
        before = here;
    }
    unreachable!()
}

fn changes() -> impl Strategy<Value = Vec<(f32, f32)>> {
    let pace = prop_oneof![Just(0.0f32), Just(1.0), 0.01f32..1.0];
    let last = (0.5f32..1.0, 0.1f32..=1.0).prop_map(|it| vec![it]);
    (prop::collection::vec((0.0f32..0.5, pace), 0..5), last)
        .prop_map(|(changes, last)| [changes, last].concat())
}

proptest! {
    #![proptest_config(common::draws::cases(500))]

    #[test]
    fn joint_moves_keep_limits_and_path_at_any_pace(
        arm in robot(), from in joints(), to in joints(), mass in 0.0f32..22.0, speed in 0.3f32..1.0, changes in changes(),
    ) {
        let payload = Payload { mass, ..two_kg() };
        check(&arm, &payload, &from, (Target::Joints(to), speed), &changes)?;
    }

    #[test]
    fn jumps_keep_limits_and_path_at_any_pace(
        arm in robot(), r0 in 0.4f32..0.95, a0 in -1.0f32..1.0, r1 in 0.4f32..0.95, a1 in -1.0f32..1.0,
        rise in 0.0f32..0.1, mass in 0.0f32..22.0, changes in changes(),
    ) {
        let payload = Payload { mass, com: Vector3::new(0.0, 0.0, 0.05), ..two_kg() };
        let pose = |r: f32, a: f32| Pose { x: r * a.cos(), y: r * a.sin(), z: -0.3, yaw: 0.0 };
        let from = kinematics::inverse(&arm, &pose(r0, a0), kinematics::Elbow::Positive, &Vector4::zeros());
        let Ok(from) = from else { return Ok(()) };
        let target = Target::Jump { pose: pose(r1, a1), posture: Posture::NEAREST, top: -0.3 + rise, clearance: 0.0 };
        check(&arm, &payload, &from, (target, 1.0), &changes)?;
    }

    #[test]
    fn lines_keep_limits_and_path_at_any_pace(
        x0 in 0.4f32..0.8, y0 in -0.3f32..0.3, x1 in 0.4f32..0.8, y1 in -0.3f32..0.3, yaw in -2.0f32..2.0,
        changes in changes(),
    ) {
        let start = Pose { x: x0, y: y0, z: -0.2, yaw: 0.0 };
        let end = Pose { x: x1, y: y1, z: -0.25, yaw };
        let from = kinematics::inverse(&IRB_930, &start, kinematics::Elbow::Positive, &Vector4::zeros()).unwrap();
        check(&IRB_930, &two_kg(), &from, (Target::Line(end, Posture::NEAREST), 1.0), &changes)?;
    }

    #[test]
    fn arcs_keep_limits_and_path_at_any_pace(
        r in 0.45f32..0.85, a in -1.0f32..1.0, radius in 0.02f32..0.15, heading in -3.1f32..3.1, turn in 0.5f32..6.0, yaw in -2.0f32..2.0,
        changes in changes(),
    ) {
        let on = |turn: f32| {
            let angle = heading + turn;
            let (x, y) = (r * a.cos() + radius * angle.cos(), r * a.sin() + radius * angle.sin());
            Pose { x, y, z: -0.2, yaw: 0.0 }
        };
        let (start, via, end) = (on(0.0), on(0.4 * turn), Pose { yaw, ..on(turn) });
        let Ok(from) = kinematics::inverse(&IRB_930, &start, kinematics::Elbow::Positive, &Vector4::zeros()) else { return Ok(()) };
        let via = Vector3::new(via.x, via.y, via.z);
        check(&IRB_930, &two_kg(), &from, (Target::Arc(via, end, Posture::NEAREST), 1.0), &changes)?;
    }

    /// A pace that does not change makes a move last as much longer.
    #[test]
    fn an_even_pace_stretches_time(from in joints(), to in joints(), pace in 0.01f32..1.0) {
        let body = Body::new(&IRB_930, &two_kg());
        let budget = TorqueBudget { arm: &IRB_930, body: &body };
        let mut run = Run::new(budget, &from, Target::Joints(to), 1.0).unwrap();
        let planned = plan(&IRB_930, &two_kg(), &from, Target::Joints(to), 1.0).unwrap();
        run.queue.set_pace(pace);
        // The first sample finds the arm at rest.
        let mut samples = 0;
        while run.step().0 == Progress::UnderWay {
            samples += 1;
        }
        let lasts = samples as f32 * PERIOD;
        let wanted = planned.duration() / pace;
        prop_assert!((lasts - wanted).abs() < 3.0 * PERIOD + 1e-4 * wanted, "{lasts} {wanted}");
    }
}

/// Held for a second in mid-motion, the arm stands on its path, and goes on from there.
#[test]
fn a_held_arm_stands_until_it_may_go_on() {
    let body = Body::new(&IRB_930, &two_kg());
    let budget = TorqueBudget {
        arm: &IRB_930,
        body: &body,
    };
    let from = Vector4::new(0.0, 1.0, 0.1, 0.0);
    let to = Vector4::new(1.5, 0.2, 0.2, 1.0);
    let mut run = Run::new(budget, &from, Target::Joints(to), 1.0).unwrap();
    for _ in 0..100 {
        run.step();
    }
    run.queue.set_pace(0.0);
    for _ in 0..500 {
        run.step();
    }
    let (_, held) = run.step();
    assert_eq!((held.qd, held.qdd), (Vector4::zeros(), Vector4::zeros()));
    assert!((held.q - from).amax() > 0.05 && (held.q - to).amax() > 0.05);
    for _ in 0..1000 {
        assert_eq!(run.step(), (Progress::UnderWay, held));
    }
    assert_eq!(run.queue.pace_now(), 0.0);
    run.queue.set_pace(1.0);
    let samples = (0..1000)
        .find(|_| run.step().0 == Progress::Arrived)
        .unwrap();
    assert!(samples > 100, "{samples}");
    assert!((run.setpoint.reference.q - to).amax() < 1e-5);
}

/// Two moves, the second one sometimes of no length, with gaps in the feedback, changes of the pace and a stop at any time: position and
/// speed go on from sample to sample, and each move that has ended is told.
#[derive(Debug, Clone)]
struct Ride {
    second: Vector4<f32>,
    steps: Vec<u32>,
    changes: Vec<(usize, f32)>,
    stop: Option<usize>,
}

fn rides() -> impl Strategy<Value = Ride> {
    let second = prop_oneof![joints().boxed(), Just(Vector4::repeat(f32::NAN)).boxed()];
    let pace = prop_oneof![Just(0.3f32), Just(1.0), 0.1f32..1.0];
    (
        second,
        prop::collection::vec(prop_oneof![4 => Just(1u32), 1 => 1u32..=5], 64),
        prop::collection::vec((0usize..400, pace), 0..3),
        prop::option::weighted(0.3, 0usize..400),
    )
        .prop_map(|(second, steps, changes, stop)| Ride {
            second,
            steps,
            changes,
            stop,
        })
}

fn ride(from: &Vector4<f32>, to: &Vector4<f32>, ride: &Ride) -> Result<(), TestCaseError> {
    let body = Body::new(&IRB_930, &two_kg());
    let budget = TorqueBudget {
        arm: &IRB_930,
        body: &body,
    };
    let Some(mut run) = Run::new(budget, from, Target::Joints(*to), 1.0) else {
        return Ok(());
    };
    // Not a number stands for where the first move ends, a millionth of a radian off.
    let second = ride.second.zip_map(
        to,
        |second, to| if second.is_nan() { to + 1e-6 } else { second },
    );
    let request = Request {
        sequence: 2,
        target: Target::Joints(second),
        speed: 1.0,
        tool_speed: 0.0,
        zone: 0.0,
    };
    run.queue.push(request).unwrap();
    while run.queue.has_to_plan() {
        if let Some((_, answer)) = run.queue.plan(&run.budget, 0) {
            prop_assert!(answer.is_ok());
        }
    }
    let ends = [*to, second];
    let mut before = Reference::rest(*from);
    for sample in 0..20_000 {
        for (_, pace) in ride.changes.iter().filter(|(when, _)| *when == sample) {
            run.queue.set_pace(*pace);
        }
        let stopping = ride.stop.is_some_and(|stop| sample >= stop);
        let steps = ride.steps[sample % ride.steps.len()];
        let stride = Stride {
            steps,
            period: PERIOD,
            lead: 0.75 * PERIOD,
            stopping,
        };
        let told = run.queue.completed();
        let progress = run.queue.advance(&run.budget, &stride, &mut run.setpoint);
        let here = run.setpoint.reference;
        // The speed is at most that of the faster end, and what torques can add in between.
        let time = steps as f32 * PERIOD;
        for (axis, jerk) in JERK.iter().enumerate() {
            let gain = here.qdd[axis].abs().max(before.qdd[axis].abs()).max(1.0) + jerk * time;
            let speed = here.qd[axis].abs().max(before.qd[axis].abs()) + gain * time;
            let moved = (here.q[axis] - before.q[axis]).abs();
            prop_assert!(
                moved <= speed * time + 1e-6,
                "{axis} jumps by {moved} at {sample}"
            );
        }
        if run.queue.completed() != told {
            let end = ends[usize::from(run.queue.completed()) - 1];
            for (axis, jerk) in JERK.iter().enumerate() {
                let near = (here.q[axis] - end[axis]).abs();
                prop_assert!(
                    near < jerk * time * time * time + 1e-5,
                    "{near} from the end at {sample}"
                );
            }
        }
        if progress == Progress::Arrived {
            if !stopping {
                prop_assert_eq!(run.queue.completed(), 2);
                prop_assert!((here.q - second).amax() < 1e-5);
            }
            prop_assert_eq!(here.qd, Vector4::zeros());
            return Ok(());
        }
        before = here;
    }
    Err(TestCaseError::fail("never arrived"))
}

proptest! {
    #![proptest_config(common::draws::cases(500))]

    #[test]
    fn one_move_goes_over_into_the_next(from in joints(), to in joints(), course in rides()) {
        ride(&from, &to, &course)?;
    }
}
