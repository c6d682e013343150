//! The beginning of a run, before anything breaks: the same in every case of a situation, so that one leads up to many.

use std::cell::RefCell;
use std::rc::Rc;

use protocol::schema::Content;
use protocol::time::{Instant, Period};

use super::judge::Judge;
use super::trial::judged;
use super::verdict::Verdict;
use crate::controller::InProcess;
use crate::drives::Drives;
use crate::faults::{Disguise, Fault, FrameFault, What};
use crate::observer::Observer;
use crate::operator::Operator;
use crate::rig::Rig;
use crate::run::{Crew, Failure};
use crate::scenario::Scenario;
use crate::setup::RunConfig;

/// The beginning of a run, as far as it has gone on without a fault.
pub struct Prelude {
    scenario: Scenario,
    rig: Rig<'static>,
    crew: Crew<Shared<Drives>, Shared<Operator>, Shared<InProcess>>,
    judge: Judge,
}

/// What a prelude and its rig both hold.
type Shared<P> = Rc<RefCell<P>>;

fn shared<P>(peer: P) -> Shared<P> {
    Rc::new(RefCell::new(peer))
}

impl Prelude {
    /// The run of this case without its faults, at the origin of time.
    ///
    /// # Errors
    /// See [`Failure`].
    pub fn new(config: &RunConfig) -> Result<Self, Failure> {
        let config = RunConfig {
            scenario: sound(&config.scenario),
            ..config.clone()
        };
        let setup = config.rig()?;
        let crew = Crew {
            drives: shared(Drives::new(&setup.actual, setup.period)),
            operator: shared(Operator::new(&config.asked())),
            controller: shared(InProcess::new(setup.controller())),
        };
        Ok(Self {
            rig: crew.clone().board(Rig::new(&setup), &config.scenario),
            judge: Judge::new(&config),
            scenario: config.scenario,
            crew,
        })
    }

    /// Whether a case of the same robot can begin with it: the scenario is the same but for the faults, and it has not come so far that
    /// one of these would have changed anything.
    pub fn leads_to(&self, case: &Scenario) -> bool {
        let has_room = self.rig.now() == Instant::ORIGIN || self.until(1) <= onset(case);
        has_room && self.scenario == sound(case)
    }

    /// Time in so many samples. A frame suffers what begins while it is on its way, which takes less than one.
    fn until(&self, samples: u32) -> Instant {
        self.rig.now() + Period::of_rate(self.scenario.rate_hz).duration() * samples
    }

    /// Like [`Prelude::judge_watched`], with nobody who watches: compiled here, where code is optimised, and not by its user.
    ///
    /// # Errors
    /// See [`Failure`].
    pub fn judge(&mut self, case: &RunConfig) -> Result<Verdict, Failure> {
        self.judge_watched(case, &mut ())
    }

    /// Goes on up to the first fault of a case that it leads to, or to the end of the scenario, and judges the case from there. The
    /// same comes of it as of a run of its own, whose end is all that `observer` sees.
    ///
    /// # Errors
    /// See [`Failure`].
    pub fn judge_watched<O: Observer>(
        &mut self,
        case: &RunConfig,
        observer: &mut O,
    ) -> Result<Verdict, Failure> {
        case.rig()?;
        let scenario = &case.scenario;
        while self.rig.outcome().is_none() && self.until(2) <= onset(scenario) {
            // Neither peers in this process nor a judge fail.
            if self.rig.step(&mut (), &mut self.judge).is_err() {
                break;
            }
        }
        let crew = Crew {
            drives: self.crew.drives.borrow().clone(),
            operator: self.crew.operator.borrow().clone(),
            controller: self.crew.controller.borrow().clone(),
        };
        let mut rig = crew.board(self.rig.fork(), scenario);
        let mut judge = self.judge.clone();
        judge.expect(&scenario.faults);
        Ok(judged(&mut rig, judge, observer)?.0)
    }
}

/// The scenario without its faults.
fn sound(scenario: &Scenario) -> Scenario {
    Scenario {
        faults: Vec::new(),
        seed: 0,
        ..scenario.clone()
    }
}

/// Up to when a run of this scenario is one without its faults; the end of time if it has none.
pub fn onset(scenario: &Scenario) -> Instant {
    let period = Period::of_rate(scenario.rate_hz);
    let begins = |fault: &Fault| {
        let (from, _) = fault.window.fixed(period)?;
        let (message, heard) = match fault.what {
            What::Foreign(message, Disguise::Perfect) => (message, 1),
            What::Frames(message, FrameFault::Replay(back)) => (message, back),
            _ => return Some(from),
        };
        // What is sent again has been heard before: of these messages there is one a sample.
        let is_steady = matches!(message.content, Content::Feedback | Content::Command);
        let before = Instant::ORIGIN + period.duration() * heard as u32;
        is_steady.then(|| Instant::ORIGIN + from.since(before))
    };
    let begins = scenario
        .faults
        .iter()
        .map(|it| begins(it).unwrap_or_default());
    begins.min().unwrap_or(Instant::MAX)
}
