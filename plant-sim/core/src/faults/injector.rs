//! Faults of the robot itself.

use protocol::frame::CanFrame;
use protocol::time::Instant;

use super::{Fault, What};
use crate::peer::{Outbox, Peer, PeerError};
use crate::plant::Plant;
use crate::world::World;

/// Breaks parts of the robot when their time comes, and repairs them. It is a peer only to be called at the right times:
/// it neither receives nor sends frames.
#[derive(Debug)]
pub struct Injector {
    /// Pending changes, the latest first.
    todo: Vec<(Instant, What, Deed)>,
    seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Deed {
    Break,
    Repair,
}

impl Injector {
    /// An injector of those faults that concern the robot; `seed` seeds the noise of encoders.
    pub fn new(faults: &[Fault], seed: u64) -> Self {
        let mut injector = Self {
            todo: Vec::new(),
            seed,
        };
        for fault in faults {
            injector.inject_also(fault);
        }
        injector
    }

    /// Adds a fault, if it concerns the robot.
    pub(crate) fn inject_also(&mut self, fault: &Fault) {
        let Fault {
            what, from, until, ..
        } = *fault;
        let of_robot = !matches!(
            what,
            What::Frames(..)
                | What::Silent(_)
                | What::Attempts(..)
                | What::Misreads(..)
                | What::NoRecovery(_)
        );
        if !of_robot {
            return;
        }
        let deeds = [(from, what, Deed::Break), (until, what, Deed::Repair)];
        self.todo
            .extend(deeds.into_iter().filter(|(time, ..)| *time < Instant::MAX));
        self.todo.sort_by_key(|(time, ..)| std::cmp::Reverse(*time));
    }

    fn act(&self, plant: &mut Plant, what: What, deed: Deed) {
        let is_broken = deed == Deed::Break;
        match what {
            What::Encoder(axis, defect) => {
                plant.break_encoder(axis, is_broken.then_some(defect), self.seed);
            }
            What::Motor(axis, defect) => plant.break_motor(axis, is_broken.then_some(defect)),
            What::BrakeStuck => plant.break_brake(is_broken),
            // A payload that has fallen out does not come back.
            What::PayloadDropped if is_broken => plant.release(),
            What::PayloadDropped
            | What::Frames(..)
            | What::Silent(_)
            | What::Attempts(..)
            | What::Misreads(..)
            | What::NoRecovery(_) => {}
        }
    }
}

impl Peer for Injector {
    fn wake(&self) -> Option<Instant> {
        self.todo.last().map(|(time, ..)| *time)
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        _: &mut Outbox,
    ) -> Result<(), PeerError> {
        if received.is_some() {
            return Ok(());
        }
        world.plant.advance_to(now.nanos());
        while let Some((_, what, deed)) = self.todo.pop_if(|(time, ..)| *time <= now) {
            self.act(&mut world.plant, what, deed);
        }
        Ok(())
    }
}
