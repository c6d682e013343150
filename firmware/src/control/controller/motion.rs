//! Where the moves are: planned on, followed, stopped, taken back.

use nalgebra::Vector4;
use protocol::messages::{Cause, Mode, Outcome, Refusal, RefusalReason};

use super::{Controller, Shutdown};
use crate::control::mode::Event;
use crate::trajectory::Reference;
use crate::trajectory::capacity::Capacity;
use crate::trajectory::queue::Progress;

impl Controller {
    pub(super) fn is_stopping(&self) -> bool {
        self.mode == Mode::QuickStop || self.shutdown == Shutdown::Stopping
    }

    /// Refuses what waits to be planned; planned moves go when the arm has come to rest.
    pub(super) fn withdraw(&mut self) {
        while let Some(sequence) = self.queue.withdraw() {
            self.reply(
                sequence,
                Outcome::Refused(Refusal::because(RefusalReason::Stopped)),
            );
        }
    }

    /// Plans on, for the time until the next sample: a step for every millisecond of the sampling
    /// period, at least one. Off the way from measurement to command, which it would only make
    /// late. Returns whether there was anything to plan.
    pub fn plan(&mut self) -> bool {
        if !self.is_holding() || !self.queue.has_to_plan() {
            return false;
        }
        let capacity = Capacity {
            arm: &self.config.arm,
            body: &self.body,
        };
        for _ in 0..self.planning_steps {
            match self.queue.plan(&capacity) {
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

    /// The reference at this sample.
    pub(super) fn advance(&mut self, steps: u32) -> Reference {
        if self.mode == Mode::Enabled {
            if !self.queue.is_ready() {
                return Reference::rest(self.reference.q);
            }
            self.event(Event::Start, Cause::None);
        }
        let stopping = self.is_stopping();
        let (reference, progress) = self.queue.advance(
            &self.config.arm,
            steps,
            self.config.period,
            stopping,
            &self.reference.q,
        );
        match progress {
            Progress::UnderWay => {}
            Progress::Arrived if stopping => self.come_to_rest(&reference.q),
            Progress::Arrived => self.event(Event::Arrived, Cause::None),
        }
        reference
    }

    pub(super) fn come_to_rest(&mut self, q: &Vector4<f32>) {
        self.queue.clear(q);
        if self.mode == Mode::QuickStop {
            self.event(Event::AtRest, Cause::None);
        } else {
            self.shutdown = Shutdown::Closing(self.brake_samples());
        }
    }
}
