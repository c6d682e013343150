//! Requests on their way to becoming motion: waiting, being planned, planned, under way.

use heapless::Deque;
use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::clock::Clock;
use super::planner::Planner;
use super::request::Request;
use super::torque_budget::TorqueBudget;
use super::{Reference, Trajectory};
use crate::mechanics::arm::ArmModel;

/// Requests that may wait, and planned moves that may wait.
pub const CAPACITY: usize = 4;

/// What [`MoveQueue::advance`] came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// There is more to come.
    UnderWay,
    /// At rest: the last move has ended, or the stop.
    Arrived,
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
    /// Nothing asked for.
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

    /// Moves that have not ended, in whatever stage.
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

    /// Whether a planned move is there to begin or go on.
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

    /// Takes back one request that has not been answered, and returns its number; `None` when
    /// there is none left.
    pub fn withdraw(&mut self) -> Option<u8> {
        self.planner
            .cancel()
            .or_else(|| self.requests.pop_front().map(|request| request.sequence))
    }

    /// Forgets all planned moves; the next one starts at `q`.
    pub fn clear(&mut self, q: &Vector4<f32>) {
        self.moves.clear();
        self.clock = Clock::default();
        self.plan_end = *q;
    }

    /// Whether there is a move to plan, and room for it.
    pub fn has_to_plan(&self) -> bool {
        self.is_planning() || !(self.requests.is_empty() || self.moves.is_full())
    }

    /// One step of planning. Returns the number of a request and its answer, when it has one.
    pub fn plan(&mut self, budget: &TorqueBudget<'_>) -> Option<(u8, Result<(), Refusal>)> {
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
        Some((
            sequence,
            planned.map(|()| {
                let trajectory = self.planner.trajectory();
                self.plan_end = trajectory.end;
                // There was room when the planner took the request.
                let _ = self.moves.push_back(*trajectory);
            }),
        ))
    }

    /// The reference `steps` samples of `period` seconds on; while `stopping`, braking on the
    /// path. Without a move the arm stays at `here`.
    pub fn advance(
        &mut self,
        arm: &ArmModel,
        steps: u32,
        period: f32,
        stopping: bool,
        here: &Vector4<f32>,
    ) -> (Reference, Progress) {
        let Some(trajectory) = self.moves.front() else {
            return (Reference::rest(*here), Progress::Arrived);
        };
        for _ in 0..steps {
            self.clock.advance(period);
        }
        let t = self.clock.time(period);
        let ended = t >= trajectory.duration();
        // A verified path stays in reach; should arithmetic disagree, the arm holds.
        let planned = trajectory
            .at(arm, t)
            .unwrap_or_else(|_| Reference::rest(*here));
        if stopping {
            self.clock
                .brake(&planned, &trajectory.braking, &arm.limits, period);
            if ended || self.clock.is_stopped() {
                return (Reference::rest(planned.q), Progress::Arrived);
            }
            return (self.clock.apply(&planned), Progress::UnderWay);
        }
        if ended {
            self.completed = trajectory.sequence;
            self.moves.pop_front();
            self.clock = Clock::default();
        }
        let progress = if self.moves.is_empty() {
            Progress::Arrived
        } else {
            Progress::UnderWay
        };
        (planned, progress)
    }
}

impl Default for MoveQueue {
    fn default() -> Self {
        Self::new()
    }
}
