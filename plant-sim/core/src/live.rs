//! A run that goes on after its scenario: a person asks for moves and plants faults while it runs.
//!
//! Until somebody does, it is the run of the scenario, frame by frame, without the operator's last request to disable.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::control::controller::Config;
use protocol::messages::Node;
use protocol::time::Instant;

use crate::drives::Drives;
use crate::faults::{Fault, Faulty, Injector, Planned};
use crate::observer::{Observer, Pace};
use crate::operator::{Answer, Desk, Order};
use crate::peer::{Peer, PeerError};
use crate::rig::{Rig, RunError};
use crate::run::Failure;
use crate::setup::RunConfig;

/// Something that can be broken during a run.
trait Breakable {
    fn plant(&mut self, fault: &Planned);
}

impl<P: Peer> Breakable for Faulty<P> {
    fn plant(&mut self, fault: &Planned) {
        self.suffer_also(fault);
    }
}

impl Breakable for Injector {
    fn plant(&mut self, fault: &Planned) {
        self.inject_also(fault);
    }
}

/// A run in progress.
pub struct Live<'p> {
    rig: Rig<'p>,
    seed: u64,
    desk: Rc<RefCell<Faulty<Desk>>>,
    breakable: Vec<Rc<RefCell<dyn Breakable + 'p>>>,
}

impl<'p> Live<'p> {
    /// The run of a scenario with the controller that `connect` starts, at the origin of time.
    ///
    /// # Errors
    /// See [`Failure`].
    pub fn new<C: Peer + 'p>(
        config: &RunConfig,
        connect: impl FnOnce(Config) -> Result<C, PeerError>,
    ) -> Result<Self, Failure> {
        let setup = config.rig()?;
        let mut rig = Rig::new(&setup);
        let (faults, seed) = (&config.scenario.faults, config.scenario.seed);
        let faults: Vec<Planned> = faults.iter().map(|fault| rig.plan(fault)).collect();
        let faults = faults.as_slice();
        let controller = Faulty::new(connect(setup.controller())?, Node::Controller, faults, seed);
        let controller = Rc::new(RefCell::new(controller));
        let drives = Drives::new(&setup.actual, setup.period);
        let drives = Rc::new(RefCell::new(Faulty::new(
            drives,
            Node::Drives,
            faults,
            seed,
        )));
        let desk = Desk::new(&config.asked());
        let desk = Rc::new(RefCell::new(Faulty::new(
            desk,
            Node::Operator,
            faults,
            seed,
        )));
        let injector = Rc::new(RefCell::new(Injector::new(faults, seed)));

        // In the order of other runs.
        rig.attach_aside(Rc::clone(&injector));
        rig.attach_as(Node::Drives, Rc::clone(&drives));
        rig.attach_as(Node::Operator, Rc::clone(&desk));
        rig.attach_as(Node::Controller, Rc::clone(&controller));
        for fault in faults {
            rig.spoil(fault, seed);
        }
        Ok(Self {
            rig,
            seed,
            breakable: vec![injector, drives, Rc::clone(&desk) as _, controller],
            desk,
        })
    }

    /// Time of the next sample.
    pub fn now(&self) -> Instant {
        self.rig.now()
    }

    /// Asks the operator for something, which it does in the next sample.
    pub fn order(&mut self, order: Order) {
        self.desk.borrow_mut().peer_mut().order(order);
    }

    /// What has become of orders and of the scenario since the last call.
    pub fn answers(&mut self) -> Vec<Answer> {
        self.desk.borrow_mut().peer_mut().answers()
    }

    /// Whether the scenario goes on.
    pub fn is_scripted(&self) -> bool {
        self.desk.borrow().peer().is_scripted()
    }

    /// Breaks something when the fault says, as if the scenario had it. What it waits for has to begin from now on, or goes on.
    pub fn plant(&mut self, fault: &Fault) {
        let fault = self.rig.plan(fault);
        for part in &self.breakable {
            part.borrow_mut().plant(&fault);
        }
        self.rig.spoil(&fault, self.seed);
    }

    /// One sample.
    ///
    /// # Errors
    /// See [`Rig::step`].
    pub fn step<P: Pace, O: Observer>(
        &mut self,
        pace: &mut P,
        observer: &mut O,
    ) -> Result<(), RunError> {
        self.rig.step(pace, observer)
    }
}
