//! Queue of moves: waiting, being planned, planned, under way.

use heapless::Deque;
use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::clock::Clock;
use super::path::Path;
use super::planner::Planner;
use super::request::{Answer, Request};
use super::torque_budget::{RAMP_SHARE, STOP_SHARE, TorqueBudget};
use super::{Rates, Reference, Setpoint, Trajectory};
use crate::mechanics::math::sqrt;

/// Capacity for requests, and as many planned moves.
pub const CAPACITY: usize = 4;

/// Least pace to which moves are slowed down for want of torque. An arm that needs more has met something; that it stands off
/// its path must not come out much later.
const LEAST_PACE: f32 = 0.5;
/// Share of the torque that moves are slowed down to.
const EASED: f32 = 0.97;

/// Result of [`MoveQueue::advance`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The motion continues.
    UnderWay,
    /// At rest: the last move or the stop has ended.
    Arrived,
}

/// How far the motion goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stride {
    /// Samples since the last reference.
    pub steps: u32,
    /// Sampling period, s.
    pub period: f32,
    /// From the sampling instant until the command acts, s.
    pub lead: f32,
    /// Whether the arm is to come to rest, on its path.
    pub stopping: bool,
}

/// All motion that an operator has asked for and that has not ended.
#[derive(Clone, Debug)]
pub struct MoveQueue {
    requests: Deque<Request, CAPACITY>,
    planner: Planner,
    moves: Deque<Trajectory, CAPACITY>,
    /// Runs along the first of `moves`.
    clock: Clock,
    /// Time on it at the last sample, s.
    now: f32,
    /// Pace that the operator has asked for.
    asked: f32,
    /// Pace at which the torque was found to suffice.
    found: f32,
    /// Pace at which the motors do not get too hot. Moves that begin follow it, and one under way whose pace changes for another reason.
    cool: f32,
    /// In manual operation: whether somebody holds it.
    held: Option<bool>,
    /// Whether the last sample followed a curve of the tool, which makes it expensive.
    pub(crate) followed_curve: bool,
    /// Whether it followed two moves, which makes it more so.
    followed_two: bool,
    /// Where the last planned move ends: the next one starts there.
    plan_end: Vector4<f32>,
    completed: u8,
}

impl MoveQueue {
    /// An empty queue.
    pub fn new() -> Self {
        Self {
            requests: Deque::new(),
            planner: Planner::new(),
            moves: Deque::new(),
            clock: Clock::new(1.0),
            now: 0.0,
            asked: 1.0,
            found: 1.0,
            cool: 1.0,
            held: None,
            followed_curve: false,
            followed_two: false,
            plan_end: Vector4::zeros(),
            completed: 0,
        }
    }

    /// Number of moves that have not ended, in any stage.
    pub fn len(&self) -> u8 {
        // At most two queues and one in the planner: far below 255.
        (self.moves.len() + self.requests.len()) as u8 + u8::from(self.is_planning())
    }

    /// Whether all moves have ended.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether a move is being planned.
    pub fn is_planning(&self) -> bool {
        !self.planner.is_idle() && !self.planner.is_blending()
    }

    /// Whether a move is being planned, or the passage between two, which makes a sample expensive.
    pub fn is_busy(&self) -> bool {
        !self.planner.is_idle()
    }

    /// Whether there is a planned move to begin or continue.
    pub fn is_ready(&self) -> bool {
        !self.moves.is_empty()
    }

    /// Number of the last move that ended as planned.
    pub fn completed(&self) -> u8 {
        self.completed
    }

    /// Number of the move under way, or about to begin.
    pub fn under_way(&self) -> Option<u8> {
        self.moves.front().map(|trajectory| trajectory.sequence)
    }

    /// Share of its planned speed at which a move passes, once it has got there.
    pub fn pace(&self) -> f32 {
        if self.held == Some(false) {
            0.0
        } else {
            self.asked.min(self.found).min(self.cool)
        }
    }

    /// Whether somebody holds the motion: otherwise it pauses on its path. Moves planned from now on keep the tool slow. `None` in
    /// automatic operation.
    pub fn set_held(&mut self, held: Option<bool>) {
        if held != self.held {
            self.held = held;
            self.planner.keep_tool_slow(held.is_some());
            self.clock.set_pace(self.pace());
        }
    }

    /// Share of its planned speed at which the move under way passes, or the next one will begin.
    pub fn pace_now(&self) -> f32 {
        if self.is_ready() {
            self.clock.time_scale()
        } else {
            self.pace()
        }
    }

    /// Speed override, 0 to 1. What was found before is forgotten.
    pub fn set_pace(&mut self, pace: f32) {
        self.asked = pace;
        self.try_full_pace();
    }

    /// Pace at which moves may begin for the heat of the motors.
    pub fn set_cool_pace(&mut self, pace: f32) {
        self.cool = pace;
    }

    /// Forgets the pace at which the torque was found to suffice: for another payload, say.
    pub fn try_full_pace(&mut self) {
        self.found = 1.0;
        self.clock.set_pace(self.pace());
    }

    /// Slows down for want of torque, of which the move needs `excess` times as much as there is. `now` where that helps: an arm that
    /// brakes would need more torque for it, so that only the moves after this one can be slower.
    pub fn ease(&mut self, excess: f32, now: bool) {
        // Nearly all torque that a motion needs goes with the square of its pace.
        let pace = self.clock.time_scale() * sqrt(EASED / excess);
        self.found = self.found.min(pace.max(LEAST_PACE));
        if now {
            self.clock.set_pace(self.pace());
        }
    }

    /// Whether the pace is changing, which makes a sample expensive.
    pub fn is_ramping(&self) -> bool {
        self.is_ready() && !self.clock.is_even()
    }

    /// Whether two moves are under way, which makes a sample expensive.
    pub fn is_blending(&self) -> bool {
        self.followed_two
    }

    /// Takes a request.
    ///
    /// # Errors
    /// [`RefusalReason::QueueFull`].
    pub fn push(&mut self, request: Request) -> Result<(), Refusal> {
        self.requests
            .push_back(request)
            .map_err(|_| Refusal::because(RefusalReason::QueueFull))
    }

    /// Withdraws one unanswered request and returns its number; `None` when there is none left.
    pub fn withdraw(&mut self) -> Option<u8> {
        self.planner
            .cancel()
            .or_else(|| self.requests.pop_front().map(|request| request.sequence))
    }

    /// Drops all planned moves; the next one starts at `q`.
    pub fn clear(&mut self, q: &Vector4<f32>) {
        self.moves.clear();
        if self.planner.is_blending() {
            self.planner.cancel();
        }
        self.clock = Clock::new(self.pace());
        self.now = 0.0;
        self.followed_two = false;
        self.plan_end = *q;
    }

    /// Whether there is a move to plan and room for it.
    pub fn has_to_plan(&self) -> bool {
        self.is_busy() || !(self.requests.is_empty() || self.moves.is_full())
    }

    /// Instructions that the next step of planning takes at the most.
    pub(crate) fn planning_cost(&self) -> u16 {
        self.planner.cost()
    }

    /// A step of planning, and more as long as all of them take at most `room` instructions. Returns an answer once there is one.
    pub fn plan(&mut self, budget: &TorqueBudget<'_>, room: u16) -> Option<Answer> {
        let mut taken = 0_u16;
        loop {
            // Without room for more than one, what that takes does not matter.
            if room > 0 {
                taken = taken.saturating_add(self.planner.cost());
            }
            let answer = self.step(budget);
            let is_full = taken >= room || taken.saturating_add(self.planner.cost()) > room;
            if answer.is_some() || is_full || self.planner.is_idle() {
                return answer;
            }
        }
    }

    /// One step of planning.
    fn step(&mut self, budget: &TorqueBudget<'_>) -> Option<Answer> {
        if self.planner.is_blending() {
            self.find_overlap(budget);
            return None;
        }
        if self.planner.is_idle() {
            if self.moves.is_full() {
                return None;
            }
            let request = self.requests.pop_front()?;
            self.planner.begin(&request, &self.plan_end);
            return None;
        }
        let planned = self.planner.work(budget)?;
        let sequence = self.planner.sequence();
        let planned = planned.map(|()| {
            let trajectory = *self.planner.trajectory();
            self.plan_end = trajectory.end;
            if let Some(first) = self.moves.back() {
                self.planner.begin_blend(first, &trajectory);
            }
            // Room was checked when the planner took the request.
            let _ = self.moves.push_back(trajectory);
        });
        Some((sequence, planned))
    }

    /// One step towards the overlap of the last two moves. Found too late, or with the first one ended, the arm stops between them.
    fn find_overlap(&mut self, budget: &TorqueBudget<'_>) {
        let mut last = self.moves.iter_mut().rev();
        let (Some(next), Some(first)) = (last.next(), last.next()) else {
            self.planner.cancel();
            return;
        };
        if let Some(overlap) = self.planner.overlap(budget, first, next) {
            let waits = last.next().is_some();
            if waits || self.now < first.duration() - overlap {
                first.overlap = overlap;
            }
        }
    }

    /// What to follow next, in place of what was followed last. Without a move the arm stays there.
    pub fn advance(
        &mut self,
        budget: &TorqueBudget<'_>,
        stride: &Stride,
        setpoint: &mut Setpoint,
    ) -> Progress {
        let Stride {
            steps,
            period,
            lead,
            stopping,
        } = *stride;
        let here = setpoint.reference.q;
        let Some(mut trajectory) = self.moves.front() else {
            *setpoint = Setpoint::rest(here);
            return Progress::Arrived;
        };
        for _ in 0..steps {
            self.clock.advance(period);
        }
        let mut t = self.clock.time(period);
        let mut duration = trajectory.duration();
        let mut stops = stopping;
        while t >= duration && self.moves.len() > 1 && (trajectory.overlap > 0.0 || !stops) {
            // The next move begins where and when this one ends, within the sample. What the last sample looked ahead to was the end.
            let begun = trajectory.next_begins();
            t -= begun;
            self.completed = trajectory.sequence;
            if trajectory.overlap > 0.0 {
                // Or it is under way, and its clock runs.
                self.clock.go_over(begun, period);
                self.clock.set_pace(self.pace());
            } else {
                self.clock = Clock::begun(self.pace(), t / period);
                stops = true;
            }
            self.moves.pop_front();
            let Some(next) = self.moves.front() else {
                *setpoint = Setpoint::rest(here);
                return Progress::Arrived;
            };
            trajectory = next;
            duration = next.duration();
        }
        self.followed_curve = matches!(trajectory.path, Path::Tool { .. });
        let (sequence, ended) = (trajectory.sequence, t >= duration);
        self.now = t;
        let ahead = self.clock.lead(lead);
        let mut followed = trajectory.follow(budget.arm, t, ahead, setpoint);
        let since = t - trajectory.next_begins();
        self.followed_two = trajectory.overlap > 0.0 && since + ahead > 0.0;
        if self.followed_two
            && let Some(next) = self.moves.get(1)
        {
            followed =
                followed.and_then(|()| trajectory.add(next, budget.arm, since, ahead, setpoint));
        }
        if followed.is_err() {
            // A verified path stays in reach; should arithmetic disagree, the arm holds.
            *setpoint = Setpoint::rest(here);
        }
        if stopping {
            self.clock.set_pace(0.0);
        }
        if !self.clock.is_even() {
            self.ramp(budget, stride, setpoint);
        }
        if stopping && (ended || self.clock.is_stopped()) {
            *setpoint = Setpoint::rest(setpoint.reference.q);
            return Progress::Arrived;
        }
        if !self.clock.is_full() {
            let Reference { q, qd, qdd } = setpoint.reference;
            let Rates { qd, qdd } = self.clock.apply(&Rates { qd, qdd }, 0.0);
            setpoint.reference = Reference { q, qd, qdd };
            setpoint.ahead = self.clock.apply(&setpoint.ahead, lead);
        }
        if ended {
            self.completed = sequence;
            self.moves.pop_front();
            self.clock = Clock::new(self.pace());
            self.now = 0.0;
        }
        if self.moves.is_empty() {
            Progress::Arrived
        } else {
            Progress::UnderWay
        }
    }

    /// The next change of the pace.
    #[inline(never)]
    fn ramp(&mut self, budget: &TorqueBudget<'_>, stride: &Stride, setpoint: &Setpoint) {
        let soon = stride.stopping || self.found < self.asked || self.held == Some(false);
        let share = if soon { STOP_SHARE } else { RAMP_SHARE };
        let (period, stopping) = (stride.period, stride.stopping);
        self.clock.ramp(budget, setpoint, share, period, stopping);
    }
}

impl Default for MoveQueue {
    fn default() -> Self {
        Self::new()
    }
}
