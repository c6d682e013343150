//! The observer who judges a run with faults.

use std::collections::BTreeSet;
use std::io;

use protocol::frame::CanFrame;
use protocol::messages::{Cause, Command, ControlWord, Emergency, Message, Mode, Node};
use protocol::time::{Duration, Instant, Period};
use protocol::{codec, table};

use super::bounds::{Bounds, STANDING};
use super::expect::Expected;
use super::lift::Lift;
use super::newest::Newest;
use super::reports::{Reports, is_at_rest, is_faulty};
use super::request::Request;
use super::spells::Spells;
use super::verdict::{Requirement, Verdict, round};
use crate::faults::Fault;
use crate::maths::square;
use crate::model::Payload;
use crate::observer::{Observer, PlantState, Truth};
use crate::scenario::Ending;
use crate::setup::RunConfig;
use crate::world::CellEvent;

/// J that energies may differ by: a tenth of what a hand feels.
const ENERGY_TOLERANCE: f64 = 0.1;

/// The arm at the moment of a change.
#[derive(Clone, Copy, Debug)]
struct Mark {
    time: f64,
    lift: f64,
    /// Of the motion and of the springs of the end stops, J.
    energy: f64,
}

/// The observer who judges a run with faults.
#[derive(Clone)]
pub struct Judge {
    period: Period,
    bounds: Bounds,
    faults: Spells,
    payload: Option<Payload>,
    missed: BTreeSet<Requirement>,
    newest: Newest,
    request: Request,
    reports: Reports,
    /// When the drives switched off by themselves, and in which mode of the controller.
    cut: Option<(f64, Mode)>,
    /// The arm when the fault was detected.
    detected: Option<Mark>,
    /// The arm when torque went off, since when it has stayed off.
    off: Option<Mark>,
    /// Samples in a row with an axis beyond each kind of limit.
    beyond: [u32; 3],
    last: Option<PlantState>,
    /// End of the last motion.
    moving: f64,
    distance: f64,
    /// Of `distance`, what was travelled under torque after the detection.
    driven: f64,
    fastest: f64,
    energy: f64,
    lift: Lift,
    /// The arm when the run had ended.
    rest: Option<PlantState>,
    /// How the scenario is to end.
    ends: Ending,
    mode: Mode,
    survived: bool,
    /// Whether it completed, and the drives let go while it was being switched off.
    ended_switching_off: bool,
}

impl Judge {
    /// A judge of this run.
    pub fn new(config: &RunConfig) -> Self {
        let scenario = &config.scenario;
        let period = Period::of_rate(scenario.rate_hz);
        let mut judge = Self {
            period,
            bounds: Bounds::new(&config.actual, period.duration().seconds()),
            payload: None,
            missed: BTreeSet::new(),
            newest: Newest::new(period),
            faults: Spells::new(&[], period),
            request: Request::default(),
            reports: Reports::default(),
            cut: None,
            detected: None,
            off: None,
            beyond: [0; 3],
            last: None,
            moving: 0.0,
            distance: 0.0,
            driven: 0.0,
            fastest: 0.0,
            energy: 0.0,
            lift: Lift::default(),
            rest: None,
            ends: scenario.ends,
            mode: Mode::Boot,
            survived: false,
            ended_switching_off: false,
        };
        judge.expect(&scenario.faults);
        judge
    }

    /// Expects these faults, of which none has begun.
    pub(super) fn expect(&mut self, faults: &[Fault]) {
        self.faults = Spells::new(faults, self.period);
        self.newest.counts = !self.faults.lose_count();
        self.weigh();
    }

    /// What is at the flange is known, or may become so.
    fn weigh(&mut self) {
        if let Some(burden) = self.faults.burden(self.payload) {
            self.bounds.carry(&burden);
        }
    }

    /// Whether the arm has not moved for as long as this.
    pub fn has_stood(&self, time: Duration) -> bool {
        self.last
            .is_some_and(|last| last.t - self.moving > time.seconds())
    }

    /// The scenario has ended, completed or not, and the arm has come to rest. What follows is to be still.
    pub fn ended(&mut self, completed: bool) {
        let told = self.reports.told();
        self.survived = match self.ends {
            Ending::Completed => completed && self.first().is_none(),
            // Without a fault only the operator's emergency stop ends it like that.
            Ending::Stopped => told == Some(Cause::EStop),
        };
        // Drives that let go in time for that need not be told.
        self.ended_switching_off = completed && matches!(self.cut, Some((_, Mode::Disabling)));
        self.rest = self.last;
        // Without feedback it may still be waiting for the brake.
        if self.reports.latched().is_some() && !is_faulty(self.mode) {
            self.miss(Requirement::Latch);
        }
        let onset = self.faults.onset().seconds();
        let is_early = self.first().is_some_and(|at| at < onset);
        if (is_early && !self.survived) || !self.faults.expected().allows(self.survived, told) {
            self.miss(Requirement::NoFalseAlarm);
        }
    }

    /// The request to switch on that a latched fault has to refuse; `None` without one.
    pub fn temptation(&self) -> Option<CanFrame> {
        self.reports.latched()?;
        self.request.enable()
    }

    /// The verdict.
    pub fn finish(mut self) -> Verdict {
        let onset = self.faults.onset().seconds();
        let (told, has_begun) = (self.reports.told(), self.faults.onset() < Instant::MAX);
        let since = |time: f64| has_begun.then(|| round((time - onset) * 1e3));
        self.judge_fall();
        let is_latched = self.reports.latched().is_some();
        let is_well = self.survived || self.ended_switching_off;
        let was_off = self.reports.is_at_rest() || (self.first().is_none() && !self.is_powered());
        self.missed
            .extend(self.faults.judge_told(told, was_off, is_well));
        let end = self.last.map_or(0.0, |last| last.t);
        let may_be_on = self.faults.keep_torque_on(self.cut.is_some());
        if is_latched && !may_be_on && self.newest.enables_torque(end) {
            self.miss(Requirement::Standstill);
        }
        let stopped = self.detected.is_some();
        let at = self.first().filter(|at| *at >= onset);
        Verdict {
            survived: self.survived,
            never_began: self.faults.begin_after(self.rest),
            detected: match told {
                Some(cause) => Some(cause.name().into()),
                None => self.cut.map(|_| "drives".into()),
            },
            detection_ms: at.and_then(since),
            standstill_ms: stopped.then_some(self.moving.max(onset)).and_then(since),
            distance_mm: stopped.then(|| round(self.distance * 1e3)),
            energy_j: has_begun.then(|| round(self.energy)),
            drop_mm: stopped.then(|| round(self.lift.drop() * 1e3)),
            missed: self.missed,
        }
    }

    fn miss(&mut self, requirement: Requirement) {
        self.missed.insert(requirement);
    }

    /// When something was detected, s.
    fn first(&self) -> Option<f64> {
        let all = [self.reports.first(), self.cut.map(|(at, _)| at)];
        all.into_iter().flatten().reduce(f64::min)
    }

    /// Whether torque is commanded, by a controller that has not switched it off since: that command may be lost.
    fn is_powered(&self) -> bool {
        let is_off = is_at_rest(self.mode) || self.mode == Mode::Fault;
        self.newest.control.contains(ControlWord::TORQUE_ENABLE) && !is_off
    }

    /// The controller has commanded the drives.
    fn commanded(&mut self, time: Instant, command: &Command) {
        let control = command.control;
        if !self.bounds.allows_torque(command) {
            self.miss(Requirement::Torque);
        }
        let Some(before) = self.newest.take(time, command) else {
            return;
        };
        let normal = control.contains(ControlWord::TORQUE_ENABLE)
            && control.contains(ControlWord::BRAKE_RELEASE)
            && !control.contains(ControlWord::QUICK_STOP);
        if let Some(reported) = self.reports.latched()
            && normal
            && time.since(reported) > self.period.duration() + self.faults.lateness()
        {
            self.miss(Requirement::Reaction);
        }
        // A fault that has switched torque off keeps it off.
        if self.reports.latched().is_some()
            && control.contains(ControlWord::TORQUE_ENABLE)
            && !before.contains(ControlWord::TORQUE_ENABLE)
        {
            self.miss(Requirement::Latch);
        }
    }

    /// Everything that counts from the beginning of the fault on.
    fn measure(&mut self, plant: &PlantState, reference: f64) {
        let energy = self.bounds.energy(&plant.q, &plant.qd);
        let is_driven = plant.tau != [0.0; 4];
        if let Some(last) = &self.last {
            let way = (0..3).map(|i| square(plant.tool[i] - last.tool[i]));
            let way = way.sum::<f64>().sqrt();
            self.distance += way;
            if self.detected.is_some() && is_driven {
                self.driven += way;
            }
            self.fastest = self.fastest.max(way / self.period.duration().seconds());
        }
        self.energy = self.energy.max(energy);
        if plant.is_moving() {
            self.moving = plant.t + self.period.duration().seconds();
        }
        if self.bounds.is_too_fast(&plant.q, energy) {
            self.miss(Requirement::Energy);
        }
        let elastic = self.bounds.elastic(&plant.q);
        let mark = Mark {
            time: plant.t,
            lift: plant.q[2],
            energy: energy + elastic,
        };
        if self.first().is_some() {
            let detected = *self.detected.get_or_insert(mark);
            self.lift.follow(plant, reference, is_driven);
            self.judge_stop(detected, mark, is_driven, elastic > 0.0);
        }
    }

    /// The way of the arm to standstill, once its fault has been detected.
    fn judge_stop(&mut self, detected: Mark, now: Mark, is_driven: bool, on_stop: bool) {
        if is_driven {
            let was_off = self.off.take().is_some();
            if self.reports.latched().is_none() {
                // The drives had switched off, and nobody is told that they are on again.
                if was_off {
                    self.miss(Requirement::Latch);
                }
                return;
            }
            if now.time - detected.time > self.bounds.torque_off_s() {
                if self.faults.leave_the_brake_open() {
                    return;
                }
                self.miss(Requirement::Standstill);
            }
            if self.driven > self.fastest * self.bounds.stop_s() {
                self.miss(Requirement::Distance);
            }
            return;
        }
        // Torque has been off for a whole sample at the next one.
        let off = self.off.get_or_insert(now);
        if on_stop || self.faults.catch_the_tool() {
            // What an end stop, or what has caught the tool, gives back depends on the steps in which the plant takes the impact.
            off.energy = now.energy;
        }
        let fallen = self.bounds.weight_work(off.lift, now.lift);
        if now.energy > off.energy * 1.001 + fallen + ENERGY_TOLERANCE {
            self.miss(Requirement::Energy);
        }
    }

    fn judge_fall(&mut self) {
        let is_latched = self.reports.latched().is_some() && !self.reports.is_at_rest();
        // An arm that went on moved as it was meant to, and one without torque has only its brake.
        let went_on = self.missed.contains(&Requirement::Latch);
        if !is_latched && (went_on || self.cut.is_none()) {
            return;
        }
        let controlled = self.cut.is_none() && self.reports.ask_for_control();
        if self.lift.is_too_low(&self.bounds, controlled, &self.faults) {
            self.miss(Requirement::Drop);
        }
    }
}

impl Observer for Judge {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        // Most frames, and the longest, are feedback, which is looked at for the brake only.
        if table::FEEDBACK.identifies(frame) && self.newest.releases_brake() {
            return Ok(());
        }
        let Ok(received) = codec::decode(frame) else {
            return Ok(());
        };
        match received.message {
            Message::Command(command) => self.commanded(time, &command),
            Message::Emergency(Node::Controller, Emergency { cause, .. })
                if cause != Cause::None =>
            {
                self.reports.take(time, cause);
            }
            Message::Feedback(feedback) => {
                let open = self.newest.brake_open(time, feedback.status);
                if open > self.bounds.brake_told() && self.first().is_none() {
                    self.miss(Requirement::Detected);
                }
            }
            Message::Motion(motion) => {
                self.request = Request {
                    counter: received.counter.unwrap_or(0),
                    sequence: motion.sequence,
                };
            }
            _ => {}
        }
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let plant = &truth.plant;
        self.mode = truth.mind.mode;
        self.reports.look(self.mode);
        let is_powered = self.is_powered();
        if is_powered && plant.tau == [0.0; 4] && self.last.is_some_and(|last| last.tau != [0.0; 4])
        {
            self.cut.get_or_insert((plant.t, self.mode));
        }
        if is_powered
            && self.first().is_none()
            && truth.mind.knows_where()
            && self.bounds.is_long_beyond(&mut self.beyond, truth)
        {
            self.miss(Requirement::Reported);
        }
        let now = Instant::ORIGIN + Duration::from_seconds(plant.t);
        if let Expected::DetectedBy(due) = self.faults.expected()
            && self.rest.is_none()
            && now >= due
            && is_powered
            && self.first().is_none()
        {
            self.miss(Requirement::Detected);
        }
        self.lift.catch(plant, now >= self.faults.caught_from());
        if now >= self.faults.onset() && self.rest.is_none() {
            self.measure(plant, truth.mind.q[2]);
        }
        if let Some(rest) = &self.rest {
            let moved = (0..4).any(|i| (plant.q[i] - rest.q[i]).abs() > STANDING);
            if moved && !self.faults.move_the_arm() {
                self.missed.insert(Requirement::Still);
            }
        }
        self.last = Some(*plant);
        Ok(())
    }

    fn cell_event(&mut self, event: &CellEvent) {
        if let CellEvent::Attach(payload) = event {
            self.payload = Some(*payload);
            self.weigh();
        }
    }

    fn fault(&mut self, number: usize, from: Instant, until: Instant) {
        self.faults.retime(number, from, until);
    }
}
