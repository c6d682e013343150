//! Nanoseconds of a step of half a millisecond of the plant, for tests/bench, which times MuJoCo on the same motion.
//!
//! The two horizontal motors push to and fro for 50 ms each, the lift's bears its weight: no joint reaches a stop.

use std::time::Instant;

use sim::model::RobotModel;
use sim::plant::Plant;

const STEP_NS: u64 = 500_000;
const STEPS_A_PUSH: u64 = 100;
const PUSHES: u64 = 2000;
/// Motor torques, N m; the lift's is its weight by the pitch of the screw.
const PUSH: [f64; 4] = [1.0, 0.5, -0.0761, 0.0];

fn main() {
    let mut plant = Plant::new(&RobotModel::irb_930_22_105(), [0.0, 1.0, 0.15, 0.0]);
    plant.set_max_step(STEP_NS);
    plant.set_torque_enabled(true);
    plant.set_brake(false);
    let mut now = 0;
    let began = Instant::now();
    for push in 0..PUSHES {
        // Forth and back first for half as long: the arm swings about where it began.
        let sign = if push.div_ceil(2) % 2 == 0 { 1.0 } else { -1.0 };
        let [shoulder, elbow, lift, wrist] = PUSH;
        plant.set_motor_torque([sign * shoulder, sign * elbow, lift, wrist]);
        for _ in 0..STEPS_A_PUSH {
            now += STEP_NS;
            plant.advance_to(now);
        }
    }
    let steps = PUSHES * STEPS_A_PUSH;
    let ns = began.elapsed().as_nanos() as f64 / steps as f64;
    let q = plant.q();
    println!(
        "{{\"ns\": {ns:.1}, \"q\": [{}, {}, {}, {}]}}",
        q[0], q[1], q[2], q[3]
    );
}
