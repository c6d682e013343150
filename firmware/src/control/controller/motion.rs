//! Moves in the controller: planning, following, stopping and withdrawing them.

use protocol::messages::{Law, Operation, Outcome, Refusal, RefusalReason};

use super::Controller;
use crate::control::states::{Event, State};
use crate::trajectory::Setpoint;
use crate::trajectory::queue::{Progress, Stride};
use crate::trajectory::torque_budget::TorqueBudget;

/// Room for planning in a sample, of the 4,000 instructions of a Cortex-M4F that it may take: with the arm at rest, and along a straight
/// path in joint space. Along a curve of the tool, or with a look at the speed of the tool, there is none for more than one step.
const STANDING: u16 = 1_860;
const MOVING: u16 = 1_360;
/// What a law takes less that needs no kinematics of the tool.
const JOINT_LAW: u16 = 280;

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

    /// Continues planning: for each millisecond of the sampling period a step, and what else there is room for, in a sample that has `spent` so many
    /// instructions of it on something else. Kept out of the path from
    /// measurement to command, which it would delay. Returns whether there was anything to plan.
    pub fn plan(&mut self, spent: u16) -> bool {
        // Where a stop will end is not known before; and a sample that changes the pace, or follows two moves, has no time to plan.
        let busy = self.state.is_stopping() || self.queue.is_ramping() || self.queue.is_blending();
        if !self.state.is_powered() || busy || !self.queue.has_to_plan() {
            return false;
        }
        let budget = TorqueBudget {
            arm: &self.arm,
            body: &self.body,
        };
        let room = self.planning_room().saturating_sub(spent);
        if spent > 0 && self.queue.planning_cost() > room {
            return true;
        }
        for _ in 0..self.planning_turns {
            match self.queue.plan(&budget, room) {
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

    /// Instructions that this sample has left for planning.
    fn planning_room(&self) -> u16 {
        let room = if self.operation == Operation::Manual {
            return 0;
        } else if self.stands {
            STANDING
        } else if self.queue.followed_curve {
            return 0;
        } else {
            MOVING
        };
        match self.setup.selection.law {
            Law::ComputedTorqueTask => room,
            Law::ComputedTorqueJoint => room + JOINT_LAW,
            // Without a model of the arm a torque is cut in many a sample, which takes its time.
            _ => 0,
        }
    }

    /// What to follow at this sample.
    pub(super) fn advance(&mut self, steps: u32, lead: f32) {
        self.loosen(steps);
        if self.state == State::Enabled {
            if !self.queue.is_ready() {
                self.stands = true;
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
        self.stands = false;
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
