//! Moves in the controller: planning, following, stopping and withdrawing them.

use protocol::messages::{Outcome, Refusal, RefusalReason};

use super::Controller;
use crate::control::states::{Event, State};
use crate::trajectory::Setpoint;
use crate::trajectory::queue::{Progress, Stride};
use crate::trajectory::torque_budget::TorqueBudget;

impl Controller {
    /// Refuses moves waiting to be planned; planned moves are dropped once the arm is at rest.
    pub(super) fn withdraw(&mut self) {
        while let Some(sequence) = self.queue.withdraw() {
            self.reply(
                sequence,
                Outcome::Refused(Refusal::because(RefusalReason::Stopped)),
            );
        }
    }

    /// Continues planning: one step per millisecond of the sampling period, at least one. Kept out of the path from
    /// measurement to command, which it would delay. Returns whether there was anything to plan.
    pub fn plan(&mut self) -> bool {
        // Where a stop will end is not known before; and a sample that changes the pace, or follows two moves, has no time to plan.
        let busy = self.state.is_stopping() || self.queue.is_ramping() || self.queue.is_blending();
        if !self.state.is_powered() || busy || !self.queue.has_to_plan() {
            return false;
        }
        let budget = TorqueBudget {
            arm: &self.arm,
            body: &self.body,
        };
        for _ in 0..self.planning_steps {
            match self.queue.plan(&budget) {
                None => {}
                Some((sequence, answer)) => {
                    let outcome = answer.map_or_else(Outcome::Refused, |()| Outcome::Accepted);
                    self.reply(sequence, outcome);
                    break;
                }
            }
        }
        true
    }

    /// What to follow at this sample.
    pub(super) fn advance(&mut self, steps: u32, lead: f32) {
        self.loosen(steps);
        if self.state == State::Enabled {
            if !self.queue.is_ready() {
                self.setpoint = Setpoint::rest(self.setpoint.reference.q);
                return;
            }
            self.event(Event::Start);
            self.saturated = 0;
        }
        let stopping = self.state.is_stopping();
        let budget = TorqueBudget {
            arm: &self.arm,
            body: &self.body,
        };
        let stride = Stride {
            steps,
            period: self.period,
            lead,
            stopping,
        };
        match self.queue.advance(&budget, &stride, &mut self.setpoint) {
            Progress::UnderWay => {}
            Progress::Arrived if stopping => {
                self.queue.clear(&self.setpoint.reference.q);
                self.event(Event::AtRest);
            }
            Progress::Arrived => {
                self.event(Event::Arrived);
            }
        }
    }
}
