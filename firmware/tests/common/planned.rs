//! Plans, and walks along them against the limits of the robot, judged by the recursive Newton-Euler dynamics, which the planner
//! does not use.

use firmware::mechanics::arm::{ArmModel, IRB_930, Payload};
use firmware::mechanics::body::Body;
use firmware::mechanics::dynamics::newton_euler;
use firmware::trajectory::planner::Planner;
use firmware::trajectory::request::{Request, Target};
use firmware::trajectory::torque_budget::TorqueBudget;
use firmware::trajectory::{Reference, Trajectory};
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;
use protocol::messages::Refusal;

pub(crate) fn two_kg() -> Payload {
    Payload {
        mass: 2.0,
        com: Vector3::new(0.0, 0.0, 0.05),
        inertia: Vector3::new(0.008, 0.008, 0.01),
    }
}

/// Plans to the end within a bounded number of ticks.
pub(crate) fn plan(
    arm: &ArmModel,
    payload: &Payload,
    from: &Vector4<f32>,
    target: Target,
    speed: f32,
) -> Result<Trajectory, Refusal> {
    plan_with(Planner::new(), arm, payload, from, target, (speed, 0.0))
}

/// The same by this planner, with a speed of the tool, m/s.
pub(crate) fn plan_with(
    mut planner: Planner,
    arm: &ArmModel,
    payload: &Payload,
    from: &Vector4<f32>,
    target: Target,
    (speed, tool_speed): (f32, f32),
) -> Result<Trajectory, Refusal> {
    let body = Body::new(arm, payload);
    let budget = TorqueBudget { arm, body: &body };
    planner.begin(
        &Request {
            sequence: 1,
            target,
            speed,
            tool_speed,
            zone: 0.0,
        },
        from,
    );
    for _ in 0..Planner::MAX_STEPS {
        if let Some(result) = planner.work(&budget) {
            return result.map(|()| *planner.trajectory());
        }
    }
    panic!("not planned within {} steps", Planner::MAX_STEPS)
}

/// Walks a trajectory and checks every sample against every limit.
///
/// The samples are eight times as dense as the planner's, so any excess between two of its samples shows here: it must
/// stay within the planner's margin.
pub(crate) fn check(
    arm: &ArmModel,
    payload: &Payload,
    trajectory: &Trajectory,
) -> Result<(), TestCaseError> {
    let duration = trajectory.duration();
    let steps = 800;
    let walk = (0..=steps).map(|i| {
        let t = duration * i as f32 / steps as f32;
        trajectory
            .at(arm, t)
            .expect("a planned path stays in reach")
    });
    check_walk(arm, payload, duration / steps as f32, walk)?;
    let end = trajectory.at(arm, duration * 1.01).expect("in reach");
    prop_assert!((end.q - trajectory.end).amax() < 1e-5);
    prop_assert_eq!(end.qd, Vector4::zeros());
    Ok(())
}

/// Checks a motion, `h` seconds from sample to sample, against every limit.
pub(crate) fn check_walk(
    arm: &ArmModel,
    payload: &Payload,
    h: f32,
    walk: impl Iterator<Item = Reference>,
) -> Result<(), TestCaseError> {
    let body = Body::new(arm, payload);
    let slack = 1.0 + 1e-3;
    let mut previous: Option<(Vector4<f32>, Vector4<f32>, Vector4<f32>)> = None;
    for (i, r) in walk.enumerate() {
        // Dry friction is there at once: the rate of a torque is that of the rest.
        let smooth = newton_euler::inverse(arm, payload, &r.q, &r.qd, &r.qdd)
            + body.drive.rotor_inertia() * r.qdd
            + arm.drive.viscous.component_mul(&r.qd);
        let torque = newton_euler::inverse(arm, payload, &r.q, &r.qd, &r.qdd)
            + body.drive.rotor_inertia() * r.qdd
            + body.drive.friction(&r.qd);
        let motor = body.drive.motor_torque(&torque);
        for axis in 0..4 {
            let limits = &arm.limits;
            prop_assert!(
                r.q[axis] >= limits.lower[axis] - 1e-5 && r.q[axis] <= limits.upper[axis] + 1e-5
            );
            prop_assert!(
                r.qd[axis].abs() <= limits.velocity[axis] * slack,
                "speed {axis} {}",
                r.qd[axis]
            );
            prop_assert!(
                r.qdd[axis].abs() <= limits.acceleration[axis] * slack,
                "acceleration {axis} {}",
                r.qdd[axis]
            );
            prop_assert!(
                torque[axis].abs() <= limits.effort[axis],
                "effort {axis} {}",
                torque[axis]
            );
            prop_assert!(
                motor[axis].abs() <= arm.drive.motor_torque_limit[axis],
                "motor {axis} {}",
                motor[axis]
            );
        }
        // Positions, speeds and accelerations are consistent: no jump between two samples.
        if let Some((before, acceleration, earlier)) = previous {
            for axis in 0..4 {
                let bound = arm.limits.velocity[axis] * h * slack + 1e-5;
                prop_assert!((r.q[axis] - before[axis]).abs() <= bound);
                // Jerk by differences: along a line the reference omits a part of it.
                // f32 accelerations of up to 600 rad/s^2, each off by some 20 u.
                let jerk = (r.qdd[axis] - acceleration[axis]).abs() / h;
                let noise = 20.0 * f32::EPSILON * r.qdd.amax() / h;
                prop_assert!(
                    jerk <= arm.limits.jerk[axis] * slack + noise,
                    "jerk {axis} {jerk}"
                );
                let rates = |torque: &Vector4<f32>, limit: &Vector4<f32>| {
                    torque.abs()[axis] * arm.limits.effort_rise_time[axis] / (limit[axis] * h)
                };
                let change = smooth - earlier;
                // Sums of several terms of up to twice the limit, each off by 4 u.
                let noise = 64.0 * f32::EPSILON * arm.limits.effort_rise_time[axis] / h;
                let joint = change.abs()[axis] / (body.torque_rate[axis] * h);
                let motor = rates(
                    &body.drive.motor_torque(&change),
                    &arm.drive.motor_torque_limit,
                );
                prop_assert!(
                    joint.max(motor) <= 1.0 + noise,
                    "torque rate {axis} {joint} {motor} at {}",
                    i as f32 * h
                );
            }
        }
        previous = Some((r.q, r.qdd, smooth));
    }
    Ok(())
}

pub(crate) fn joints() -> impl Strategy<Value = Vector4<f32>> {
    (-2.6f32..2.6, -2.5f32..2.5, 0.0f32..0.3, -6.9f32..6.9)
        .prop_map(|(a, b, c, d)| Vector4::new(a, b, c, d))
}

/// The arm as it is, and with limits of acceleration and jerk.
pub(crate) fn robot() -> impl Strategy<Value = ArmModel> {
    let mut capped = IRB_930;
    capped.limits.acceleration = Vector4::new(60.0, 120.0, 60.0, 600.0);
    capped.limits.jerk = Vector4::new(2_500.0, 7_500.0, 10_000.0, 40_000.0);
    prop_oneof![Just(IRB_930), Just(capped)]
}
