//! The observer who judges a run with faults.

use std::collections::BTreeSet;
use std::io;

use protocol::frame::CanFrame;
use protocol::messages::{Cause, Command, ControlWord, Emergency, Message, Mode, Node};
use protocol::time::{Duration, Instant, Period};
use protocol::{codec, table};

use super::bounds::{Bounds, STANDING};
use super::course::{Course, Known};
use super::due::Stage;
use super::newest::Newest;
use super::reports::{Reports, is_at_rest, is_faulty};
use super::request::Request;
use super::spells::Spells;
use super::verdict::{Requirement, Verdict, round};
use crate::faults::Fault;
use crate::model::Payload;
use crate::observer::{Observer, PlantState, Truth};
use crate::scenario::Ending;
use crate::setup::RunConfig;
use crate::world::CellEvent;

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
    /// Samples in a row with an axis beyond each kind of limit.
    beyond: [u32; 4],
    last: Option<PlantState>,
    course: Course,
    /// The arm when the run had ended.
    rest: Option<PlantState>,
    /// How the scenario is to end.
    ends: Ending,
    mode: Mode,
    survived: bool,
    /// Which faults had acted by then.
    acted: Vec<bool>,
    /// Since when it has been what it is.
    stage: Stage,
    /// When the arm last got its torque, and when it last had some.
    powered: Option<[Instant; 2]>,
    /// The newest sample that it can have answered when it reported a fault; up to then, the newest of all.
    reported_at: Option<u32>,
    /// Whether the controller has switched it off for a fault.
    let_go: bool,
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
            bounds: Bounds::new(&config.actual, period.duration().seconds())
                .in_manual_operation(!scenario.operation.is_automatic()),
            payload: None,
            missed: BTreeSet::new(),
            newest: Newest::new(period),
            faults: Spells::new(&[], period),
            request: Request::default(),
            reports: Reports::default(),
            cut: None,
            beyond: [0; 4],
            last: None,
            course: Course::default(),
            rest: None,
            ends: scenario.ends,
            mode: Mode::Boot,
            survived: false,
            acted: Vec::new(),
            stage: Stage::Off,
            powered: None,
            reported_at: None,
            let_go: false,
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
            .is_some_and(|last| last.t - self.course.moving > time.seconds())
    }

    /// The scenario has ended, completed or not, and the arm has come to rest; which faults have acted by now. What follows is to be still.
    pub fn ended(&mut self, completed: bool, acted: Vec<bool>) {
        self.acted = acted;
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
        if self.reports.latched().is_some() && !is_faulty(self.mode) && !self.has_forgotten() {
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
        // One that has forgotten it obeys, and does not break a promise by that.
        self.request.enable().filter(|_| !self.has_forgotten())
    }

    /// Whether the controller has been without power since it told a fault: what it has latched is in its memory alone.
    fn has_forgotten(&self) -> bool {
        let now = self.last.map_or(Instant::ORIGIN, |last| at(last.t));
        self.reports
            .latched()
            .is_some_and(|told| self.faults.forget(told, now))
    }

    /// The verdict.
    pub fn finish(mut self) -> Verdict {
        let onset = self.faults.onset().seconds();
        let (told, has_begun) = (self.reports.told(), self.faults.onset() < Instant::MAX);
        let since = |time: f64| has_begun.then(|| round((time - onset) * 1e3));
        self.judge_fall();
        let is_latched = self.reports.latched().is_some();
        let is_well = self.survived || self.ended_switching_off;
        let is_untold = self.first().is_none();
        let was_off = self.reports.is_at_rest() || (is_untold && !self.is_powered());
        // One that has not had torque since then has waited for its operator: what it was to tell is judged by its time.
        let is_off = |[_, last]: [Instant; 2]| last < self.faults.onset();
        let waits = is_untold && is_at_rest(self.mode) && self.powered.is_none_or(is_off);
        let end = self.last.map_or(0.0, |last| last.t);
        let powered = self.powered.map(|[since, _]| since);
        self.missed.extend(self.faults.judge_told(
            told,
            [was_off, is_well || waits],
            powered,
            at(end),
        ));
        let may_be_on = self.faults.keep_torque_on(self.cut.is_some());
        if is_latched && !may_be_on && self.newest.enables_torque(end) {
            self.miss(Requirement::Standstill);
        }
        let stopped = self.course.is_stopped();
        let at = self.first().filter(|at| *at >= onset);
        let never_began = self.faults.begin_after(self.rest);
        Verdict {
            survived: self.survived,
            never_began,
            never_acted: !never_began && has_begun && !self.acted.contains(&true),
            unseen: self.faults.unseen(told, self.first(), &self.acted),
            detected: match told {
                Some(cause) => Some(cause.name().into()),
                None => self.cut.map(|_| "drives".into()),
            },
            detection_ms: at.and_then(since),
            standstill_ms: stopped
                .then_some(self.course.moving.max(onset))
                .and_then(since),
            distance_mm: stopped.then(|| round(self.course.distance * 1e3)),
            energy_j: has_begun.then(|| round(self.course.energy)),
            drop_mm: stopped.then(|| round(self.course.lift.drop() * 1e3)),
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
        if !self.newest.take(time, command) {
            return;
        }
        // Where the drives do not count, the age of a command tells nothing, and its sample does.
        let is_old = |newest: u32| newest.wrapping_sub(command.sample) < u32::MAX / 2;
        let is_uncounted_one = self.faults.lose_count() && self.reported_at.is_some_and(is_old);
        let is_sent_before = |reported: Instant| {
            is_uncounted_one
                || time.since(reported) <= self.period.duration() + self.faults.lateness()
        };
        if self.reports.latched().is_none_or(is_sent_before) {
            return;
        }
        let enables = control.contains(ControlWord::TORQUE_ENABLE);
        let releases = control.contains(ControlWord::BRAKE_RELEASE);
        if enables && releases && !control.contains(ControlWord::QUICK_STOP) {
            self.miss(Requirement::Reaction);
        }
        // A fault that has switched torque off keeps it off.
        if enables && self.let_go && !self.has_forgotten() {
            self.miss(Requirement::Latch);
        }
        self.let_go |= !enables;
    }

    /// Follows what the arm is doing.
    fn live(&mut self, now: Instant, is_powered: bool, is_driven: bool) {
        self.stage = self.stage.after(now, self.mode, [is_powered, is_driven]);
        if let Stage::Powered(since) = self.stage {
            self.powered = Some([since, now]);
        }
        self.faults.meet(self.stage);
    }

    fn judge_fall(&mut self) {
        let is_latched = self.reports.latched().is_some() && !self.reports.is_at_rest();
        // An arm that went on moved as it was meant to, and one without torque has only its brake.
        let went_on = self.missed.contains(&Requirement::Latch);
        if !is_latched && (went_on || self.cut.is_none()) {
            return;
        }
        // One without power stops nothing.
        let controlled =
            self.cut.is_none() && !self.has_forgotten() && self.reports.ask_for_control();
        if self
            .course
            .lift
            .is_too_low(&self.bounds, controlled, &self.faults)
        {
            self.miss(Requirement::Drop);
        }
    }
}

impl Observer for Judge {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        // Most frames, and the longest, are feedback, which is looked at for the brake only, and for what tells the time of a command where its
        // number does not.
        let is_counted = self.newest.counts || self.reports.latched().is_some();
        if table::FEEDBACK.identifies(frame) && self.newest.releases_brake() && is_counted {
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
            Message::State(state) if state.cause != Cause::None && self.faults.pile_up() => {
                self.reports.repeat(time, state.cause);
            }
            Message::Heartbeat(node, _) => self.faults.hear(node),
            Message::Feedback(feedback) => {
                if self.reports.latched().is_none() {
                    self.reported_at = Some(feedback.sample);
                }
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
        let reading = self.faults.reading();
        let is_powered = self.is_powered();
        if is_powered && plant.tau == [0.0; 4] && self.last.is_some_and(|last| last.tau != [0.0; 4])
        {
            self.cut.get_or_insert((plant.t, self.mode));
        }
        if is_powered
            && self.first().is_none()
            && truth.mind.knows_where()
            // What the controller has not heard of it cannot report.
            && truth.is_answered()
            && self.bounds.is_long_beyond(&mut self.beyond, truth, reading)
        {
            self.miss(Requirement::Reported);
        }
        let now = at(plant.t);
        self.live(now, is_powered, plant.tau != [0.0; 4]);
        if self.first().is_none()
            && self.rest.is_none()
            && self.faults.due().is_some_and(|due| now >= due)
        {
            self.miss(Requirement::Detected);
        }
        self.course
            .lift
            .catch(plant, now >= self.faults.caught_from());
        // What has caught the tool may pull an arm without torque, and so does the weight of a lift that nothing holds.
        let is_pulled = plant.tau == [0.0; 4]
            && (self.faults.catch_the_tool() || self.faults.let_the_lift_fall());
        if !is_pulled && self.bounds.is_tool_too_fast(&plant.q, &plant.qd, reading) {
            self.miss(Requirement::Slow);
        }
        if now >= self.faults.onset() && self.rest.is_none() {
            let known = Known {
                is_detected: self.first().is_some(),
                is_latched: self.reports.latched().is_some(),
            };
            let samples = (self.last.as_ref(), plant);
            let held_to = (&self.bounds, &self.faults);
            self.course.measure(
                samples,
                truth.mind.q[2],
                self.period,
                known,
                held_to,
                &mut self.missed,
            );
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

/// A time in s.
fn at(seconds: f64) -> Instant {
    Instant::ORIGIN + Duration::from_seconds(seconds)
}
