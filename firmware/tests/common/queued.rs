//! Moves one after the other through the queue, sample by sample.

use firmware::mechanics::arm::{ArmModel, Payload};
use firmware::mechanics::body::Body;
use firmware::trajectory::queue::{MoveQueue, Progress, Stride};
use firmware::trajectory::request::{Request, Target};
use firmware::trajectory::torque_budget::TorqueBudget;
use firmware::trajectory::{Reference, Setpoint, Trajectory};
use nalgebra::Vector4;

use super::planned::plan;

/// As dense as the samples at which single moves are checked.
pub(crate) const PERIOD: f32 = 2.5e-4;

/// Moves one after the other, sample by sample.
pub(crate) struct Run {
    /// What was followed.
    pub(crate) walk: Vec<Reference>,
    /// Whether two moves were under way, and how many had ended.
    pub(crate) blending: Vec<(bool, u8)>,
}

/// How it goes.
#[derive(Default)]
pub(crate) struct Manner<'a> {
    /// When the pace changes, s, and to what.
    pub(crate) changes: &'a [(f32, f32)],
    /// Greatest speed of the flange, m/s.
    pub(crate) tool_speed: f32,
    /// Whether it is held in manual operation.
    pub(crate) held: bool,
    /// The sample from which on it is to stop.
    pub(crate) stop: Option<usize>,
}

/// Plans everything, then follows it; also the moves as they are planned by themselves. `None` where
/// one is refused.
pub(crate) fn run(
    arm: &ArmModel,
    payload: &Payload,
    from: &Vector4<f32>,
    moves: &[(Target, f32)],
    manner: &Manner<'_>,
) -> Option<(Run, Vec<Trajectory>)> {
    let body = Body::new(arm, payload);
    let budget = TorqueBudget { arm, body: &body };
    let mut queue = MoveQueue::new();
    if manner.held {
        queue.set_held(Some(true));
    }
    queue.clear(from);
    let mut single = Vec::new();
    let mut at = *from;
    for (number, (target, zone)) in moves.iter().enumerate() {
        let planned = plan(arm, payload, &at, *target, 1.0).ok()?;
        at = planned.end;
        single.push(planned);
        let request = Request {
            sequence: number as u8 + 1,
            target: *target,
            speed: 1.0,
            tool_speed: manner.tool_speed,
            zone: *zone,
        };
        queue.push(request).unwrap();
    }
    let mut steps = 0;
    while queue.has_to_plan() {
        queue.plan(&budget, 0);
        steps += 1;
        assert!(steps < 2000, "planning does not end");
    }
    let mut stride = Stride {
        steps: 1,
        period: PERIOD,
        lead: 0.0,
        stopping: false,
    };
    let mut setpoint = Setpoint::rest(*from);
    let mut run = Run {
        walk: Vec::new(),
        blending: Vec::new(),
    };
    loop {
        let now = run.walk.len() as f32 * PERIOD;
        for (_, pace) in manner
            .changes
            .iter()
            .filter(|(t, _)| *t >= now && *t < now + PERIOD)
        {
            queue.set_pace(*pace);
        }
        stride.stopping = (manner.stop).is_some_and(|stop| run.walk.len() >= stop);
        let progress = queue.advance(&budget, &stride, &mut setpoint);
        run.walk.push(setpoint.reference);
        run.blending.push((queue.is_blending(), queue.completed()));
        if progress == Progress::Arrived {
            return Some((run, single));
        }
        assert!(run.walk.len() < 400_000, "never arrives");
    }
}
