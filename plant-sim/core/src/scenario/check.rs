//! Checks of a scenario before anything runs: ranges, and that the gripper can do what it has to.

mod operation;
mod place;
mod requirements;
mod zone;

use std::f64::consts::TAU;

use firmware::control::laws::{Gains, Selection};
use protocol::messages::WristTurn;
use protocol::time::{Duration, Period};

use super::{
    Arc, GainsSpec, Joints, Jump, Line, MAX_CYCLES, Override, PayloadSpec, Release, Scenario,
    ScenarioError, Step, check_rate,
};
use crate::allowed::schema::Each;
use crate::allowed::{
    Allowed, PAYLOAD_COM, PAYLOAD_INERTIA, PAYLOAD_MASS, check_mass, check_moments,
};
use crate::model::RobotModel;
use crate::text;

pub(super) const LENGTH: Allowed = Allowed::within(-10.0, 10.0, "m");
/// Two turns either way; the range of the wrist is checked with the robot.
const YAW: Allowed = Allowed::within(-2.0 * TAU, 2.0 * TAU, "rad");
const JOINT: Allowed = Allowed::within(-20.0, 20.0, "rad");
/// Of a pose: x, y, z, yaw.
pub(super) const POSE: Each<4> = Each([LENGTH, LENGTH, LENGTH, YAW]);
/// Of a point: x, y, z.
pub(super) const POINT: Each<3> = Each([LENGTH; 3]);
/// Of joint positions: shoulder, elbow, lift, wrist.
pub(super) const POSITIONS: Each<4> = Each([JOINT, JOINT, LENGTH, JOINT]);
pub(super) const RATE: Allowed = Allowed::within(100.0, 10_000.0, "Hz");
pub(super) const CLEARANCE: Allowed = Allowed::within(0.0, 1.0, "m");
pub(super) const ZONE: Allowed = Allowed::within(0.0, 1.0, "m");
/// At a ten-thousandth a move takes hours; slower ones are meant otherwise.
const SLOWEST: f64 = 1e-4;
pub(super) const SPEED: Allowed = Allowed::within(SLOWEST, 1.0, "of full speed");
/// The slowest takes an hour for 360 mm; no tool of such a robot gets to the fastest.
pub(super) const TOOL_SPEED: Allowed = Allowed::within(1e-4, 100.0, "m/s");
const MOVING_PACE: Allowed = Allowed::within(SLOWEST, 1.0, "of the planned speed");
pub(super) const PACE: Allowed = Allowed::within(0.0, 1.0, "of the planned speed");
pub(super) const SECONDS: Allowed = Allowed::within(0.0, 3600.0, "s");
/// A limit of a requirement, in whatever unit.
pub(super) const AMOUNT: Allowed = Allowed::within(0.0, 1e9, "");
/// A moment of a run.
pub(super) const MOMENT: Allowed = Allowed::within(0.0, 1e9, "s");
pub(super) const FACTOR: Allowed = Allowed::within(0.0, 10.0, "");

/// What to say of a length that is no number of metres, but one of millimetres.
pub fn millimetres(length: f64) -> Option<String> {
    LENGTH.check(length).err()?;
    LENGTH.slip(length)
}

impl Scenario {
    /// Checks everything that does not depend on the robot.
    pub(super) fn check(&self) -> Result<(), ScenarioError> {
        let mut findings = Findings::of(self);
        if self.name.contains(char::is_control) {
            findings.wrong("name", format!("{:?}", self.name), text::IN_A_NAME);
        }
        if !(1..=MAX_CYCLES).contains(&self.cycles) {
            findings.wrong("cycles", self.cycles, format!("1 to {MAX_CYCLES}"));
        }
        if let Err(allowed) = check_rate(self.rate_hz) {
            findings.wrong("rate_hz", text::number(self.rate_hz), allowed);
        }
        findings.pose("start", &self.start);
        findings.turn("start_turn", self.start_turn);
        if let Some(payload) = &self.payload {
            findings.payload("payload", payload);
        }
        findings.number("mismatch.friction", self.mismatch.friction, FACTOR);
        findings.number("mismatch.payload", self.mismatch.payload, FACTOR);
        if self.cycle.is_empty() {
            findings.wrong("cycle", "empty", "at least one step");
        }
        let mut moves = false;
        // The step that holds the arm.
        let mut held = None;
        for (index, step) in self.cycle.iter().enumerate() {
            let key = format!("cycle[{index}]");
            findings.step(&key, step);
            findings.zone(&key, step, self.cycle.get(index + 1));
            if let (Step::Stop(after), false) = (step, moves) {
                findings.wrong(
                    &format!("{key}.stop"),
                    after,
                    "after a move, which it stops",
                );
            }
            moves |= step.is_move();
            match step {
                Step::Override(Override { to, .. }) => held = (*to == 0.0).then_some(key),
                // These wait for an arm that has to arrive.
                Step::Dwell(_) | Step::Pick(_) | Step::Place {} => {
                    findings.held(held.take());
                }
                Step::Stop(_) | Step::Estop(_) => held = None,
                Step::Release(_)
                | Step::Jump(_)
                | Step::Line(_)
                | Step::Arc(_)
                | Step::Joints(_) => {}
            }
        }
        findings.held(held);
        findings.operation();
        findings.requirements();
        findings.judge()
    }

    /// Checks what depends on the nominal robot or the rate: payloads that it may carry, gains that the rate allows, a gripper that
    /// is empty before a pick and full before a place, faults that begin before they end.
    ///
    /// # Errors
    /// See [`ScenarioError`].
    pub fn check_with(
        &self,
        robot: &RobotModel,
        own_gains: &Gains,
        command_delay: Duration,
    ) -> Result<(), ScenarioError> {
        let mut findings = Findings::of(self);
        if let Some(gains) = &self.gains {
            findings.gains(gains, own_gains, command_delay.seconds() as f32);
        }
        findings.gripper(Allowed::within(0.0, robot.payload_max, "kg"));
        findings.windows();
        findings.judge()
    }
}

/// All that is wrong with a scenario: whoever mends one value wants to know of the others.
struct Findings<'a> {
    scenario: &'a Scenario,
    wrong: Vec<ScenarioError>,
}

impl<'a> Findings<'a> {
    fn of(scenario: &'a Scenario) -> Self {
        Self {
            scenario,
            wrong: Vec::new(),
        }
    }

    fn judge(mut self) -> Result<(), ScenarioError> {
        match self.wrong.len() {
            0 => Ok(()),
            1 => Err(self.wrong.remove(0)),
            _ => Err(ScenarioError::Several(self.wrong)),
        }
    }

    /// Windows whose beginning and end are in different units, and empty at this rate.
    fn windows(&mut self) {
        let rate = self.scenario.rate_hz;
        for (index, fault) in self.scenario.faults.iter().enumerate() {
            if fault.window.is_empty(Period::of_rate(rate)) {
                let allowed =
                    format!("a window that ends after it begins; at {rate} Hz this one does not");
                self.wrong(&format!("faults[{index}]"), &fault.text, allowed);
            }
        }
    }

    /// What the gripper holds from step to step. It begins a cycle with whatever it held at the end of the previous one.
    fn gripper(&mut self, carry: Allowed) {
        let mut held = self.scenario.payload.filter(|payload| payload.mass != 0.0);
        if let Some(payload) = held {
            self.number("payload.mass", payload.mass, carry);
        }
        for cycle in 0..self.scenario.cycles.min(2) {
            let known = self.wrong.len();
            for (index, step) in self.scenario.cycle.iter().enumerate() {
                match step {
                    Step::Pick(payload) => {
                        let key = format!("cycle[{index}].pick");
                        if let Some(held) = held.replace(*payload) {
                            let found = format!("a payload of {} kg", payload.mass);
                            let allowed = format!(
                                "an empty gripper; it holds {} kg, so place that first",
                                held.mass
                            );
                            self.wrong(&key, found, allowed);
                        }
                        if cycle == 0 {
                            self.number(&format!("{key}.mass"), payload.mass, carry);
                        }
                    }
                    Step::Place {} if held.take().is_none() => self.wrong(
                        &format!("cycle[{index}].place"),
                        "nothing",
                        "a gripper that holds something: pick first",
                    ),
                    _ => {}
                }
            }
            if self.wrong.len() > known {
                // The next cycle would repeat it.
                return;
            }
        }
    }

    /// Checks each gain by itself, then all of them as the loop of the law.
    fn gains(&mut self, gains: &GainsSpec, own: &Gains, command_delay: f32) {
        let (rate, law) = (self.scenario.rate_hz, self.scenario.law);
        let period = (1.0 / rate) as f32;
        let each = gains.each(own);
        let known = self.wrong.len();
        for (key, parameter, value) in each {
            let rule = parameter.rule();
            if rule.check(value as f32, period).is_err() {
                let (lower, upper) = (rule.lower, rule.upper_at(period));
                let allowed = format!("{lower} to {upper} at {rate} Hz");
                self.wrong(key, text::number(value), allowed);
            }
        }
        let [bandwidth, damping, observer] = each.map(|(_, _, value)| value as f32);
        let selection = Selection {
            law: law.law,
            compensation: law.compensation,
            gains: Gains {
                bandwidth,
                damping,
                observer,
            },
        };
        if self.wrong.len() > known {
            return;
        }
        let Err(refusal) = selection.check(period, command_delay) else {
            return;
        };
        let limit = refusal.limit;
        if refusal.value == bandwidth {
            let allowed = format!(
                "at most {limit:.1} rad/s at {rate} Hz with damping {damping}: more leaves the loop too little margin for its delay"
            );
            self.wrong("gains.bandwidth", bandwidth, allowed);
        } else {
            let whose = (gains.observer).map_or("; it is the default: give one as well", |_| "");
            let allowed = format!(
                "at most {limit:.1} rad/s, bandwidth times damping, with a law that integrates{whose}"
            );
            self.wrong("gains.observer", observer, allowed);
        }
    }

    fn step(&mut self, key: &str, step: &Step) {
        match step {
            Step::Jump(Jump {
                to,
                elbow: _,
                turn,
                top,
                clearance,
                speed,
                zone: _,
            }) => {
                self.pose(&format!("{key}.jump.to"), to);
                self.turn(&format!("{key}.jump.turn"), *turn);
                self.number(&format!("{key}.jump.top"), *top, LENGTH);
                self.number(&format!("{key}.jump.clearance"), *clearance, CLEARANCE);
                self.number(&format!("{key}.jump.speed"), *speed, SPEED);
            }
            Step::Line(Line {
                to,
                elbow: _,
                turn,
                speed,
                tool_speed,
                zone: _,
            }) => {
                let key = format!("{key}.line");
                self.pose(&format!("{key}.to"), to);
                self.turn(&format!("{key}.turn"), *turn);
                self.number(&format!("{key}.speed"), *speed, SPEED);
                self.tool_speed(&key, *tool_speed);
            }
            Step::Arc(Arc {
                via,
                to,
                elbow: _,
                turn,
                speed,
                tool_speed,
                zone: _,
            }) => {
                let key = format!("{key}.arc");
                self.numbers(&format!("{key}.via"), via, POINT);
                self.pose(&format!("{key}.to"), to);
                self.turn(&format!("{key}.turn"), *turn);
                self.number(&format!("{key}.speed"), *speed, SPEED);
                self.tool_speed(&key, *tool_speed);
            }
            Step::Joints(Joints { to, speed, zone: _ }) => {
                self.numbers(&format!("{key}.joints.to"), to, POSITIONS);
                self.number(&format!("{key}.joints.speed"), *speed, SPEED);
            }
            Step::Dwell(seconds) => self.number(&format!("{key}.dwell"), *seconds, SECONDS),
            Step::Stop(seconds) => self.number(&format!("{key}.stop"), *seconds, SECONDS),
            Step::Override(Override { after, to }) => {
                self.number(&format!("{key}.override.after"), *after, SECONDS);
                self.number(&format!("{key}.override.to"), *to, PACE);
                if (0.0..SLOWEST).contains(to) && *to != 0.0 {
                    let allowed = format!("0, which holds the arm, or {MOVING_PACE}");
                    self.wrong(&format!("{key}.override.to"), to, allowed);
                }
            }
            Step::Release(Release { after, lasts }) => {
                self.number(&format!("{key}.release.after"), *after, SECONDS);
                self.number(&format!("{key}.release.for"), *lasts, SECONDS);
            }
            Step::Estop(seconds) => self.number(&format!("{key}.estop"), *seconds, SECONDS),
            Step::Pick(payload) => {
                let key = format!("{key}.pick");
                if payload.mass == 0.0 {
                    self.wrong(&format!("{key}.mass"), 0.0, "more than 0 kg");
                }
                self.payload(&key, payload);
            }
            Step::Place {} => {}
        }
    }

    /// An arm that is held never arrives.
    fn held(&mut self, key: Option<String>) {
        if let Some(key) = key {
            self.wrong(
                &format!("{key}.override.to"),
                0.0,
                "followed by an override above 0 before the next step that waits for the arm, or the end of the cycle",
            );
        }
    }

    fn pose(&mut self, key: &str, pose: &[f64; 4]) {
        self.numbers(key, pose, POSE);
    }

    fn tool_speed(&mut self, key: &str, speed: Option<f64>) {
        if let Some(speed) = speed {
            self.number(&format!("{key}.tool_speed"), speed, TOOL_SPEED);
        }
    }

    fn turn(&mut self, key: &str, turn: Option<i8>) {
        if let Some(turn) = turn
            && WristTurn::of_number(turn).is_none()
        {
            let most = WristTurn::MOST;
            self.wrong(key, turn, format!("-{most} to {most}"));
        }
    }

    fn payload(&mut self, key: &str, payload: &PayloadSpec) {
        self.number(&format!("{key}.mass"), payload.mass, PAYLOAD_MASS);
        let com = format!("{key}.com_flange_frame");
        self.numbers(&com, &payload.com_flange_frame, Each([PAYLOAD_COM; 3]));
        let inertia = format!("{key}.inertia_com_diag");
        let known = self.wrong.len();
        let moments = payload.inertia_com_diag;
        self.numbers(&inertia, &moments, Each([PAYLOAD_INERTIA; 3]));
        if self.wrong.len() == known
            && let Err((axis, allowed)) = check_moments(moments)
        {
            self.wrong(&format!("{inertia}[{axis}]"), moments[axis], allowed);
        } else if let Err(allowed) = check_mass(payload.mass, moments) {
            self.wrong(&inertia, format!("{moments:?}"), allowed);
        }
    }

    fn numbers<const N: usize>(&mut self, key: &str, values: &[f64; N], allowed: Each<N>) {
        for (index, (value, allowed)) in values.iter().zip(allowed.0).enumerate() {
            self.number(&format!("{key}[{index}]"), *value, allowed);
        }
    }

    fn number(&mut self, key: &str, value: f64, allowed: Allowed) {
        if let Err(allowed) = allowed.check(value) {
            self.wrong(key, text::number(value), allowed);
        }
    }

    fn wrong(&mut self, key: &str, value: impl ToString, allowed: impl Into<String>) {
        self.wrong.push(ScenarioError::Value {
            origin: self.scenario.source.origin.clone(),
            place: self.scenario.place(key),
            key: key.into(),
            value: value.to_string(),
            allowed: allowed.into(),
        });
    }
}
