//! Queue of moves: waiting, being planned, planned, under way.

use heapless::Deque;
use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::clock::Clock;
use super::planner::Planner;
use super::request::Request;
use super::torque_budget::TorqueBudget;
use super::{Rates, Reference, Setpoint, Trajectory};

/// Capacity for requests, and as many planned moves.
pub const CAPACITY: usize = 4;

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
pub struct Pace {
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
            clock: Clock::default(),
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
        self.clock = Clock::default();
        self.plan_end = *q;
    }

    /// Whether there is a move to plan and room for it.
    pub fn has_to_plan(&self) -> bool {
        self.is_planning() || !(self.requests.is_empty() || self.moves.is_full())
    }

    /// One step of planning. Returns the number of a request and its answer once there is one.
    pub fn plan(&mut self, budget: &TorqueBudget<'_>) -> Option<(u8, Result<(), Refusal>)> {
        if self.planner.is_idle() {
            if self.moves.is_full() {
                return None;
            }
            let request = self.requests.pop_front()?;
            self.planner.begin(budget.arm, &request, &self.plan_end);
            return None;
        }
        let planned = self.planner.work(budget)?;
        let sequence = self.planner.sequence();
        Some((
            sequence,
            planned.map(|()| {
                let trajectory = self.planner.trajectory();
                self.plan_end = trajectory.end;
                // Room was checked when the planner took the request.
                let _ = self.moves.push_back(*trajectory);
            }),
        ))
    }

    /// What to follow next, in place of what was followed last. Without a move the arm stays there.
    pub fn advance(
        &mut self,
        budget: &TorqueBudget<'_>,
        pace: &Pace,
        setpoint: &mut Setpoint,
    ) -> Progress {
        let Pace {
            steps,
            period,
            lead,
            stopping,
        } = *pace;
        let here = setpoint.reference.q;
        let Some(trajectory) = self.moves.front() else {
            *setpoint = Setpoint::rest(here);
            return Progress::Arrived;
        };
        for _ in 0..steps {
            self.clock.advance(period);
        }
        let t = self.clock.time(period);
        let ended = t >= trajectory.duration();
        let ahead = self.clock.lead(lead);
        if trajectory.follow(budget.arm, t, ahead, setpoint).is_err() {
            // A verified path stays in reach; should arithmetic disagree, the arm holds.
            *setpoint = Setpoint::rest(here);
        }
        if stopping {
            let Reference { q, qd, qdd } = setpoint.reference;
            // The torque is that of the instant in which the command acts.
            let then = Reference {
                q,
                qd: setpoint.ahead.qd,
                qdd: setpoint.ahead.qdd,
            };
            let braking = budget.braking(&then, self.clock.time_scale());
            self.clock.brake(braking, period);
            if ended || self.clock.is_stopped() {
                *setpoint = Setpoint::rest(q);
                return Progress::Arrived;
            }
            let Rates { qd, qdd } = self.clock.apply(&Rates { qd, qdd }, 0.0);
            setpoint.reference = Reference { q, qd, qdd };
            setpoint.ahead = self.clock.apply(&setpoint.ahead, lead);
            return Progress::UnderWay;
        }
        if ended {
            self.completed = trajectory.sequence;
            self.moves.pop_front();
            self.clock = Clock::default();
        }
        if self.moves.is_empty() {
            Progress::Arrived
        } else {
            Progress::UnderWay
        }
    }
}

impl Default for MoveQueue {
    fn default() -> Self {
        Self::new()
    }
}
