//! Faults of the robot itself.

use protocol::frame::CanFrame;
use protocol::time::Instant;

use super::What;
use super::watch::Planned;
use crate::peer::{Outbox, Peer, PeerError};
use crate::plant::defect::LoadDefect;
use crate::world::World;

/// Breaks parts of the robot when their time comes, and repairs them. It is a peer only to be called at the right times:
/// it neither receives nor sends frames.
#[derive(Debug)]
pub struct Injector {
    parts: Vec<Part>,
    seed: u64,
}

/// A part of the robot with its fault.
#[derive(Debug)]
struct Part {
    fault: Planned,
    is_broken: bool,
    /// Beginning of the last window in which it was broken.
    since: Option<Instant>,
}

impl Part {
    /// When it breaks or is repaired next.
    fn due(&self) -> Option<Instant> {
        let (from, until) = self.fault.window();
        let due = match self.is_broken {
            true => until,
            false if self.since == Some(from) || until <= from => Instant::MAX,
            false => from,
        };
        (due < Instant::MAX).then_some(due)
    }
}

impl Injector {
    /// An injector of those faults that concern the robot; `seed` seeds what is random in them.
    pub fn new(faults: &[Planned], seed: u64) -> Self {
        let mut injector = Self {
            parts: Vec::new(),
            seed,
        };
        for fault in faults {
            injector.inject_also(fault);
        }
        injector
    }

    /// Adds a fault, if it concerns the robot.
    pub(crate) fn inject_also(&mut self, fault: &Planned) {
        let of_robot = matches!(
            fault.what,
            What::Encoder(..) | What::Motor(..) | What::Brake(_) | What::Load(_) | What::Clock(_)
        );
        if of_robot {
            self.parts.push(Part {
                fault: fault.clone(),
                is_broken: false,
                since: None,
            });
        }
    }
}

fn act(world: &mut World, what: What, is_broken: bool, seed: u64) {
    let plant = &mut world.plant;
    match what {
        What::Encoder(axis, defect) => plant.break_encoder(axis, defect, seed, is_broken),
        What::Motor(axis, defect) => plant.break_motor(axis, defect, is_broken),
        What::Brake(defect) => plant.break_brake(defect, is_broken),
        // A payload that has fallen out does not come back.
        What::Load(LoadDefect::Dropped) if is_broken => plant.release(),
        What::Load(defect) => plant.disturb_load(defect, is_broken),
        What::Clock(defect) => world.clock.set(defect, seed, is_broken),
        _ => {}
    }
}

impl Peer for Injector {
    fn wake(&self) -> Option<Instant> {
        self.parts.iter().filter_map(Part::due).min()
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
        // What is repaired at the instant at which it breaks in another way is broken afterwards.
        for repairs in [true, false] {
            for part in &mut self.parts {
                if part.is_broken == repairs && part.due().is_some_and(|due| due <= now) {
                    part.is_broken = !repairs;
                    if part.is_broken {
                        part.since = Some(part.fault.window().0);
                    }
                    act(world, part.fault.what, part.is_broken, self.seed);
                }
            }
        }
        Ok(())
    }
}
